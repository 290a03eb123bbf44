"""`rov-cosim certify`: why a system holds, or does not, before it is run."""

import shlex
import signal
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager
from functools import partial
from multiprocessing import active_children, get_context
from pathlib import Path

import click

from ...control.certificate import Certificate
from ...errors import UserError
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
        each = map if jobs == 1 else stack.enter_context(_processes(jobs)).map
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


@contextmanager
def _processes(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """Yield processes that leave Ctrl-C to this one, and end with the context, whatever they are at."""
    context = get_context(servant.method())
    pool = ProcessPoolExecutor(jobs, context, signal.signal, (signal.SIGINT, signal.SIG_IGN))
    try:
        yield pool
    except BrokenProcessPool:
        raise UserError("A process that certifies was ended, perhaps for want of memory: take fewer --jobs.") from None
    finally:
        for process in active_children():
            process.terminate()
        pool.shutdown(cancel_futures=True)
