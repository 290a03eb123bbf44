"""Figures of runs, in the manner of the paper's figures 4 to 7 and 9 to 12; the band is that of a settled axis."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ..components.interface import POSE
from ..ssp.wiring import Wiring
from .assessment import AXES, SETTLED, disturbances, errors, pose

Results = tuple[NDArray[Any], Wiring]

# The margins are given: to fit them to the labels takes as long as the rest of the figure.
_MARGINS = {"left": 0.085, "right": 0.985, "bottom": 0.06, "top": 0.945, "wspace": 0.2, "hspace": 0.08}
_STYLES = ("-", "--", ":", "-.")
"""Of runs beyond the ten colours, so that none looks like another."""
_LABELS = {"x": "x error [m]", "y": "y error [m]", "z": "z error [m]", "psi": "yaw error [deg]"}
_SCALES = {"x": 1.0, "y": 1.0, "z": 1.0, "psi": 180 / np.pi}


def plot_run(results: NDArray[Any], wiring: Wiring, title: str, path: Path) -> None:
    """Draw one run: the pose error, the thrusters and the estimated disturbance where the system has them.

    The form of the picture follows from the suffix of its path, PNG or SVG; so in `plot_comparison`.
    """
    figure = Figure(figsize=(10, 9))
    panels = figure.subplots(3, 2, sharex=True, gridspec_kw=_MARGINS)
    _plot_errors(panels.flat[:4], {"": (results, wiring)})
    thrust, unknown = panels[2]
    estimates = disturbances(results, wiring)
    for i, name in enumerate(("X", "Y", "Z", "N")):
        style = {"color": f"C{i}", "linewidth": 0.8}
        if f"rov_plant.tau.{name}" in (results.dtype.names or ()):
            thrust.plot(results["time"], results[f"rov_plant.tau.{name}"], label=name, **style)
        if name in estimates:
            estimated, true = estimates[name]
            unknown.plot(results["time"], estimated, label=name, **style)
            unknown.plot(results["time"], true, linestyle="--", **style)
    angles = np.degrees(pose(results, wiring)[3:5])
    if angles.any():
        for name, angle in zip(("roll", "pitch"), angles, strict=True):
            panels[1, 1].plot(results["time"], angle, linewidth=0.8, linestyle=":", label=name)
        panels[1, 1].legend(fontsize="small", loc="upper right")
    for panel, label in ((thrust, "thruster wrench [N, N m]"), (unknown, "disturbance, true: dashed [N, N m]")):
        _finish(panel, label)
        panel.set_xlabel("time [s]")
        if panel.lines:
            panel.legend(ncols=4, fontsize="small", loc="lower right")
        else:
            panel.set_yticks([])
            panel.text(0.5, 0.5, "not told by this system", ha="center", va="center", transform=panel.transAxes)
    figure.suptitle(title, fontsize=12)
    save(figure, path)


def plot_comparison(runs: Mapping[str, Results], title: str, path: Path) -> None:
    """Draw the pose errors of several runs, by label; the title stands over the labels, if there is one."""
    figure = Figure(figsize=(10, 6.5), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True)
    _plot_errors(panels.flat, runs)
    for panel in panels[1]:
        panel.set_xlabel("time [s]")
    handles, labels = panels.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, title=title or None, loc="outside upper center", ncols=min(len(runs), 3))
    save(figure, path)


def _plot_errors(panels: Any, runs: Mapping[str, Results]) -> None:
    for panel, name in zip(panels, AXES, strict=True):
        for i, (label, (results, wiring)) in enumerate(runs.items()):
            error = _SCALES[name] * errors(results, wiring)[:, POSE.index(name)]
            panel.plot(results["time"], error, _STYLES[i // 10 % len(_STYLES)], linewidth=1.2, label=label)
        settled = _SCALES[name] * SETTLED[name]
        panel.axhspan(-settled, settled, color="C2", alpha=0.2, linewidth=0)
        text, corner = f"\u00b1 {settled:g} {_LABELS[name].partition('[')[2].rstrip(']')}", (1, settled)
        where = {"xycoords": ("axes fraction", "data"), "xytext": (-4, 2), "textcoords": "offset points"}
        panel.annotate(text, corner, **where, ha="right", fontsize=7, color="C2")
        panel.axhline(0.0, color="black", linewidth=0.6)
        _finish(panel, _LABELS[name])


def _finish(panel: Any, label: str) -> None:
    panel.set_ylabel(label)
    panel.grid(alpha=0.3)


def save(figure: Figure, path: Path, dpi: int = 110) -> None:
    """Write a figure as PNG or SVG; the same figure gives the same bytes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with matplotlib.rc_context({"svg.hashsalt": "rov-cosim", "svg.fonttype": "none"}):
        figure.savefig(path, dpi=dpi, metadata={"Date": None} if path.suffix == ".svg" else {"Software": None})
