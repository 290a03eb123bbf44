"""The command `rov-cosim`."""

import pkgutil
import sys
from importlib import import_module
from io import TextIOWrapper
from typing import Any

import click

from ..exporters.zig import BuildError
from ..handover.check import CheckError
from ..master.master import SimulationError
from ..ssp.wiring import WiringError
from ..study.campaign import MatrixError
from . import commands


class _Commands(click.Group):
    """The commands of `commands`, each loaded when it is called for.

    It ends with one line on stderr and exit status 1 where the user's input is at fault.
    """

    def list_commands(self, context: click.Context) -> list[str]:
        """Return the names of all commands."""
        return [module.name for module in pkgutil.iter_modules(commands.__path__)]

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        """Return a command, or None if there is none of the name."""
        if name not in self.list_commands(context):
            return None
        command: click.Command = import_module(f"{commands.__name__}.{name}").command
        return command

    def invoke(self, context: click.Context) -> Any:
        try:
            return super().invoke(context)
        except BrokenPipeError:
            raise  # click ends quietly
        except (BuildError, CheckError, MatrixError, WiringError, SimulationError, OSError) as error:
            raise click.ClickException(str(error)) from error


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="rov-cosim")
def main() -> None:
    """Hold an underwater vehicle in place: build, run and compare systems of FMUs."""
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(
            errors="backslashreplace"
        )  # as on stderr: a name may have letters that the encoding lacks


if __name__ == "__main__":
    main()
