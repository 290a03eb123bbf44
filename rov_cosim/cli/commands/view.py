"""`rov-cosim view`: results as a moving picture."""

from pathlib import Path

import click

from ...ssp.declaration import System
from ...study.changes import Changes
from ...study.runs import opened
from ...study.screen import counted, say
from ...systems.catalogue import SYSTEMS
from .. import options, outputs


def _columns(context: click.Context, parameter: click.Parameter, assignments: tuple[str, ...]) -> dict[str, str]:
    return dict(options.assigned(assignments, "NAME=COLUMN"))


@click.command()
@click.argument("results", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option(
    "--system",
    type=options.SystemType(),
    help="What it is a run of; the name of RESULTS up to a + if left out, or the paper's vehicle.",
)
@options.changes_but_troubles
@click.option(
    "--column",
    "columns",
    multiple=True,
    callback=_columns,
    metavar="NAME=COLUMN",
    help="The column that is NAME here, `rov_plant.eta.z` say; -COLUMN, FACTOR*COLUMN, and groups as well.",
)
@click.option(
    "--output",
    type=outputs.Place(".html"),
    help="The page; beside RESULTS if left out.",
)
def command(
    results: Path, system: System | Path | None, changes: Changes, columns: dict[str, str], output: Path | None
) -> None:
    """Write a page with the moving picture of RESULTS, a CSV of `rov-cosim run` or of another tool."""
    from ...report import bundle, page, view  # what it loads takes a while

    name = results.stem.partition("+")[0]
    system = system or SYSTEMS[name if name in SYSTEMS else "station_keeping"]
    output = output or results.with_suffix(".html")
    looks: dict[str, float] = {}
    for known in (SYSTEMS["station_keeping"], system):
        with opened(known, progress=say) as wiring:
            looks |= view.geometry(wiring)
    with counted() as warn, opened(system, changes, warn=warn, progress=say) as wiring:
        data = view.data(results, wiring, looks, columns)
        text = page.view(results.stem, data, bundle.bundled(*page.VIEW, progress=say))
    output.write_text(text, encoding="utf-8")
    click.echo(f"{output}: {len(text.encode()) / 1e6:.2f} MB")
