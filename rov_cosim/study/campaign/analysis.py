"""What a campaign says: the share that passed, the spread of the scores, and which of what varied matters.

That is asked of the ranks, for a lost run has no number but is the worst: the share of their variance that goes with
one parameter, be the relation monotonic or not, by Kruskal and Wallis's H; its direction by Spearman's rho. Both take
any draws, where indices after Sobol' would take runs of their own for each parameter.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from ..limits import UNITS
from ..scores import VERDICTS, Score
from .conduct import Outcome

CONFIDENCE = 0.95
CHANCE = 0.01
"""Probability below which an effect is not laid to chance."""
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
CLASSES, LEAST = 10, 5
"""Classes of a parameter with more values than that, of equal numbers of runs; and the fewest runs of one."""


class Share(NamedTuple):
    """So many of so many, and the interval that holds their share with `CONFIDENCE`."""

    n: int
    total: int
    low: float
    high: float

    def __str__(self) -> str:
        part = f"{100 * self.n / self.total:.1f} %"
        return f"{part} ({100 * self.low:.1f} to {100 * self.high:.1f} %), {self.n} of {self.total}"


class Effect(NamedTuple):
    """How a score goes with what varies: share of the ranks' variance, Spearman's rho (None of names), chance."""

    share: float
    rho: float | None
    chance: float


def share(passed: Sequence[bool]) -> Share:
    """Return the share that is true, with Wilson's interval."""
    n = int(sum(passed))
    low, high = stats.binomtest(n, len(passed)).proportion_ci(CONFIDENCE, method="wilson")
    return Share(n, len(passed), float(low), float(high))


def numbers(scores: Sequence[Score], name: str) -> NDArray[np.float64]:
    """Return a score of each run, shape (runs,): infinite where there is none, a verdict as its place in `VERDICTS`."""
    values = (VERDICTS.index(s.verdict) if name == "verdict" else getattr(s, name) for s in scores)
    found = np.array([np.inf if value is None else float(value) for value in values])
    return np.where(np.isnan(found), np.inf, found)


def effect(parameter: NDArray[Any], score: NDArray[np.float64]) -> Effect | None:
    """Return how a score goes with a parameter; None if one is the same in all runs, or the runs are too few."""
    distinct, codes = np.unique(parameter.astype(str) if parameter.dtype == object else parameter, return_inverse=True)
    if len(distinct) <= CLASSES:
        groups = [score[codes == i] for i in range(len(distinct))]
    else:
        classes = min(CLASSES, len(score) // LEAST)
        groups = [score[part] for part in np.array_split(np.argsort(codes, kind="stable"), max(classes, 1))]
    if len(groups) < 2 or len(score) < len(groups) * LEAST or (score == score[0]).all():
        return None
    found = stats.kruskal(*groups)
    rho = None if parameter.dtype == object else float(stats.spearmanr(codes, score).statistic)
    part = (found.statistic - len(groups) + 1) / (len(score) - len(groups))
    return Effect(float(np.clip(part, 0, 1)), rho, float(found.pvalue))


def effects(outcome: Outcome) -> dict[str, dict[str, Effect | None]]:
    """Return the effect of all that varies on the verdict and the reported scores, by parameter and score."""
    scores = {name: numbers(outcome.scores, name) for name in measures(outcome)}
    return {
        end: {name: effect(column, score) for name, score in scores.items()} for end, column in outcome.draws.items()
    }


def measures(outcome: Outcome) -> list[str]:
    """Return the verdict and the reported scores that some run has."""
    return ["verdict", *(n for n in outcome.declared.scores if any(getattr(s, n) is not None for s in outcome.scores))]


def report(outcome: Outcome) -> str:
    """Return all of it as text."""
    return "\n".join(_lines(outcome))


def _lines(outcome: Outcome) -> Iterator[str]:
    counts = Counter(score.verdict for score in outcome.scores)
    yield f"{len(outcome.scores)} runs: {', '.join(f'{counts[verdict]} {verdict}' for verdict in VERDICTS)}"
    reasons = Counter(score.reason for score in outcome.scores if score.reason)
    for reason, times in reasons.most_common(5):
        yield f"  lost {times}: {reason}"
    rule = ", ".join(
        f"{name} at {'worst' if name == 'verdict' else 'most'} {limit}"
        for name, limit in outcome.declared.limits.items()
    )
    yield f"held:   {share([score.verdict == 'held' for score in outcome.scores])}"
    yield f"passed: {share(outcome.passed)}: {rule}"
    if len(outcome.declared.grid) and len(outcome.scores) > 1:
        yield from _combinations(outcome)
    names = measures(outcome)[1:]
    yield f"\n{'score':16}" + "".join(f"{f'{100 * q:g} %':>10}" for q in QUANTILES)
    for name in names:
        # No interpolation: between the worst run that has a number and one that has none there is nothing.
        found = np.quantile(numbers(outcome.scores, name), QUANTILES, method="inverted_cdf")
        cells = ("none" if np.isinf(value) else f"{value:.4g}" for value in found)
        yield f"{f'{name} [{UNITS[name]}]':16}" + "".join(f"{cell:>10}" for cell in cells)
    yield from _effects(outcome)


def _combinations(outcome: Outcome) -> Iterator[str]:
    grid = outcome.declared.grid
    labels = [", ".join(f"{end}={value}" for end, value in zip(grid, v, strict=True)) for v in product(*grid.values())]
    width = max(map(len, labels))
    yield f"\n{'passed of each combination':{width}}"
    for i, label in enumerate(labels):
        yield f"{label:{width}}  {share(outcome.passed[i * outcome.declared.runs : (i + 1) * outcome.declared.runs])}"


def _effects(outcome: Outcome) -> Iterator[str]:
    found, names = effects(outcome), measures(outcome)
    width = max(map(len, [*found, "what matters"]))
    yield f"\n{'what matters':{width}}" + "".join(f"{name:>14}" for name in names)
    for end, row in sorted(found.items(), key=lambda item: -max((e.share for e in item[1].values() if e), default=0)):
        yield f"{end:{width}}" + "".join(f"{_cell(row[name]):>14}" for name in names)
    yield "share of the variance of the score's ranks that goes with it, and Spearman's rho; . : chance does as much"


def _cell(found: Effect | None) -> str:
    if found is None or found.chance > CHANCE:
        return "."
    return f"{found.share:.2f}" + ("      " if found.rho is None else f" {found.rho:+.2f}")
