"""The matrix: every vehicle, with every controller, in every trouble, run in parallel processes and scored."""

import signal
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache
from itertools import product
from multiprocessing import active_children, get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from fmpy import extract

from ..exporters.build import build_fmus, components, fmu_path
from ..master.master import SimulationError, simulate
from ..ssp.declaration import wire
from ..ssp.swap_map import SwapMap
from ..ssp.swapping import with_swaps
from ..ssp.wiring import Wiring, WiringError
from ..systems.fleet import holding
from .nominal import DoesNotApplyError
from .scores import Score, score
from .troubles import TROUBLES


class Cell(NamedTuple):
    """A place in the matrix."""

    vehicle: str
    controller: str
    trouble: str


Loops = Mapping[tuple[str, str], Wiring]
"""The loop of each vehicle and controller, its FMUs extracted."""


@dataclass(frozen=True)
class Matrix:
    """The scores of the cells that were run, and why each of the others does not apply."""

    scores: Mapping[Cell, Score]
    left_out: Mapping[Cell, str]


class MatrixError(RuntimeError):
    """The matrix did not get to its end; `matrix` holds what was computed until then."""

    def __init__(self, message: str, matrix: Matrix) -> None:
        super().__init__(message)
        self.matrix = matrix


@contextmanager
def wired(
    root: Path,
    vehicles: Sequence[str],
    controllers: Sequence[str],
    swaps: Mapping[str, Path] | None = None,
    maps: Mapping[str, SwapMap] | None = None,
    warn: Callable[[str], None] = lambda message: None,
) -> Iterator[Loops]:
    """Yield the loop of each vehicle with each controller, with native FMUs that are built below `root`.

    The FMUs are extracted until the context ends. `swaps` and `maps` are those of `swapping.with_swaps`.
    """
    build_fmus(root)
    with ExitStack() as stack:
        folder = stack.enter_context(TemporaryDirectory(prefix="rov_cosim_"))
        fmus = {name: Path(extract(str(fmu_path(root, name)), f"{folder}/{name}")) for name in components()}
        loops = {pair: wire(holding(*pair), fmus) for pair in product(vehicles, controllers)}
        told = cache(warn)  # the same for every loop
        yield {
            pair: stack.enter_context(with_swaps(wiring, swaps or {}, maps or {}, told))
            for pair, wiring in loops.items()
        }


def run_all(
    loops: Loops,
    troubles: Sequence[str],
    jobs: int,
    progress: Callable[[Iterable[Any], int], Iterable[Any]] = lambda done, total: done,
) -> Matrix:
    """Run each loop in each of `TROUBLES` that is named, in so many processes.

    `progress` wraps the runs as they come to an end, given their number.

    Raises
    ------
    MatrixError : interrupted, or a process died; it holds the scores so far.
    """
    left_out = {cell: why for cell in _cells(loops, troubles) if (why := _why_not(loops, cell))}
    cells = [cell for cell in _cells(loops, troubles) if cell not in left_out]
    done: dict[Cell, Score] = {}

    def matrix() -> Matrix:
        return Matrix({cell: done[cell] for cell in cells if cell in done}, left_out)

    # Processes that are spawned, not forked, inherit no locks of this one's threads.
    with ProcessPoolExecutor(jobs, get_context("spawn"), initializer=_begin, initargs=(loops,)) as pool:
        try:
            with _interrupts_ignored():  # by the processes for good: Ctrl-C is this one's to answer
                futures = {pool.submit(_run, cell): cell for cell in cells}
            for future in progress(as_completed(futures), len(cells)):
                done[futures[future]] = future.result()
        except KeyboardInterrupt:
            raise MatrixError(f"Interrupted after {len(done)} of {len(cells)} runs.", matrix()) from None
        except BrokenProcessPool:
            for process in active_children():  # the pool would wait for one that outlives its order to end
                process.kill()
            message = f"A process died, of an FMU that crashed it, after {len(done)} of {len(cells)} runs."
            raise MatrixError(message, matrix()) from None
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
    return matrix()


def score_of(wiring: Wiring, trouble: str) -> Score:
    """Return the score of a loop in one of `TROUBLES`.

    Raises
    ------
    DoesNotApplyError : the trouble is of something that the loop has not.
    """
    troubled = TROUBLES[trouble].applied(wiring)
    try:
        return score(simulate(troubled), troubled)
    except (SimulationError, WiringError) as error:
        return Score("lost", reason=str(error))


def _cells(loops: Loops, troubles: Sequence[str]) -> list[Cell]:
    return [Cell(*loop, trouble) for loop, trouble in product(loops, troubles)]


def _why_not(loops: Loops, cell: Cell) -> str:
    try:
        TROUBLES[cell.trouble].applied(loops[cell.vehicle, cell.controller])
    except DoesNotApplyError as error:
        return " ".join(error.problems)
    return ""


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


_loops: Loops = {}
"""What a process of the pool runs."""


def _begin(loops: Loops) -> None:
    global _loops
    _loops = loops


def _run(cell: Cell) -> Score:
    return score_of(_loops[cell.vehicle, cell.controller], cell.trouble)
