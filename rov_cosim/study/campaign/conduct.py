"""A campaign from its file to its table: what is missing is run, and recorded as it comes."""

from collections.abc import Callable, Generator, Iterable
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ...ssp.checks import problems_of
from ...ssp.wiring import Wiring, WiringError
from ..assessment import assessable
from ..changes import Changes
from ..limits import broken
from ..runs import opened
from ..scores import Score
from . import engine
from .case import Case
from .declared import Declared
from .draws import Table, drawn
from .errors import CampaignError
from .records import Records

Progress = Callable[[Iterable[int], int, int], Iterable[int]]
"""Wraps the runs as they come to an end, given the number of all and of those that were recorded before."""


@dataclass(frozen=True)
class Outcome:
    """A campaign that came to its end: what varied, the score of each run, and whether it passed, in order."""

    declared: Declared
    draws: Table
    scores: tuple[Score, ...]
    passed: tuple[bool, ...]


def conduct(
    declared: Declared,
    path: Path,
    jobs: int,
    scheduler: str = "",
    fresh: bool = False,
    progress: Progress = lambda runs, total, before: runs,
    warn: Callable[[str], None] = lambda message: None,
    say: Callable[[str], object] = lambda line: None,
) -> Outcome:
    """Run what is not recorded yet of a campaign, and write its table.

    Parameters
    ----------
    path : of the table, a Parquet file.
    jobs, scheduler : as in `engine.run_all`.
    fresh : forget what is recorded.
    say : is told in a line what a build begins.

    Raises
    ------
    BuildError : an FMU cannot be built.
    WiringError : the system, a change or a drawn value is wrong; nothing has run.
    CampaignError : interrupted, or the workers failed; what is done is recorded.
    """
    with opened(declared.system, replace(declared.changes, troubles=()), declared.export, warn, say) as wiring:
        draws = drawn(declared, wiring)
        total = len(next(iter(draws.values())))
        check(declared, draws, wiring, warn)
        digest = sha256(_identity(declared, draws, wiring).encode()).hexdigest()
        records = Records(path, draws, digest, warn)
        if fresh:
            records.forget()
        if strange := [p for p in path.parent.glob(f"{path.stem}.parts-*") if p != records.parts]:
            warn(
                f"{strange[0]} has runs of another form of this campaign: they are not taken; remove it when you like."
            )
        todo, before = [run for run in range(total) if run not in records.scores], len(records.scores)

        def runs() -> Generator[int, None, None]:
            how = (jobs, scheduler, declared.settings, before > 0)
            with closing(engine.run_all({"": wiring}, partial(_case, declared, draws), todo, *how)) as chunks:
                for scores in chunks:
                    records.add(scores)
                    yield from scores

        try:
            if todo:
                with closing(runs()) as done:
                    for _ in progress(done, total, before):
                        pass
        except (KeyboardInterrupt, CampaignError) as error:
            what = "Interrupted:" if isinstance(error, KeyboardInterrupt) else str(error)
            kept = f"{len(records.scores)} of {total} runs are recorded; the same command goes on from there."
            raise CampaignError(f"{what} {kept}") from None
        passed = {run: not broken(score, declared.limits) for run, score in records.scores.items()}
        records.finish(passed)
    order = range(total)
    return Outcome(declared, draws, tuple(records.scores[n] for n in order), tuple(passed[n] for n in order))


def check(declared: Declared, draws: Table, wiring: Wiring, warn: Callable[[str], None]) -> None:
    """Raise WiringError if a run of each trouble could not begin, or there is nothing to score."""
    if not assessable(wiring):
        raise WiringError(wiring.name, ["There is no vehicle with a pose eta in it, so there is nothing to score."])
    troubles = draws["trouble"].tolist() if "trouble" in draws else [""]
    for run in {trouble: troubles.index(trouble) for trouble in troubles}.values():
        changed = _case(declared, draws, run).changes.applied(wiring, warn)
        if problems := problems_of(declared.settings.timed(changed)):
            raise WiringError(wiring.name, problems)


def _case(declared: Declared, draws: Table, run: int) -> Case:
    values: dict[str, Any] = {}
    for end, column in draws.items():
        also = declared.vary[end].also if end in declared.vary else ()
        values |= dict.fromkeys((end, *also), column[run : run + 1].tolist()[0])
    trouble = [values.pop("trouble")] if "trouble" in values else []
    return Case("", Changes(values=values, troubles=(*declared.changes.troubles, *trouble)))


def _identity(declared: Declared, draws: Table, wiring: Wiring) -> str:
    """Return all that the scores depend on."""
    elements = [
        (e.name, sha256(e.fmu.read_bytes()).hexdigest(), sorted(e.start_values.items())) for e in wiring.elements
    ]
    times = (wiring.start_time, wiring.stop_time, wiring.step_size)
    what = (version("rov-cosim"), elements, wiring.links, times, declared.settings, declared.changes.troubles)
    also = {end: varied.also for end, varied in declared.vary.items()}
    return repr((what, also, {end: column.tolist() for end, column in draws.items()}))
