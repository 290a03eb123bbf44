"""`rov-cosim run`: a system, simulated."""

from pathlib import Path

import click

from ...ssp.declaration import System
from ...study.changes import Changes
from ...study.runs import run
from ...study.settings import Settings
from .. import options, outputs


@click.command()
@click.argument("system", type=options.SystemType())
@options.export
@options.settings
@options.changes
@click.option("--name", default="", help="Of the files; made of the system and all that differs if left out.")
@click.option("--output", type=outputs.FOLDER, help="Folder for CSV and picture.")
@click.option(
    "--picture",
    type=outputs.Place(".png", ".svg"),
    help="The picture; NAME.png in the folder if left out.",
)
@click.option(
    "--archive",
    type=outputs.Place(".ssp"),
    help="Write what is run as an SSP archive.",
)
@options.fail_on
def command(
    system: System | Path,
    export: str,
    settings: Settings,
    changes: Changes,
    name: str,
    output: Path | None,
    picture: Path | None,
    archive: Path | None,
    fail_on: str | None,
) -> None:
    """Run SYSTEM, a name from `list` or an .ssp file: a table and a verdict, CSV and picture."""
    done = run(
        system,
        changes,
        export=export,
        settings=settings,
        folder=output,
        name=name,
        picture=picture,
        archive=archive,
    )
    if fail_on:
        options.gate({done.name: done.score}, fail_on)
