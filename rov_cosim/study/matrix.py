"""The matrix: every vehicle, with every controller, in every trouble, as a campaign."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ..ssp.declaration import System, wire
from ..ssp.values import Value
from ..ssp.wiring import Wiring
from ..systems.fleet import LOOPS, WIRED, holding
from ..systems.loop import CONTROLLER, controller_in
from .campaign.case import Case
from .campaign.errors import CampaignError, with_extra
from .changes import Changes
from .nominal import DoesNotApplyError
from .scores import VERDICTS, Score
from .troubles import TROUBLES


class Cell(NamedTuple):
    """One run of the matrix; `vehicle` is one of those of `fleet.LOOPS`, or the name of a system."""

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
    """Return the loops of these vehicles and controllers, and further systems, with changes in them.

    A vehicle is one of the fleet, of which some have not all controllers, or an SSV file.

    Their FMUs are native ones, built first. A controller that is swapped is called by its own FMU, and is the same for
    all of `controllers`: it gets the parameters of the first, by equal names or its map.

    Raises
    ------
    BuildError : an FMU cannot be built.
    WiringError : a vehicle's file or a change is wrong.
    """
    changes, once = changes or Changes(), cache(warn)  # the same for every loop
    is_swapped = CONTROLLER in changes.swaps
    pairs = product(vehicles, controllers[:1] if is_swapped else controllers)
    loops = {pair: holding(*pair) for pair in pairs if pair in LOOPS or pair[0] not in WIRED}
    loops |= {(system.name, controller_in(system)): system for system in systems}
    wirings = {pair: changes.applied(wire(system, progress=progress), once) for pair, system in loops.items()}
    if not is_swapped:
        return wirings
    return {(vehicle, _fmu_of(CONTROLLER, wiring)): wiring for (vehicle, _), wiring in wirings.items()}


def run_all(
    loops: Loops,
    troubles: Sequence[str],
    jobs: int,
    progress: Callable[[Iterable[Any], int], Iterable[Any]] = lambda done, total: done,
    scheduler: str = "",
    seeds: int = 1,
) -> Matrix:
    """Run each loop in each of `TROUBLES` that is named; jobs and scheduler as in `engine.run_all`.

    With several seeds, those of noise and current count up from the loop's own, and the score of a cell is its worst.

    `progress` wraps the runs as they come to an end, given their number.

    Raises
    ------
    MatrixError : interrupted, or the workers failed; it holds the scores so far.
    CampaignError : a module that it needs is not installed.
    """
    engine = with_extra("engine")
    left_out = {cell: why for cell in _cells(loops, troubles) if (why := _why_not(loops, cell))}
    cells = [cell for cell in _cells(loops, troubles) if cell not in left_out]
    runs = [(cell, n) for cell in cells for n in range(seeds)]
    done: dict[Cell, list[Score]] = {}

    def so_far() -> Matrix:
        return Matrix({cell: max(done[cell], key=_badness) for cell in cells if cell in done}, left_out)

    def case(n: int) -> Case:
        cell, further = runs[n]
        return Case(cell[:2], Changes(values=_seeds(loops[cell[:2]], further), troubles=(cell.trouble,)))

    try:
        with closing(engine.run_all(loops, case, range(len(runs)), jobs, scheduler)) as chunks:
            for n, found in progress((run for chunk in chunks for run in chunk.items()), len(runs)):
                done.setdefault(runs[n][0], []).append(found)
    except KeyboardInterrupt:
        raise MatrixError(f"Interrupted after {sum(map(len, done.values()))} of {len(runs)} runs.", so_far()) from None
    except CampaignError as error:
        raise MatrixError(str(error), so_far()) from error
    return so_far()


def _fmu_of(element: str, wiring: Wiring) -> str:
    return next(str(one.description.modelName) for one in wiring.elements if one.name == element)


def _seeds(wiring: Wiring, further: int) -> dict[str, Value | str]:
    """Return the seeds of a loop, each so much further than its own; nothing for its own."""
    ends = [f"{element.name}.seed" for element in wiring.elements if "seed" in element.variables]
    return {end: int(wiring.value(end) or 0) + further for end in ends} if further else {}


def _badness(score: Score) -> tuple[int, float]:
    return VERDICTS.index(score.verdict), np.inf if score.rms is None else score.rms


def _cells(loops: Loops, troubles: Sequence[str]) -> list[Cell]:
    return [Cell(*loop, trouble) for loop, trouble in product(loops, troubles)]


def _why_not(loops: Loops, cell: Cell) -> str:
    try:
        TROUBLES[cell.trouble].applied(loops[cell.vehicle, cell.controller])
    except DoesNotApplyError as error:
        return " ".join(error.problems)
    return ""
