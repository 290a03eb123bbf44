"""A gate at a glance: green and red cells, and how much of its limit the score takes that is nearest to one."""

from pathlib import Path

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ..plots import save
from .conduct import Outcome, Result

COLOURS = {"green": "#b2df8a", "red": "#99000d", "left out": "#eeeeee", "does not run": "#ffffff"}
"""By status; told apart by their lightness, for not every eye sees green and red."""


def draw(outcome: Outcome, path: Path) -> None:
    """Draw a gate as PNG or SVG: a column for each system, a row for each trouble."""
    systems = list(dict.fromkeys(cell.system for cell in outcome.results))
    troubles = list(dict.fromkeys(cell.trouble for cell in outcome.results))
    places = {cell: (troubles.index(cell.trouble), systems.index(cell.system)) for cell in outcome.results}
    statuses = np.full((len(troubles), len(systems)), len(COLOURS) - 1)
    figure = Figure(figsize=(max(2.6 + 1.6 * len(systems), 6.0), 2.2 + 0.4 * len(troubles)), layout="constrained")
    panel = figure.subplots()
    for cell, result in outcome.results.items():
        row, column = places[cell]
        statuses[row, column] = [*COLOURS].index(result.status)
        colour = "white" if result.status == "red" else "black"
        panel.text(column + 0.5, row + 0.5, _text(result), color=colour, ha="center", va="center", fontsize=8)
    colours = ListedColormap(list(COLOURS.values()))
    panel.pcolormesh(statuses, cmap=colours, vmin=0, vmax=len(COLOURS) - 1, edgecolors="white", linewidth=2)
    panel.invert_yaxis()
    panel.set_yticks(np.arange(len(troubles)) + 0.5, troubles, fontsize=9)
    panel.set_xticks(np.arange(len(systems)) + 0.5, systems, fontsize=8)
    panel.tick_params(length=0)
    for side in panel.spines.values():
        side.set_visible(False)
    present = [status for status in COLOURS if status in {result.status for result in outcome.results.values()}]
    handles = [Patch(color=COLOURS[status]) for status in present]
    figure.legend(handles, present, loc="outside lower center", ncols=len(present), fontsize=8, frameon=False)
    figure.suptitle(f"{outcome.verdict}\nverdict, and the largest share of a limit", fontsize=10)
    save(figure, path, dpi=130)


def _text(result: Result) -> str:
    if result.score is None:
        return "" if result.status == "left out" else "not run"
    shares = [
        value / limit
        for name, limit in result.limits.items()
        if not isinstance(limit, str) and limit > 0 and (value := getattr(result.score, name)) is not None
    ]
    return result.score.verdict + (f", {max(shares):.0%}" if shares else "")
