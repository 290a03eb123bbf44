"""Figures of runs, in the manner of the paper's figures 4 to 7 and 9 to 12; the band is that of a settled axis."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from numpy.typing import NDArray

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from ..components.interface import POSE
from ..ssp.wiring import Wiring
from .assessment import AXES, SETTLED, disturbances, errors

Run = tuple[NDArray[Any], Wiring]

_LABELS = {"x": "x error [m]", "y": "y error [m]", "z": "z error [m]", "psi": "yaw error [deg]"}
_SCALES = {"x": 1.0, "y": 1.0, "z": 1.0, "psi": 180 / np.pi}


def plot_run(run: Run, path: Path) -> None:
    """Write a PNG of one run: the pose error, the thrusters and the estimated disturbance where the system has them."""
    results, wiring = run
    figure, panels = plt.subplots(3, 2, figsize=(10, 9), sharex=True, layout="constrained")
    _plot_errors(panels.flat[:4], {"": run})
    thrust, unknown = panels[2]
    told = disturbances(results, wiring)
    for i, name in enumerate(("X", "Y", "Z", "N")):
        style = {"color": f"C{i}", "linewidth": 0.8}
        if f"rov_plant.tau.{name}" in (results.dtype.names or ()):
            thrust.plot(results["time"], results[f"rov_plant.tau.{name}"], label=name, **style)
        if name in told:
            estimated, true = told[name]
            unknown.plot(results["time"], estimated, label=name, **style)
            unknown.plot(results["time"], true, linestyle="--", **style)
    for panel, label in ((thrust, "thruster wrench [N, N m]"), (unknown, "disturbance, true: dashed [N, N m]")):
        _finish(panel, label)
        if panel.lines:
            panel.legend(ncols=4, fontsize="small")
        panel.set_xlabel("time [s]")
    figure.suptitle(wiring.name)
    _save(figure, path)


def plot_comparison(runs: Mapping[str, Run], path: Path) -> None:
    """Write a PNG with the pose errors of several runs, by label."""
    figure, panels = plt.subplots(2, 2, figsize=(10, 6.5), sharex=True, layout="constrained")
    _plot_errors(panels.flat, runs)
    for panel in panels[1]:
        panel.set_xlabel("time [s]")
    figure.legend(*panels.flat[0].get_legend_handles_labels(), loc="outside upper center", ncols=len(runs))
    _save(figure, path)


def _plot_errors(panels: Any, runs: Mapping[str, Run]) -> None:
    for panel, name in zip(panels, AXES, strict=True):
        for label, (results, wiring) in runs.items():
            error = _SCALES[name] * errors(results, wiring)[:, POSE.index(name)]
            panel.plot(results["time"], error, linewidth=1.2, label=label)
        settled = _SCALES[name] * SETTLED[name]
        panel.axhspan(-settled, settled, color="C2", alpha=0.2, linewidth=0)
        panel.axhline(0.0, color="black", linewidth=0.6)
        _finish(panel, _LABELS[name])


def _finish(panel: Any, label: str) -> None:
    panel.set_ylabel(label)
    panel.grid(alpha=0.3)


def _save(figure: Any, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(figure)
