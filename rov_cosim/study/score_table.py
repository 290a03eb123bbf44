"""Scores as a table: on the screen, and as CSV in SI units."""

import csv
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

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


def table(scores: Mapping[str, Score]) -> str:
    """Return a line for each run: when it settles, its errors in hold, the effort, the verdict."""
    width = max(map(len, ["run", *scores]))
    heads = ("settles [s]", "rms [mm]", "worst [mm]", "yaw rms [deg]", "effort [N]")
    lines = [f"{'run':{width}}" + "".join(f"{head:>15}" for head in heads) + "   verdict"]
    for name, score in scores.items():
        cells = [
            "never" if score.settling is None else f"{score.settling:.2f}",
            *(_cell(v, 1e3) for v in (score.rms, score.worst)),
            _cell(score.rms_yaw, 180 / np.pi),
            _cell(score.effort, 1.0),
        ]
        lines.append(f"{name:{width}}" + "".join(f"{cell:>15}" for cell in cells) + f"   {score}")
    return "\n".join(lines)


def _cell(value: float | None, scale: float) -> str:
    return "" if value is None else f"{scale * value:.2f}"
