"""`rov-cosim show`: what a system is made of, and what the variables of its elements are."""

import shutil
from pathlib import Path
from typing import Any

import click

from ...ssp.declaration import System
from ...ssp.wiring import suggestion
from ...study import session
from .. import options
from ..description import element_lines, system_lines


@click.command()
@click.argument("system", type=options.SystemType())
@click.argument("element", required=False)
@click.option("--search", default="", metavar="TEXT", help="Only variables with this in their name or meaning.")
@options.export
@options.changes
def command(system: System | Path, element: str | None, search: str, export: str, **changes: Any) -> None:
    """Show the elements and connections of SYSTEM, or the inputs, outputs and parameters of an ELEMENT."""
    width = shutil.get_terminal_size((120, 24)).columns
    with session.opened(system, export, **changes) as wiring:
        names = [one.name for one in wiring.elements]
        if element is not None and element not in names:
            hint = suggestion(element, names)
            raise click.UsageError(f"{wiring.name} has no element {element}.{hint} It has {', '.join(names)}.")
        if element is None and not search:
            parts = ["\n".join(system_lines(wiring, width))]
        else:
            chosen = (one for one in wiring.elements if element in (None, one.name))
            parts = [part for one in chosen if (part := "\n".join(element_lines(wiring, one, search, width)))]
    if not parts:
        raise click.ClickException(f"Nothing in {element or wiring.name} has {search!r} in its name or meaning.")
    click.echo("\n\n".join(parts))
