"""`rov-cosim show`: what a system is made of, and what the variables of its elements are."""

import shutil
from pathlib import Path

import click

from ...ssp.declaration import System
from ...ssp.wiring import called_by_fmu, suggestion
from ...study.changes import Changes
from ...study.runs import opened
from ...study.screen import say
from .. import options, outputs
from ..description import element_lines, system_lines


@click.command()
@click.argument("system", type=options.SystemType())
@click.argument("element", required=False)
@click.option("--search", default="", metavar="TEXT", help="Only variables with this in their name or meaning.")
@click.option(
    "--picture",
    type=outputs.Place(".png", ".svg"),
    help="Draw the elements and their connections.",
)
@options.export
@options.changes
def command(
    system: System | Path, element: str | None, search: str, picture: Path | None, export: str, changes: Changes
) -> None:
    """Show the elements and connections of SYSTEM, or the inputs, outputs and parameters of an ELEMENT."""
    width = shutil.get_terminal_size((120, 24)).columns
    with opened(system, changes, export, progress=say) as wiring:
        names = [one.name for one in wiring.elements]
        if element is not None and element not in names:
            hint = f"{wiring.name} has no element {element}.{suggestion(element, names)} It has {', '.join(names)}."
            raise click.UsageError(called_by_fmu(element, wiring.elements) or hint)
        if element is None and not search:
            parts = ["\n".join(system_lines(wiring, width))]
        else:
            chosen = (one for one in wiring.elements if element in (None, one.name))
            parts = [part for one in chosen if (part := "\n".join(element_lines(wiring, one, search, width)))]
        if picture:
            from ...study.wiring_picture import draw_wiring  # loads matplotlib, which takes a while

            draw_wiring(wiring, picture)
    if not parts:
        raise click.ClickException(f"Nothing in {element or wiring.name} has {search!r} in its name or meaning.")
    click.echo("\n\n".join(parts))
