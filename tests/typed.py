"""The command as a user types it, the file that it reads, and the line that it ends with."""

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


def one_line(done) -> str:
    """Return what a command that failed says, which is a line, after click's own about the usage."""
    assert done.exit_code in (1, 2)
    assert isinstance(done.exception, SystemExit)
    (line,) = (text for text in done.output.splitlines() if text and not text.startswith(("Usage: ", "Try ")))
    return line


def mapped(folder, text):
    """Return a file with a map."""
    path = folder / "map.toml"
    path.write_text(text, encoding="utf-8")
    return path
