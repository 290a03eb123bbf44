"""`rov-cosim certify`: why a system holds, or does not, before it is run."""

import shlex
import signal
import sys
from contextlib import ExitStack
from functools import partial
from multiprocessing import get_context
from multiprocessing.pool import Pool
from pathlib import Path

import click

from ...control.certificate import Certificate
from ...ssp.declaration import System
from ...ssp.wiring import Wiring
from ...study.campaign import servant
from ...study.certificate_page import cells, page, table
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
@options.jobs
def command(
    systems: tuple[System | Path, ...], changes: Changes, states: int, table_path: Path | None, jobs: int
) -> None:
    """Certify SYSTEMS: gains, margins, thrust, what is learned, and the theorem's conditions."""
    wirings = []
    for system in systems:
        with counted() as warn, opened(system, changes, warn=warn, progress=say) as wiring:
            wirings.append(wiring)
    jobs, rows = min(jobs, len(wirings)), []
    with ExitStack() as stack:
        each = map if jobs == 1 else stack.enter_context(_processes(jobs)).imap
        for i, (lines, row) in enumerate(each(partial(_certified, states=states), wirings)):
            click.echo("\n" * bool(i) + "\n".join(lines))
            rows.append(row)
    if table_path:
        table_path.write_text(table(rows, shlex.join(["rov-cosim", *sys.argv[1:]])), encoding="utf-8")
        click.echo(f"\n{table_path}")


def _certified(wiring: Wiring, states: int) -> tuple[list[str], list[str]]:
    """Return the page of a system, and its row of the table."""
    certificate = Certificate(wiring.name, loop_of(wiring))
    worst = certificate.descent(states) if states and certificate.is_adaptive else None
    return list(page(certificate, worst)), list(cells(certificate))


def _processes(jobs: int) -> Pool:
    """Return processes that leave Ctrl-C to this one, and end with the context, whatever they are at."""
    return get_context(servant.method()).Pool(jobs, signal.signal, (signal.SIGINT, signal.SIG_IGN))
