"""A gate from its file to green and red cells: whatever breaks is a red cell that says so, and the others run on.

Each run has a process of its own, which an FMU may crash or hold up; so threads of this one are enough to use all
cores.
"""

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple

from ...errors import UserError
from ...ssp.wiring import Wiring, WiringError
from ..assessment import assessable
from ..campaign.case import score_of
from ..changes import Changes
from ..limits import OF_POSE, Limits, broken
from ..runs import opened
from ..scores import Score
from ..settings import Settings
from . import signs, terms
from .declared import Column, Gate
from .signs import DURATION
from .vacuous import NO_LOAD, UNHELD, uncontrolled

UNWEIGHED = (
    "the plant's terms are not weighed: no element has a vehicle's inputs and parameters by our names, "
    "or it does not run beside copies of itself."
)
Status = Literal["green", "red", "left out"]
Progress = Callable[[Iterable[Any], int], Iterable[Any]]
"""Wraps the runs as they come to an end, given their number."""


class Cell(NamedTuple):
    """A system in a trouble."""

    system: str
    trouble: str


@dataclass(frozen=True)
class Result:
    """What became of a cell, and why it is red; the score if it ran."""

    status: Status
    limits: Limits
    score: Score | None = None
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """A gate that was run.

    Parameters
    ----------
    name : of the gate.
    results : by cell, in the order of the file.
    fmus : by system its elements and the FMUs that they are.
    faults : by system where its loop is wrong.
    warnings : what makes a green cell worth less.
    """

    name: str
    results: Mapping[Cell, Result]
    fmus: Mapping[str, Mapping[str, str]]
    faults: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    def of(self, status: Status) -> dict[Cell, Result]:
        """Return the cells of a status."""
        return {cell: result for cell, result in self.results.items() if result.status == status}

    @property
    def lines(self) -> list[str]:
        """A line for each thing that is wrong, cells that fail for the same reason in one."""
        by_reason: dict[tuple[str, str], list[str]] = {}
        for cell, result in self.of("red").items():
            for reason in result.reasons:
                by_reason.setdefault((cell.system, reason), []).append(cell.trouble)
        lines = [f"{system}, {', '.join(troubles)}: {reason}" for (system, reason), troubles in by_reason.items()]
        return lines + [f"{system}: {fault}" for system, found in self.faults.items() for fault in found]

    @property
    def verdict(self) -> str:
        """In a line how it went."""
        red, ran = len(self.of("red")), len(self.results) - len(self.of("left out"))
        told = f"red, {red} of {ran} cells failed" if self.is_red else f"green, {ran} of {ran} cells passed"
        return f"gate {self.name}: {told}" + ("" if red or not self.is_red else f"; wrong: {', '.join(self.faults)}")

    @property
    def is_red(self) -> bool:
        """Whether a cell is red or a system is wrong."""
        return bool(self.of("red") or self.faults)


def conduct(
    gate: Gate,
    jobs: int,
    progress: Progress = lambda runs, total: runs,
    warn: Callable[[str], None] = lambda message: None,
    say: Callable[[str], object] = lambda line: None,
) -> Outcome:
    """Run a gate in so many processes at once; `warn` and `say` as in `runs.opened`."""
    with ExitStack() as stack:
        pool = stack.enter_context(ThreadPoolExecutor(jobs))
        stack.callback(pool.shutdown, wait=False, cancel_futures=True)  # interrupted: what has not begun does not
        return _Conduct(gate, pool, stack, progress, warn, say).outcome()


