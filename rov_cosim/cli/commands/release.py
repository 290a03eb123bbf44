"""`rov-cosim release`: all that is handed over, with checksums and a bill of materials."""

import os
import subprocess
import sys
from pathlib import Path

import click

from ...exporters.build import components, project_root
from ...exporters.zig import TARGETS, BuildError
from ...release import settled, source
from ...study.screen import say
from ...systems.catalogue import SYSTEMS
from .. import options, outputs

_ALL = (*components(), *SYSTEMS)


@click.command()
@click.argument("names", type=options.OneOf("component or system", _ALL), nargs=-1, metavar="[NAME]...")
@click.option(
    "--platform", "platforms", type=click.Choice(list(TARGETS)), multiple=True, help="Of FMUs; all if left out."
)
@click.option("--output", type=outputs.FOLDER, help="Folder, which is not there or empty.")
@click.option("--uncommitted", is_flag=True, help="Take changes along that are not committed.")
def command(names: tuple[str, ...], platforms: tuple[str, ...], output: Path | None, uncommitted: bool) -> None:
    """Make wheel, FMUs, archives and kits of components and systems, or of all; the same bytes on every machine."""
    root = project_root()
    folder = (output or root / "build" / "release").absolute()
    source.check_free(folder)
    commit = source.commit(root, uncommitted)
    if not settled.is_settled():
        sys.exit(_again([*names, *(f"--platform={p}" for p in platforms), f"--output={folder}"], uncommitted))
    os.umask(0o022)
    try:
        from ...release.contents import make
    except ModuleNotFoundError as error:
        raise BuildError(f"A release needs {error.name}: pip install 'rov-cosim[release]'.") from None
    make(root, folder, names or _ALL, platforms or [*TARGETS], commit, say)
    click.echo(folder)


def _again(arguments: list[str], uncommitted: bool) -> int:
    """Run the command in a process that begins settled; return its status."""
    command = [sys.executable, "-m", "rov_cosim.cli.main", "release", *arguments, *["--uncommitted"] * uncommitted]
    return subprocess.run(command, env={**os.environ, **settled.variables()}, check=False).returncode
