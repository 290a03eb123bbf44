"""The matrix at a glance: a heat map."""

from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from .matrix import Cell, Matrix
from .matrix_tables import columns_of, errors, troubles_of
from .plots import save
from .scores import VERDICTS

COLOURS = ("#9ecae1", "#fee391", "#fd8d3c", "#99000d")
"""Of `VERDICTS`; told apart by their lightness too."""
_NOT_RUN = "#eeeeee"


def draw_heat_map(matrix: Matrix, path: Path, note: str = "") -> None:
    """Draw the verdict of each cell by colour, and its root mean square errors; `note` as in `markdown`."""
    columns, troubles = columns_of(matrix), troubles_of(matrix)
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
                text = errors(score, "{:.0f}  {:.1f}°")
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
        figure.set_layout_engine("none")
    save(figure, path, dpi=130)


def _broken(name: str, width: int) -> str:
    """Return a name in lines of so many characters, broken after underscores."""
    parts = fill(name.replace("_", "_ "), width, break_long_words=False, break_on_hyphens=False)
    return parts.replace("_ ", "_")
