"""A campaign: every vehicle, with every controller, in every trouble, run in parallel processes and scored."""

import os
import signal
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from itertools import product
from multiprocessing import active_children, get_context, parent_process
from multiprocessing.connection import wait
from threading import Thread
from typing import Any, NamedTuple

from ..errors import UserError
from ..master.instances import Instances
from ..master.unpacked import Folders, unpacked
from ..ssp.declaration import System, wire
from ..ssp.wiring import Wiring, WiringError
from ..systems.fleet import holding
from ..systems.loop import controller_in
from .changes import Changes
from .nominal import DoesNotApplyError
from .runs import simulated
from .scores import Score
from .troubles import TROUBLES


class Cell(NamedTuple):
    """One run of the campaign; `vehicle` is one of `fleet.VEHICLES`, or the name of a system."""

    vehicle: str
    controller: str
    trouble: str


Loops = Mapping[tuple[str, str], Wiring]
"""The loop of each vehicle and controller."""


@dataclass(frozen=True)
class Campaign:
    """The scores of the cells that were run, and why each of the others does not apply."""

    scores: Mapping[Cell, Score]
    left_out: Mapping[Cell, str]


class CampaignError(UserError):
    """The campaign did not get to its end; `campaign` holds what was computed until then."""

    def __init__(self, message: str, campaign: Campaign) -> None:
        super().__init__(message)
        self.campaign = campaign


def wired(
    vehicles: Sequence[str],
    controllers: Sequence[str],
    changes: Changes | None = None,
    warn: Callable[[str], None] = lambda message: None,
    systems: Sequence[System] = (),
    progress: Callable[[str], object] = lambda line: None,
) -> Loops:
    """Return the loop of each vehicle with each controller, and those of further systems, with changes in them.

    Their FMUs are native ones, built first.

    Raises
    ------
    BuildError : an FMU cannot be built.
    WiringError : a vehicle's file or a change is wrong.
    """
    changes, once = changes or Changes(), cache(warn)  # the same for every loop
    loops = {pair: holding(*pair) for pair in product(vehicles, controllers)}
    loops |= {(system.name, controller_in(system)): system for system in systems}
    return {pair: changes.applied(wire(system, progress=progress), once) for pair, system in loops.items()}


def run_all(
    loops: Loops,
    troubles: Sequence[str],
    jobs: int,
    progress: Callable[[Iterable[Any], int], Iterable[Any]] = lambda done, total: done,
) -> Campaign:
    """Run each loop in each of `TROUBLES` that is named, in so many processes.

    `progress` wraps the runs as they come to an end, given their number.

    Raises
    ------
    CampaignError : interrupted, or a process died; it holds the scores so far.
    """
    left_out = {cell: why for cell in _cells(loops, troubles) if (why := _why_not(loops, cell))}
    cells = [cell for cell in _cells(loops, troubles) if cell not in left_out]
    done: dict[Cell, Score] = {}

    def so_far() -> Campaign:
        return Campaign({cell: done[cell] for cell in cells if cell in done}, left_out)

    # Processes that are spawned, not forked, inherit no locks of this one's threads.
    with (
        unpacked(*loops.values()) as folders,
        ProcessPoolExecutor(jobs, get_context("spawn"), initializer=_begin, initargs=(loops, folders)) as pool,
    ):
        try:
            with _interrupts_blocked():
                futures = {pool.submit(_run, cell): cell for cell in cells}
            for future in progress(as_completed(futures), len(cells)):
                done[futures[future]] = future.result()
        except KeyboardInterrupt:
            raise CampaignError(f"Interrupted after {len(done)} of {len(cells)} runs.", so_far()) from None
        except BrokenProcessPool:
            for process in active_children():  # the pool would wait for one that outlives its order to end
                process.kill()
            message = f"A process died, of an FMU that crashed it, after {len(done)} of {len(cells)} runs."
            raise CampaignError(message, so_far()) from None
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
    return so_far()


def score_of(wiring: Wiring, trouble: str, instances: Instances | None = None) -> Score:
    """Return the score of a loop in one of `TROUBLES`; `instances` as in `simulate`.

    Raises
    ------
    DoesNotApplyError : the trouble is of something that the loop has not.
    """
    troubled = TROUBLES[trouble].applied(wiring)
    try:
        done = simulated(troubled, progress=lambda steps: steps, instances=instances)
    except WiringError as error:
        return Score("lost", reason=str(error))
    return done.score or Score("lost", reason="There is no vehicle with a pose eta in it.")


def _cells(loops: Loops, troubles: Sequence[str]) -> list[Cell]:
    return [Cell(*loop, trouble) for loop, trouble in product(loops, troubles)]


def _why_not(loops: Loops, cell: Cell) -> str:
    try:
        TROUBLES[cell.trouble].applied(loops[cell.vehicle, cell.controller])
    except DoesNotApplyError as error:
        return " ".join(error.problems)
    return ""


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Hold Ctrl-C back; processes that begin meanwhile are never told of it, for it is this one's to answer."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


_work: tuple[Loops, Instances | None] = {}, None
"""What a process of the pool runs."""


def _begin(loops: Loops, folders: Folders) -> None:
    global _work
    _work = loops, Instances(folders=folders)
    parent = parent_process()
    if parent:  # a process whose parent was killed would wait for ever
        Thread(target=lambda: (wait([parent.sentinel]), os._exit(1)), daemon=True).start()


def _run(cell: Cell) -> Score:
    loops, instances = _work
    return score_of(loops[cell.vehicle, cell.controller], cell.trouble, instances)
