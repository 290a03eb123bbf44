"""The matrix on paper: CSV with every score, Markdown with a table a vehicle, a heat map to be read at a glance."""

from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from ..systems.fleet import CONTROLLERS, VEHICLES
from .campaign import Campaign, Cell
from .scores import VERDICTS, Score
from .troubles import TROUBLES

COLOURS = ("#9ecae1", "#fee391", "#fd8d3c", "#99000d")
"""Of `VERDICTS`; told apart by their lightness too."""
_NOT_RUN = "#eeeeee"
_HEAD = """\
# The matrix

Written by `rov-cosim matrix`. A cell has the verdict, the root mean square errors of position and yaw in hold, and the
time after which every axis stays settled; it is empty where the trouble does not apply. Rules: [FLEET.md](FLEET.md).
"""


def markdown(campaign: Campaign, note: str = "") -> str:
    """Return a page with a table for each vehicle: how each controller did in each trouble.

    `note` says what is not as in the systems of `fleet`.
    """
    vehicles, controllers, troubles = _axes(campaign)
    lines = [_HEAD, *([f"{note}\n"] if note else [])]
    for vehicle in vehicles:
        lines += [f"## {vehicle}", "", f"| | {' | '.join(controllers)} |", "|---" * (1 + len(controllers)) + "|"]
        for trouble in troubles:
            cells = [_summary(campaign.scores.get(Cell(vehicle, controller, trouble))) for controller in controllers]
            lines.append(f"| {trouble} | {' | '.join(cells)} |")
        lines.append("")
    lines += ["## Troubles", "", "| trouble | what it is |", "|---|---|"]
    lines += [f"| {name} | {TROUBLES[name].description} |" for name in troubles]
    if campaign.left_out:
        lines += ["", "## What does not apply", "", "| trouble | where | why |", "|---|---|---|"]
        where: dict[tuple[str, str], list[str]] = {}
        for cell, why in campaign.left_out.items():
            where.setdefault((cell.trouble, why), []).append(f"{cell.vehicle} {cell.controller}")
        lines += [f"| {trouble} | {', '.join(places)} | {why} |" for (trouble, why), places in where.items()]
    return "\n".join([*lines, ""])


def draw_heat_map(campaign: Campaign, path: Path, note: str = "") -> None:
    """Write a PNG: the verdict of each cell by colour, and its root mean square errors; `note` as in `markdown`."""
    vehicles, controllers, troubles = _axes(campaign)
    columns = [(vehicle, controller) for vehicle in vehicles for controller in controllers]
    found = [[campaign.scores.get(Cell(*column, trouble)) for column in columns] for trouble in troubles]
    verdicts = np.array([[-1 if s is None else VERDICTS.index(s.verdict) for s in row] for row in found])
    size = (2.6 + 0.75 * len(columns), 2.0 + 0.27 * len(troubles))
    figure, panel = plt.subplots(figsize=size, layout="constrained")
    panel.imshow(verdicts, cmap=ListedColormap([_NOT_RUN, *COLOURS]), vmin=-1, vmax=len(VERDICTS) - 1, aspect="auto")
    for i, row in enumerate(found):
        for j, score in enumerate(row):
            if score:
                colour = "white" if score.verdict == "lost" else "black"
                panel.text(j, i, _errors(score, "{:.0f}  {:.1f}°"), color=colour, ha="center", va="center", fontsize=7)
    panel.set_yticks(range(len(troubles)), troubles, fontsize=8)
    panel.set_xticks(range(len(columns)), [controller for _, controller in columns], fontsize=7, rotation=90)
    panel.tick_params(length=0)
    for i, vehicle in enumerate(vehicles):
        middle = (i + 0.5) * len(controllers) - 0.5
        panel.text(middle, -0.8, vehicle, ha="center", va="bottom", fontsize=8, weight="bold")
        panel.axvline((i + 1) * len(controllers) - 0.5, color="white", linewidth=4)
    panel.set_xticks(np.arange(len(columns)) - 0.5, minor=True)
    panel.set_yticks(np.arange(len(troubles)) - 0.5, minor=True)
    panel.grid(which="minor", color="white", linewidth=0.8)
    panel.tick_params(which="minor", length=0)
    for side in panel.spines.values():
        side.set_visible(False)
    handles = [Patch(color=colour) for colour in (*COLOURS, _NOT_RUN)]
    labels = [*VERDICTS, "does not apply"]
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=8, frameon=False)
    title = "Verdict, and root mean square errors in hold: position [mm], yaw"
    figure.suptitle(f"{title}\n{note}" if note else title, fontsize=10)
    figure.savefig(path, dpi=130, metadata={"Software": None})
    plt.close(figure)


def _axes(campaign: Campaign) -> tuple[list[str], list[str], list[str]]:
    """Return vehicles, controllers and troubles of a campaign, in the order in which they are declared."""
    present = {name for cell in (*campaign.scores, *campaign.left_out) for name in cell}
    vehicles, controllers, troubles = (
        [n for n in names if n in present] for names in (VEHICLES, CONTROLLERS, TROUBLES)
    )
    return vehicles, controllers, troubles


def _summary(score: Score | None) -> str:
    if score is None:
        return ""
    settling = "" if score.settling is None else f"{score.settling:.0f} s"
    return ", ".join(filter(None, (score.verdict, _errors(score, "{:.0f} mm, {:.1f} deg"), settling)))


def _errors(score: Score, form: str) -> str:
    """Return the root mean square errors of position, in mm, and yaw, in degrees; nothing of a lost vehicle."""
    if score.rms is None or score.rms_yaw is None:
        return "failed"
    return "" if score.verdict == "lost" else form.format(1e3 * score.rms, np.degrees(score.rms_yaw))
