"""Scores as a table: on the screen, and as CSV in SI units."""

import csv
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from .assessment import axes
from .runs import Run
from .scores import Score


def write_scores(scores: Mapping[Any, Score], head: tuple[str, ...], path: Path) -> None:
    """Write a row for each run with all that was scored, in SI units and rad.

    The keys of the scores are tuples; `head` names their parts.
    """
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*head, *(field.name for field in fields(Score))])
        for key, score in scores.items():
            values = ("" if v is None else f"{v:.6g}" if isinstance(v, float) else v for v in asdict(score).values())
            writer.writerow([*key, *values])


def comparison(runs: Mapping[str, Run]) -> str:
    """Return a line for each run: when it settles, the mean of each axis in hold, the thrusters, the verdict."""
    width = max(map(len, ["run", *runs]))
    heads = (
        "settles [s]",
        *(f"mean {axis} [mm]" for axis in "xyz"),
        "mean yaw [deg]",
        "worst [mm]",
        "effort [N]",
        "chatter [N/s]",
    )
    lines = [f"{'run':{width}}" + "".join(f"{head:>16}" for head in heads) + "   verdict"]
    for name, run in runs.items():
        score, cells = run.score, [""] * len(heads)
        if score and score.mean is not None:
            means = [axis.mean for axis in axes(run.results, run.wiring)]
            cells = ["never" if score.settling is None else f"{score.settling:.2f}"]
            cells += [f"{1e3 * mean:.2f}" for mean in means[:3]]
            cells += [f"{np.degrees(means[3]):.2f}", _cell(score.worst, 1e3), _cell(score.effort, 1.0)]
            cells += [_cell(score.chattering, 1.0)]
        lines.append(f"{name:{width}}" + "".join(f"{cell:>16}" for cell in cells) + f"   {score}")
    return "\n".join(lines)


def _cell(value: float | None, scale: float) -> str:
    return "" if value is None else f"{scale * value:.2f}"
