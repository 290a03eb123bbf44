"""The command as a user types it."""

from click.testing import CliRunner, Result

from rov_cosim.cli.main import main


def call(*arguments, **options) -> Result:
    """Run `rov-cosim` with some arguments; what it printed and how it ended."""
    return CliRunner().invoke(main, [str(argument) for argument in arguments], **options)


def ok(*arguments, **options) -> str:
    """Run a command that must end well; what it printed."""
    done = call(*arguments, **options)
    assert done.exit_code == 0, done.output
    return done.output
