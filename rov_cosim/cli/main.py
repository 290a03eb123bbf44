"""The command `rov-cosim`."""

import pkgutil
import sys
from difflib import get_close_matches
from importlib import import_module
from io import TextIOWrapper
from typing import Any

import click

from ..errors import UserError
from ..master.interrupts import terminate_as_interrupted
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

    def resolve_command(
        self, context: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that is called; a misspelt one is told what may be meant."""
        try:
            return super().resolve_command(context, args)
        except click.UsageError as error:
            close = get_close_matches(args[0], self.list_commands(context), n=1)
            hint = f" Did you mean {close[0]}?" if close else ""
            raise click.UsageError(f"{error.message}{hint}", context) from None

    def invoke(self, context: click.Context) -> Any:
        try:
            return super().invoke(context)
        except BrokenPipeError:
            raise  # click ends quietly
        except FileExistsError as error:
            raise click.ClickException(f"{error.filename} is a file; a folder is needed there.") from error
        except (UserError, OSError) as error:
            raise click.ClickException(str(error)) from error


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="rov-cosim")
def main() -> None:
    """Hold an underwater vehicle in place: build, run and compare systems of FMUs."""
    terminate_as_interrupted()
    if isinstance(sys.stdout, TextIOWrapper):  # as on stderr: a name may have letters that the encoding lacks
        sys.stdout.reconfigure(errors="backslashreplace")


if __name__ == "__main__":
    main()
