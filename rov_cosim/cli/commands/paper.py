"""`rov-cosim paper`: the paper's figures and claims by runs of its systems."""

from pathlib import Path

import click

from ...report.paper import write
from ...study.runs import results_folder
from .. import outputs


@click.command()
@click.option(
    "--output",
    type=outputs.FOLDER,
    help="Folder of PAPER.md, its pictures, and settling.svg; build/results/paper if left out.",
)
def command(output: Path | None) -> None:
    """Write the paper's figures, its claims, and what it leaves open, each beside runs of its systems."""
    for path in write(output or results_folder() / "paper", "rov-cosim paper --output docs"):
        click.echo(path)
