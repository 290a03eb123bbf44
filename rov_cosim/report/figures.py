"""The paper's figures 4 to 7 and 9 to 12 as its systems give them here, on its axes, and figures that it has not."""

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from matplotlib.axes import Axes

from ..components.adaptive_pd.equations import LOADS
from ..components.interface import POSE, VELOCITY, count
from ..components.vehicle import N_THRUSTERS
from ..control.lyapunov import terms
from .drawing import INK, LINES, STYLES, drawn, look
from .experiment import EXPERIMENT, EXPERIMENT_PD, SIMULATION, SIMULATION_PD, Experiment, Series

_SECOND = 33
"""Rows in about a second."""


@dataclass(frozen=True)
class Drawn:
    """A figure: its file's name, what the paper calls it (empty if it has none), a caption, SVG, and commands."""

    name: str
    number: str
    caption: str
    svg: str
    commands: tuple[str, ...]


@dataclass(frozen=True)
class _Panel:
    """A panel of the paper: the axis of the pose, its label, the limits of time and value, and their ticks."""

    number: int
    axis: str
    label: str
    stop: float
    every: float
    low: float
    high: float
    step: float


_SIMULATION = (
    _Panel(4, "x", "x [m]", 60, 20, -0.1, 0.6, 0.1),
    _Panel(5, "y", "y [m]", 60, 20, -0.2, 0.8, 0.2),
    _Panel(6, "z", "z [m]", 60, 20, 0.0, 0.7, 0.1),
    _Panel(7, "psi", "yaw [rad]", 60, 20, -0.2, 1.2, 0.2),
)
_EXPERIMENT = (
    _Panel(9, "x", "x [m]", 70, 10, -0.04, 0.02, 0.01),
    _Panel(10, "y", "y [m]", 70, 10, -0.1, 0.6, 0.1),
    _Panel(11, "z", "z [m]", 70, 10, -0.1, 0.4, 0.1),
    _Panel(12, "psi", "yaw [rad]", 70, 10, -0.5, 2.5, 0.5),
)


def figures() -> list[Drawn]:
    """Return all figures, the paper's first.

    Raises
    ------
    ExperimentError : a run failed.
    """
    return [
        *(_pose(panel, SIMULATION, SIMULATION_PD) for panel in _SIMULATION),
        *(_pose(panel, EXPERIMENT, EXPERIMENT_PD) for panel in _EXPERIMENT),
        _estimate(),
        _thrust(),
        _arm(),
        _lyapunov(),
        _noise(),
    ]


def _pose(panel: _Panel, adaptive: Experiment, pd: Experiment) -> Drawn:
    low, high = panel.low, panel.high

    def draw(axes: Axes) -> None:
        nonlocal low, high
        for run, label, colour, style in ((pd, "PD", LINES[1], "--"), (adaptive, "adaptive PD", LINES[0], "-")):
            shown = run.time <= panel.stop
            value = run[f"rov_plant.eta.{panel.axis}"][shown]
            axes.plot(run.time[shown], value, style, color=colour, label=label)
            while value.min() < low - 1e-9:
                low -= panel.step
            while value.max() > high + 1e-9:
                high += panel.step
        axes.set(xlim=(0, panel.stop), ylim=(low, high), ylabel=panel.label)
        axes.set_xticks(np.arange(0, panel.stop + 1, panel.every))
        axes.set_yticks(np.arange(low, high + panel.step / 2, panel.step))
        axes.legend()

    svg = drawn(draw)
    wider = "" if (low, high) == (panel.low, panel.high) else f" The paper's axis is {panel.low:g} to {panel.high:g}."
    name = "yaw" if panel.axis == "psi" else panel.axis
    caption = f"Time history of {name}, PD dashed, adaptive PD solid.{wider}"
    return Drawn(f"figure_{panel.number:02}", f"Fig. {panel.number}", caption, svg, (adaptive.command, pd.command))


