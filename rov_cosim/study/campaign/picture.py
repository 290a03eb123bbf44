"""A campaign in one picture: the verdicts, what matters, and the first score over each parameter."""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..limits import UNITS
from ..matrix_tables import COLOURS
from ..plots import save
from ..scores import VERDICTS
from .analysis import CHANCE, effects, measures, numbers, share
from .conduct import Outcome

_COLUMNS = 3
_MOST = 12
"""Parameters that are drawn."""


def draw(outcome: Outcome, title: str, path: Path) -> None:
    """Draw a campaign; a run without a number stands at the top of its panel."""
    shown = list(outcome.draws)[:_MOST]
    rows = 1 + -(-len(shown) // _COLUMNS)
    figure = Figure(figsize=(12, 1.2 + 3 * rows), layout="constrained")
    grid = figure.add_gridspec(rows, _COLUMNS)
    _verdicts(figure.add_subplot(grid[0, 0]), outcome)
    _effects(figure.add_subplot(grid[0, 1:]), outcome)
    name = next(iter(measures(outcome)[1:]), "verdict")
    for i, end in enumerate(shown):
        _scatter(figure.add_subplot(grid[1 + i // _COLUMNS, i % _COLUMNS]), outcome, end, name)
    figure.suptitle(f"{title}: {len(outcome.scores)} runs, passed {share(outcome.passed)}", fontsize=12)
    save(figure, path)


def _verdicts(panel: Any, outcome: Outcome) -> None:
    counts = Counter(score.verdict for score in outcome.scores)
    for i, verdict in enumerate(VERDICTS):
        found = share([score.verdict == verdict for score in outcome.scores])
        part = 100 * counts[verdict] / len(outcome.scores)
        bounds = [[max(part - 100 * found.low, 0)], [max(100 * found.high - part, 0)]]
        panel.barh(i, part, xerr=bounds, color=COLOURS[i], edgecolor="black", linewidth=0.5, capsize=3)
        panel.text(min(100 * found.high, 100) + 2, i, f"{counts[verdict]}", va="center", fontsize=9)
    panel.set_yticks(range(len(VERDICTS)), VERDICTS)
    panel.invert_yaxis()
    panel.set_xlim(0, 115)
    panel.set_xlabel("share of the runs [%], with 95 % interval", fontsize=9)


def _effects(panel: Any, outcome: Outcome) -> None:
    found, names = effects(outcome), measures(outcome)
    height = 0.8 / len(names)
    for i, name in enumerate(names):
        parts = [e.share if (e := row[name]) and e.chance <= CHANCE else 0.0 for row in found.values()]
        panel.barh(np.arange(len(found)) + (i + 0.5) * height - 0.4, parts, height, label=name)
    panel.set_yticks(range(len(found)), found, fontsize=9)
    panel.invert_yaxis()
    panel.set_xlim(left=0)
    panel.set_xlabel("share of the variance of a score's ranks that goes with the parameter", fontsize=9)
    panel.legend(fontsize=8, loc="lower right")
    panel.grid(axis="x", alpha=0.3)


def _scatter(panel: Any, outcome: Outcome, end: str, name: str) -> None:
    column, score = outcome.draws[end], numbers(outcome.scores, name)
    is_finite = np.isfinite(score)
    top = 1.1 * score[is_finite].max() if is_finite.any() else 1.0
    y = np.where(is_finite, score, top)
    if column.dtype == object or column.dtype == bool or len(np.unique(column)) <= _MOST:
        labels, x = np.unique(column.astype(str) if column.dtype == object else column, return_inverse=True)
        panel.set_xticks(range(len(labels)), [str(label) for label in labels], fontsize=8)
        panel.set_xlim(-0.6, len(labels) - 0.4)
        # Spread, that points of one value do not hide each other; evenly, that the picture is the same each time.
        x = x + 0.5 * (np.arange(len(x)) * 0.618034 % 1 - 0.5)
    else:
        x = column
    verdicts = np.array([s.verdict for s in outcome.scores])
    for verdict, colour in zip(VERDICTS, COLOURS, strict=True):
        of_it = verdicts == verdict
        style = {"s": 9, "edgecolors": "black", "linewidths": 0.2}
        panel.scatter(x[of_it], y[of_it], color=colour, **style)
    panel.set_xlabel(end, fontsize=9)
    panel.set_ylabel(f"{name} [{UNITS[name]}]" if name in UNITS else name, fontsize=9)
    panel.grid(alpha=0.3)
