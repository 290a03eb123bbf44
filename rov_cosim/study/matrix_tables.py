"""The matrix on paper: Markdown with a picture and a table a vehicle."""

import numpy as np

from .matrix import Cell, Matrix
from .scores import Score
from .troubles import TROUBLES

CALM = "still_water"
"""The trouble in which the thrust's variation is told: there it is the controller's own."""
_HEAD = """\
# The matrix

Written by `{command}`. A cell has the verdict, the root mean square errors of position and yaw in hold, and the
time after which every axis stays settled; it is empty where the trouble does not apply. Rules: [FLEET.md](FLEET.md).

![Verdicts by vehicle, controller and trouble]({picture})
"""


def markdown(matrix: Matrix, command: str, picture: str, note: str = "") -> str:
    """Return a page with a table for each vehicle: how each controller did in each trouble.

    Parameters
    ----------
    command : the command line that ran it.
    picture : the name of the heat map.
    note : what is not as in the systems of `fleet`.
    """
    columns, troubles = columns_of(matrix), troubles_of(matrix)
    lines = [_HEAD.format(command=command, picture=picture), *([f"{note}\n"] if note else [])]
    for vehicle, controllers in columns.items():
        lines += [f"## {vehicle}", "", f"| | {' | '.join(controllers)} |", "|---" * (1 + len(controllers)) + "|"]
        for trouble in troubles:
            cells = [_summary(matrix.scores.get(Cell(vehicle, controller, trouble))) for controller in controllers]
            lines.append(f"| {trouble} | {' | '.join(cells)} |")
        lines.append("")
    if CALM in troubles:
        lines += [f"## Chattering in {CALM}", "", "Total variation of the thrust that moves most, by time, in N/s.", ""]
        names = list(dict.fromkeys(name for controllers in columns.values() for name in controllers))
        lines += [f"| | {' | '.join(names)} |", "|---" * (1 + len(names)) + "|"]
        for vehicle in columns:
            cells = [_chattering(matrix.scores.get(Cell(vehicle, name, CALM))) for name in names]
            lines.append(f"| {vehicle} | {' | '.join(cells)} |")
        lines.append("")
    lines += ["## Troubles", "", "| trouble | what it is |", "|---|---|"]
    lines += [f"| {name} | {TROUBLES[name].description} |" for name in troubles]
    if matrix.left_out:
        lines += ["", "## What does not apply", "", "| trouble | where | why |", "|---|---|---|"]
        where: dict[tuple[str, str], list[str]] = {}
        for cell, why in matrix.left_out.items():
            where.setdefault((cell.trouble, why), []).append(f"{cell.vehicle} {cell.controller}")
        lines += [f"| {trouble} | {', '.join(places)} | {why} |" for (trouble, why), places in where.items()]
    return "\n".join([*lines, ""])


def columns_of(matrix: Matrix) -> dict[str, list[str]]:
    """Return the controllers of each vehicle, in the order in which they ran."""
    columns: dict[str, list[str]] = {}
    for vehicle, controller in dict.fromkeys(cell[:2] for cell in (*matrix.scores, *matrix.left_out)):
        columns.setdefault(vehicle, []).append(controller)
    return columns


def troubles_of(matrix: Matrix) -> list[str]:
    """Return the troubles that some cell has, in their order."""
    present = {cell.trouble for cell in (*matrix.scores, *matrix.left_out)}
    return [name for name in TROUBLES if name in present]


def _summary(score: Score | None) -> str:
    if score is None:
        return ""
    settling = "" if score.settling is None else f"{score.settling:.0f} s"
    return ", ".join(filter(None, (score.verdict, errors(score, "{:.0f} mm, {:.1f} deg"), settling)))


def _chattering(score: Score | None) -> str:
    return "" if score is None or score.chattering is None else f"{score.chattering:.0f}"


def errors(score: Score, form: str) -> str:
    """Return the root mean square errors of position, in mm, and yaw, in degrees; nothing of a lost vehicle."""
    if score.rms is None or score.rms_yaw is None:
        return "failed"
    return "" if score.verdict == "lost" else form.format(1e3 * score.rms, np.degrees(score.rms_yaw))
