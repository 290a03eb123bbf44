"""`rov-cosim certify`: why a system holds, or does not, before it is run."""

import shlex
import sys
from pathlib import Path

import click

from ...control.certificate import Certificate
from ...ssp.declaration import System
from ...study.certificate_page import page, table
from ...study.changes import Changes
from ...study.looped import loop_of
from ...study.runs import opened
from ...study.screen import counted, say
from .. import options, outputs


@click.command()
@click.argument("systems", type=options.SystemType(), nargs=-1, required=True)
@options.changes
@click.option(
    "--states",
    type=click.IntRange(min=0),
    default=1000,
    show_default=True,
    help="States at which V' of the theorem is computed; some 200 take a second. 0: none.",
)
@click.option(
    "--table",
    "table_path",
    type=outputs.Place(".md"),
    help="Write a table of all SYSTEMS too, in Markdown.",
)
def command(systems: tuple[System | Path, ...], changes: Changes, states: int, table_path: Path | None) -> None:
    """Certify SYSTEMS: gains, margins, thrust, what is learned, and the theorem's conditions."""
    certificates = []
    for i, system in enumerate(systems):
        with counted() as warn, opened(system, changes, warn=warn, progress=say) as wiring:
            certificate = Certificate(wiring.name, loop_of(wiring))
        worst = certificate.descent(states) if states and certificate.is_adaptive else None
        click.echo("\n" * bool(i) + "\n".join(page(certificate, worst)))
        certificates.append(certificate)
    if table_path:
        table_path.write_text(table(certificates, shlex.join(["rov-cosim", *sys.argv[1:]])), encoding="utf-8")
        click.echo(f"\n{table_path}")
