"""The command `rov-cosim`."""

import pkgutil
import signal
import sys
from importlib import import_module
from io import TextIOWrapper
from typing import Any

import click

from ..errors import UserError
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
        except (UserError, OSError) as error:
            raise click.ClickException(str(error)) from error


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="rov-cosim")
def main() -> None:
    """Hold an underwater vehicle in place: build, run and compare systems of FMUs."""
    # What Ctrl-C cleans up and keeps, an order to terminate does.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    if isinstance(sys.stdout, TextIOWrapper):  # as on stderr: a name may have letters that the encoding lacks
        sys.stdout.reconfigure(errors="backslashreplace")


if __name__ == "__main__":
    main()