def _estimate() -> Drawn:
    def draw(axes: Axes) -> None:
        every = slice(None, None, _SECOND // 6)
        time = EXPERIMENT.time[every]
        for i, name in enumerate("XYZN"):
            unit = "N m" if name == "N" else "N"
            estimated, true = (EXPERIMENT[f"{e}.disturbance.{name}"][every] for e in ("controller", "rov_plant"))
            axes.plot(time, estimated, color=LINES[i])
            axes.plot(time, true, ":", color=LINES[i], linewidth=2)
            _name(axes, time, true, f"{name} [{unit}]", LINES[i])
        axes.set(xlim=(0, EXPERIMENT.time[-1]), ylim=(-16, 30), ylabel="disturbance [N, N m]")

    caption = "The unknown forces as a wrench in body axes: estimated (solid) and true (dotted); they turn as it yaws."
    return _further("estimate", caption, draw, EXPERIMENT)


def _thrust() -> Drawn:
    def draw(axes: Axes) -> None:
        every = slice(None, None, _SECOND // 3)
        for i, label in ((1, "u1"), (2, "u2"), (3, "u3"), (4, "u4"), (5, "u5 to u8")):
            vertical = i == N_THRUSTERS // 2 + 1
            style, colour = ("-", LINES[1]) if vertical else (STYLES[i - 1], LINES[0])
            thrust = _smooth(EXPERIMENT[f"controller.u[{i}]"])[every]
            axes.plot(EXPERIMENT.time[every], thrust, style, color=colour, label=label)
        axes.set(xlim=(0, EXPERIMENT.time[-1]), ylabel="thrust, mean over 1 s [N]")
        axes.figure.legend(ncols=5, loc="outside upper center", columnspacing=1.2, handlelength=1.6)

    caption = "Commands of the thrusters: four horizontal, u1 to u4, and four vertical, which all get the same."
    return _further("thrust", caption, draw, EXPERIMENT)


def _arm() -> Drawn:
    q = np.degrees(EXPERIMENT.group("passive_arm", tuple(f"q[{i}]" for i in count(6))))

    def draw(axes: Axes) -> None:
        for i in range(6):
            axes.plot(EXPERIMENT.time, q[:, i], STYLES[i % 3], color=LINES[i // 3], label=f"q{i + 1}")
        axes.set(xlim=(0, EXPERIMENT.time[-1]), ylabel="joint angle [deg]")
        reach = axes.twinx()
        reach.plot(EXPERIMENT.time, EXPERIMENT["passive_arm.reach"], ":", color=INK, linewidth=2, label="reach")
        reach.set(ylim=(0, sum(EXPERIMENT.value(f"passive_arm.L[{i}]") for i in (1, 2))), ylabel="reach [m]")
        look(reach)
        reach.grid(visible=False)
        handles = [*axes.lines, *reach.lines]
        axes.figure.legend(handles=handles, ncols=4, loc="outside upper center")

    caption = "Joint angles of the arm as its encoders read them, and its reach, of the 1.4 m that its links have."
    return _further("arm", caption, draw, EXPERIMENT)


def _lyapunov() -> Drawn:
    def draw(axes: Axes) -> None:
        for run, label, colour, style in (
            (SIMULATION, "simulation", LINES[0], "-"),
            (EXPERIMENT, "experiment, true pose and velocity", LINES[1], "--"),
        ):
            axes.semilogy(run.time, lyapunov(run), style, color=colour, label=label)
        axes.set(xlim=(0, 60), ylabel="V [J]")
        axes.legend()

    caption = (
        "The Lyapunov function of the paper's proof. It ends above zero: of forces that act alike, as the "
        "three vertical ones, the sum alone is learned."
    )
    return _further("lyapunov", caption, draw, SIMULATION, EXPERIMENT)


def _noise() -> Drawn:
    measured, true = EXPERIMENT["passive_arm.eta_m.x"], EXPERIMENT["rov_plant.eta.x"]
    shown = (EXPERIMENT.time >= 60) & (EXPERIMENT.time <= 66)

    def draw(axes: Axes) -> None:
        axes.plot(EXPERIMENT.time[shown], 1e3 * measured[shown], ".", color=LINES[1], markersize=3, label="measured")
        axes.plot(EXPERIMENT.time[shown], 1e3 * true[shown], color=LINES[0], label="true")
        axes.set(xlim=(60, 66), ylabel="x [mm]")
        axes.figure.legend(ncols=2, loc="outside upper center")

    caption = "What the controller is given: x as the arm measures it, with 5 mm of noise, and where the vehicle is."
    return _further("noise", caption, draw, EXPERIMENT)


def lyapunov(run: Experiment) -> Series:
    """Return V along a run without pulls, shape (rows,), in J, with the true pose and velocity."""
    loop = run.certificate.loop
    p, p_law = loop.p(loop.plant), loop.p(loop.controller)
    eta, nu = run.group("rov_plant.eta", POSE), run.group("rov_plant.nu", VELOCITY)
    theta_hat = run.group("controller.theta_hat", LOADS)
    none = {"F_umbilical": np.zeros(3), "F_arm": np.zeros(3)}
    motions = (
        SimpleNamespace(eta=pose, nu=speed, eta_d=pose - error, theta_hat=estimate, **none)
        for pose, speed, error, estimate in zip(eta, nu, run.errors, theta_hat, strict=True)
    )
    return np.array([sum(terms(motion, p, p_law)) for motion in motions])


def _smooth(value: Series) -> Series:
    """Return means over a second."""
    padded = np.pad(value, _SECOND // 2, mode="edge")
    means: Series = np.convolve(padded, np.full(_SECOND, 1 / _SECOND), mode="valid")
    return means


def _name(axes: Axes, time: Series, value: Series, text: str, colour: str) -> None:
    """Write what a line is over its right end."""
    end = (float(time[-1]), float(value[-1]))
    axes.annotate(text, end, (-4, 4), textcoords="offset points", ha="right", fontsize=9, color=colour)


def _further(name: str, caption: str, draw: Callable[[Axes], None], *runs: Experiment) -> Drawn:
    return Drawn(name, "", caption, drawn(draw), tuple(run.command for run in runs))
