"""The matrix on paper: Markdown with a picture and a table a vehicle, a heat map to be read at a glance."""

from collections.abc import Iterable
from pathlib import Path
from textwrap import fill

import matplotlib
import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from .matrix import Cell, Matrix
from .plots import save
from .scores import VERDICTS, Score
from .troubles import TROUBLES

COLOURS = ("#9ecae1", "#fee391", "#fd8d3c", "#99000d")
"""Of `VERDICTS`; told apart by their lightness too."""
_NOT_RUN = "#eeeeee"
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
    columns, troubles = _columns(matrix), _troubles(matrix)
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


def draw_heat_map(matrix: Matrix, paths: Iterable[Path], note: str = "") -> None:
    """Draw the verdict of each cell by colour, and its root mean square errors, to files; `note` as in `markdown`."""
    columns, troubles = _columns(matrix), _troubles(matrix)
    pairs = [(vehicle, controller) for vehicle, controllers in columns.items() for controller in controllers]
    found = [[matrix.scores.get(Cell(*pair, trouble)) for pair in pairs] for trouble in troubles]
    verdicts = np.array([[-1 if s is None else VERDICTS.index(s.verdict) for s in row] for row in found])
    figure = Figure(figsize=(max(2.6 + 0.75 * len(pairs), 7.5), 2.4 + 0.27 * len(troubles)), layout="constrained")
    panel = figure.subplots()
    colours = ListedColormap([_NOT_RUN, *COLOURS])
    panel.pcolormesh(verdicts, cmap=colours, vmin=-1, vmax=len(VERDICTS) - 1, edgecolors="white", linewidth=0.8)
    panel.invert_yaxis()
    for i, row in enumerate(found):
        for j, score in enumerate(row):
            if score:
                colour = "white" if score.verdict == "lost" else "black"
                text = _errors(score, "{:.0f}  {:.1f}°")
                place = j + 0.5, i + 0.5
                panel.text(*place, text, color=colour, ha="center", va="center", fontsize=7, in_layout=False)
    panel.set_yticks(np.arange(len(troubles)) + 0.5, troubles, fontsize=8)
    panel.set_xticks(np.arange(len(pairs)) + 0.5, [controller for _, controller in pairs], fontsize=7, rotation=90)
    panel.tick_params(length=0)
    begin = 0
    for vehicle, controllers in columns.items():
        end = begin + len(controllers)
        # A name breaks where it is longer than its columns are wide.
        name = _broken(vehicle, 8 * len(controllers))
        panel.text((begin + end) / 2, -0.3, name, ha="center", va="bottom", fontsize=8, weight="bold")
        panel.axvline(end, color="white", linewidth=4)
        begin = end
    for side in panel.spines.values():
        side.set_visible(False)
    handles = [Patch(color=colour) for colour in (*COLOURS, _NOT_RUN)]
    labels = [*VERDICTS, "does not apply"]
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=8, frameon=False)
    title = "Verdict, and root mean square errors in hold: position [mm], yaw"
    figure.suptitle(f"{title}\n{note}" if note else title, fontsize=10)
    if layout := figure.get_layout_engine():  # once, for each would draw all cells twice
        layout.execute(figure)
        with matplotlib.rc_context({"figure.autolayout": False, "figure.constrained_layout.use": False}):
            figure.set_layout_engine(None)  # not "none", which counts as a layout
    for path in paths:
        save(figure, path, dpi=130)


def _broken(name: str, width: int) -> str:
    """Return a name in lines of so many characters, broken after underscores."""
    parts = fill(name.replace("_", "_ "), width, break_long_words=False, break_on_hyphens=False)
    return parts.replace("_ ", "_")


def _columns(matrix: Matrix) -> dict[str, list[str]]:
    """Return the controllers of each vehicle, in the order in which they ran."""
    columns: dict[str, list[str]] = {}
    for vehicle, controller in dict.fromkeys(cell[:2] for cell in (*matrix.scores, *matrix.left_out)):
        columns.setdefault(vehicle, []).append(controller)
    return columns


def _troubles(matrix: Matrix) -> list[str]:
    present = {cell.trouble for cell in (*matrix.scores, *matrix.left_out)}
    return [name for name in TROUBLES if name in present]


def _summary(score: Score | None) -> str:
    if score is None:
        return ""
    settling = "" if score.settling is None else f"{score.settling:.0f} s"
    return ", ".join(filter(None, (score.verdict, _errors(score, "{:.0f} mm, {:.1f} deg"), settling)))


def _chattering(score: Score | None) -> str:
    return "" if score is None or score.chattering is None else f"{score.chattering:.0f}"


def _errors(score: Score, form: str) -> str:
    """Return the root mean square errors of position, in mm, and yaw, in degrees; nothing of a lost vehicle."""
    if score.rms is None or score.rms_yaw is None:
        return "failed"
    return "" if score.verdict == "lost" else form.format(1e3 * score.rms, np.degrees(score.rms_yaw))
