"""`rov-cosim certify`: why a system holds, or does not, before it is run."""

from pathlib import Path

import click

from ...control.certificate import Certificate
from ...ssp.declaration import System
from ...study.certificate_page import page
from ...study.changes import Changes
from ...study.looped import loop_of
from ...study.runs import opened
from ...study.screen import counted, say
from .. import options


@click.command()
@click.argument("system", type=options.SystemType())
@options.changes
@click.option(
    "--states",
    type=click.IntRange(min=0),
    default=1000,
    show_default=True,
    help="States at which V' of the theorem is computed; some 200 take a second. 0: none.",
)
def command(system: System | Path, changes: Changes, states: int) -> None:
    """Certify SYSTEM: gains, margins, thrust, what is learned, and the theorem's conditions."""
    with counted() as warn, opened(system, changes, warn=warn, progress=say) as wiring:
        certificate = Certificate(wiring.name, loop_of(wiring))
    worst = certificate.descent(states) if states and certificate.is_adaptive else None
    click.echo("\n".join(page(certificate, worst)))