class _Conduct:
    """A gate while it runs: `results` grow."""

    def __init__(
        self,
        gate: Gate,
        pool: ThreadPoolExecutor,
        stack: ExitStack,
        progress: Progress,
        warn: Callable[[str], None],
        say: Callable[[str], object],
    ) -> None:
        self.gate, self.pool, self.stack, self.progress, self.warn, self.say = gate, pool, stack, progress, warn, say
        self.results: dict[Cell, Result] = {}
        self.plain: dict[str, Wiring] = {}
        self.loops: dict[Cell, Wiring] = {}
        self.warnings: list[str] = []

    def outcome(self) -> Outcome:
        for column in self.gate.columns:
            self._open(column)
        self._score()
        self._weigh()
        lost = {
            cell.system
            for cell, result in self.results.items()
            if result.score and (result.score.lost_at or 0.0) > DURATION
        }
        found = self._all(signs.faults, {name: self.plain[name] for name in self.plain if name in lost})
        weighed = self._weighed()
        self.warnings += [f"{name}: {UNWEIGHED}" for name, said in weighed.items() if said is None]
        plants = {name: weighed.get(name) or () for name in self.plain}
        wrong = {name: (*said, *found.get(name, signs.Faults()).told(bool(said))) for name, said in plants.items()}
        order = [Cell(column.name, trouble) for column in self.gate.columns for trouble in column.limits]
        fmus = {name: {e.name: e.description.modelName for e in loop.elements} for name, loop in self.plain.items()}
        return Outcome(
            self.gate.name,
            {cell: self.results[cell] for cell in order},
            fmus,
            {name: said for name, said in wrong.items() if said},
            tuple(self.warnings),
        )

    def _open(self, column: Column) -> None:
        """Wire a system, and put it into each of its troubles."""
        cells = {Cell(column.name, trouble): limits for trouble, limits in column.limits.items()}
        try:
            how = (column.changes, self.gate.export, self.warn, self.say)
            wiring = self.stack.enter_context(opened(column.system, *how))
            if not assessable(wiring):
                raise UserError("There is no vehicle with a pose eta in it, so there is nothing to hold.")
        except (UserError, OSError) as error:
            self.results |= {cell: Result("red", limits, reasons=(str(error),)) for cell, limits in cells.items()}
            return
        self.plain[column.name] = wiring
        for cell, limits in cells.items():
            if cell.trouble in column.left_out:
                self.results[cell] = Result("left out", limits, reasons=("named in without",))
                continue
            try:
                self.loops[cell] = Changes(troubles=(cell.trouble,)).applied(wiring)
            except WiringError as error:
                why = f"does not apply: {' '.join(error.problems)} If so it should be, name it in without."
                self.results[cell] = Result("red", limits, reasons=(why,))
        if 2 * len(column.left_out) > len(cells):
            n = f"{len(column.left_out)} of {len(cells)}"
            self.warnings.append(f"{column.name}: {n} troubles are left out: what is left says little.")

    def _score(self) -> None:
        """Run each cell, and each system without a trouble; a cell that the trouble does not change is red."""
        limits = {Cell(c.name, trouble): found for c in self.gate.columns for trouble, found in c.limits.items()}
        changed = {cell for cell, loop in self.loops.items() if loop.elements != self.plain[cell.system].elements}
        calm = {cell._replace(trouble=""): self.plain[cell.system] for cell in changed}
        scores = self._all(_scored, {**calm, **self.loops})
        for cell in self.loops:
            reasons = [str(one) for one in broken(scores[cell], limits[cell])]
            if not reasons and cell in changed and scores[cell] == scores[cell._replace(trouble="")]:
                reasons = ["vacuous: the trouble changes nothing, to the last digit."]
            self.results[cell] = Result("red" if reasons else "green", limits[cell], scores[cell], tuple(reasons))

    def _weigh(self) -> None:
        """Turn green cells red that would be green without the controller, or in which nothing acts on the vehicle."""
        green = [cell for cell, result in self.results.items() if result.status == "green"]
        free = self._all(uncontrolled, {cell: self.loops[cell] for cell in green})
        for cell in green:
            result, (score, stays) = self.results[cell], free[cell]
            others = [free[other].stays for other in green if other.system == cell.system]
            of_pose = {name: limit for name, limit in result.limits.items() if name in OF_POSE}
            reasons = [UNHELD] if not broken(score, of_pose) else [NO_LOAD] if stays and all(others) else []
            if reasons:
                self.results[cell] = replace(result, status="red", reasons=tuple(reasons))

    def _weighed(self) -> dict[str, tuple[str, ...] | None]:
        """Return what is wrong with the terms of each system's plant; systems of one FMU share a run. None: unknown."""
        ours = {column.name for column in self.gate.columns if column.is_ours}
        plants = {name: terms.plant_in(loop) for name, loop in self.plain.items() if name in ours}
        first: dict[Any, Wiring] = {}
        for name, plant in plants.items():
            if plant:
                first.setdefault(plant.fmu, self.plain[name])
        by_fmu = self._all(_faults, first)
        return {name: by_fmu[plant.fmu] if plant else None for name, plant in plants.items()}

    def _all(self, work: Callable[[Wiring, Settings], Any], on: Mapping[Any, Wiring]) -> dict[Any, Any]:
        """Return what work makes of each system."""
        futures = {self.pool.submit(work, wiring, self.gate.settings): key for key, wiring in on.items()}
        done = {futures[future]: future.result() for future in self.progress(as_completed(futures), len(futures))}
        return {key: done[key] for key in on}


def _faults(wiring: Wiring, settings: Settings) -> tuple[str, ...] | None:
    try:
        return terms.faults(wiring, settings)
    except Exception as error:  # as below
        return (f"its plant cannot be weighed, which `terms = false` leaves out: {type(error).__name__}: {error}",)


def _scored(wiring: Wiring, settings: Settings) -> Score:
    try:
        return score_of(wiring, Changes(), settings)
    except Exception as error:  # whatever an FMU makes of this, the other cells run on
        return Score("lost", reason=f"{type(error).__name__}: {error}")
