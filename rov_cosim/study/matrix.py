"""The matrix: every vehicle, with every controller, in every trouble, as a campaign."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any, NamedTuple

from ..ssp.declaration import System, wire
from ..ssp.wiring import Wiring
from ..systems.fleet import holding
from ..systems.loop import controller_in
from .campaign.case import Case
from .campaign.errors import CampaignError, with_extra
from .changes import Changes
from .nominal import DoesNotApplyError
from .scores import Score
from .troubles import TROUBLES


class Cell(NamedTuple):
    """One run of the matrix; `vehicle` is one of `fleet.VEHICLES`, or the name of a system."""

    vehicle: str
    controller: str
    trouble: str


Loops = Mapping[tuple[str, str], Wiring]
"""The loop of each vehicle and controller."""


@dataclass(frozen=True)
class Matrix:
    """The scores of the cells that were run, and why each of the others does not apply."""

    scores: Mapping[Cell, Score]
    left_out: Mapping[Cell, str]


class MatrixError(CampaignError):
    """The matrix did not get to its end; `matrix` holds what was computed until then."""

    def __init__(self, message: str, matrix: Matrix) -> None:
        super().__init__(message)
        self.matrix = matrix


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
    scheduler: str = "",
) -> Matrix:
    """Run each loop in each of `TROUBLES` that is named; jobs and scheduler as in `engine.run_all`.

    `progress` wraps the runs as they come to an end, given their number.

    Raises
    ------
    MatrixError : interrupted, or the workers failed; it holds the scores so far.
    CampaignError : a module that it needs is not installed.
    """
    engine = with_extra("engine")
    left_out = {cell: why for cell in _cells(loops, troubles) if (why := _why_not(loops, cell))}
    cells = [cell for cell in _cells(loops, troubles) if cell not in left_out]
    done: dict[Cell, Score] = {}

    def so_far() -> Matrix:
        return Matrix({cell: done[cell] for cell in cells if cell in done}, left_out)

    def case(n: int) -> Case:
        cell = cells[n]
        return Case(cell[:2], Changes(troubles=(cell.trouble,)))

    try:
        with closing(engine.run_all(loops, case, range(len(cells)), jobs, scheduler)) as chunks:
            for n, found in progress((run for chunk in chunks for run in chunk.items()), len(cells)):
                done[cells[n]] = found
    except KeyboardInterrupt:
        raise MatrixError(f"Interrupted after {len(done)} of {len(cells)} runs.", so_far()) from None
    except CampaignError as error:
        raise MatrixError(str(error), so_far()) from error
    return so_far()


def _cells(loops: Loops, troubles: Sequence[str]) -> list[Cell]:
    return [Cell(*loop, trouble) for loop, trouble in product(loops, troubles)]


def _why_not(loops: Loops, cell: Cell) -> str:
    try:
        TROUBLES[cell.trouble].applied(loops[cell.vehicle, cell.controller])
    except DoesNotApplyError as error:
        return " ".join(error.problems)
    return ""
