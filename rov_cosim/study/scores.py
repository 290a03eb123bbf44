"""How well a run held the vehicle: errors in hold, effort, estimate, and a verdict by stated rules."""

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ..components.interface import POSE, count
from ..components.vehicle import N_THRUSTERS
from ..ssp.wiring import Wiring
from .assessment import (
    AXES,
    SETTLED,
    assessable,
    controller_of,
    disturbances,
    errors_of,
    hold_begin,
    in_hold,
    measured,
    outputs_assessed,
    pose,
    settling,
)

OFFSET = {"x": 5e-3, "y": 5e-3, "z": 5e-3, "psi": np.radians(1.0)}
"""Mean error in hold, in m and rad, beyond which an axis has an offset; 5 mm is the arm's own error."""
SWAY = SETTLED
"""Root mean square about the mean, in m and rad, beyond which an axis oscillates."""
LOST = {"x": 1.0, "y": 1.0, "z": 1.0, "psi": np.pi / 2}
"""Error in hold, in m and rad, beyond which the vehicle is lost."""
CAPSIZED = np.radians(45.0)
"""Roll or pitch in hold, in rad, beyond which the vehicle is lost."""
UNMEASURED = 3.0
"""Time in s without a measurement at the end of a run after which the vehicle is lost."""

Verdict = Literal["held", "offset", "oscillates", "lost"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
"""From best to worst."""


@dataclass(frozen=True)
class Score:
    """How a run did. Errors are those of the hold; position errors the largest of x, y, z, in m, yaw in rad.

    Parameters
    ----------
    verdict : "lost" if the run failed, the measurement is gone at its end, an axis is beyond `LOST` or the tilt beyond
        `CAPSIZED`; else "oscillates" if one is beyond `SWAY`; else "offset" if one is beyond `OFFSET`; else "held".
    settling : time in s after which every axis stays within `assessment.SETTLED`; None: not before the hold.
    mean, rms, worst : of the position error; rms about zero.
    mean_yaw, rms_yaw, worst_yaw : of the yaw error.
    tilt : the largest angle of roll or pitch in rad.
    effort : root mean square of the thruster commands, all together, in N; None if the controller has no ``u``.
    chattering : total variation of the thruster command that moves most, by time, in N/s, between the rows; None as for
        effort.
    saturated : share of the hold in which a command is limited; None if the controller does not tell.
    wrong_force, wrong_moment : root mean square of the estimated less the true disturbance, in N over X, Y and Z, and
        in N m about the vertical: the part of the unknown forces that shows at rest; None if nothing is estimated, or
        the truth is not known.
    lost_at, reason : since when in s, and why, the vehicle is lost, if it is.
    """

    verdict: Verdict
    settling: float | None = None
    mean: float | None = None
    rms: float | None = None
    worst: float | None = None
    mean_yaw: float | None = None
    rms_yaw: float | None = None
    worst_yaw: float | None = None
    tilt: float | None = None
    effort: float | None = None
    chattering: float | None = None
    saturated: float | None = None
    wrong_force: float | None = None
    wrong_moment: float | None = None
    lost_at: float | None = None
    reason: str = ""

    def __str__(self) -> str:
        since = "" if self.lost_at is None else f" at {self.lost_at:.4g} s"
        return self.verdict + since + (f": {self.reason}" if self.reason else "")


def score(results: NDArray[Any], wiring: Wiring, failure: str = "") -> Score:
    """Return the score of a run's results, of at least one row; `failure` is why it ended early, if it did."""
    if failure:
        return Score("lost", lost_at=float(results["time"][-1]), reason=failure)
    controller, begin = controller_of(wiring), int(np.argmax(in_hold(results)))
    held, eta = results[begin:], pose(results, wiring)
    error = errors_of(eta, results, wiring)[:, [POSE.index(axis) for axis in AXES]]
    e = error[begin:]
    mean, rms, worst = e.mean(axis=0), np.sqrt((e**2).mean(axis=0)), np.abs(e).max(axis=0)
    estimates = disturbances(held, wiring)
    if not any(estimated.any() for estimated, _ in estimates.values()):
        estimates = {}  # a PD controller's zero is no estimate
    wrong = {axis: np.sqrt(np.mean((estimated - true) ** 2)) for axis, (estimated, true) in estimates.items()}
    settled = [settling(results["time"], error[:, i], SETTLED[axis]) for i, axis in enumerate(AXES)]
    latest = max((np.inf if s is None else s) for s in settled)
    commands = commands_of(results, controller)
    lost_at, reason = _loss(results, wiring, eta, error, commands)
    return Score(
        verdict="lost" if reason else _verdict(mean, e.std(axis=0)),
        settling=latest if latest <= hold_begin(results) else None,
        mean=float(np.abs(mean[:3]).max()),
        rms=float(rms[:3].max()),
        worst=float(worst[:3].max()),
        mean_yaw=float(abs(mean[3])),
        rms_yaw=float(rms[3]),
        worst_yaw=float(worst[3]),
        tilt=float(np.abs(eta[3:5, begin:]).max()),
        effort=None if commands is None else float(np.sqrt((commands[:, begin:] ** 2).sum(axis=0).mean())),
        chattering=None if commands is None else _variation(results["time"][begin:], commands[:, begin:]),
        saturated=_mean(held, f"{controller}.saturated"),
        wrong_force=float(np.sqrt(sum(wrong[axis] ** 2 for axis in "XYZ"))) if wrong else None,
        wrong_moment=float(wrong["N"]) if wrong else None,
        lost_at=lost_at,
        reason=reason,
    )


def outputs_scored(wiring: Wiring) -> set[str]:
    """Return the outputs that `score` reads of the results of a system; none if it is not `assessable`."""
    if not assessable(wiring):
        return set()
    controller = controller_of(wiring)
    own = {*_commands(controller), f"{controller}.saturated", _attached(wiring)}
    return own & wiring.outputs | outputs_assessed(wiring)


def commands_of(results: NDArray[Any], controller: str) -> NDArray[np.float64] | None:
    """Return the thruster commands, shape (8, rows); None if the controller has no ``u``."""
    names = _commands(controller)
    there = set(names) <= set(results.dtype.names or ())
    return np.stack([results[name] for name in names]) if there else None


def _loss(
    results: NDArray[Any],
    wiring: Wiring,
    eta: NDArray[np.float64],
    error: NDArray[np.float64],
    commands: NDArray[np.float64] | None,
) -> tuple[float | None, str]:
    """Return since when and why the vehicle is lost; None and nothing if it is not."""
    time, begin = results["time"], int(np.argmax(in_hold(results)))
    blind = ~measured(results, wiring)
    if blind[time > time[-1] - UNMEASURED].all():
        reason = "out of the sensor's reach" if _detached(results, wiring) else "the pose is not measured at the end"
        return float(time[_stretch_begin(blind, len(time) - 1)]), reason
    far = np.abs(error) > [LOST[axis] for axis in AXES]
    causes = {
        "the pose is not finite": ~np.isfinite(eta).all(axis=0),
        "a thruster command is not finite": np.zeros(len(time), bool)
        if commands is None
        else ~np.isfinite(commands).all(axis=0),
        f"{', '.join(name for i, name in enumerate(AXES) if far[begin:, i].any())} beyond "
        f"{LOST['x']:g} m or {np.degrees(LOST['psi']):g} deg": far.any(axis=1),
        f"tilted beyond {np.degrees(CAPSIZED):g} deg": np.abs(eta[3:5]).max(axis=0) > CAPSIZED,
    }
    for reason, lost in causes.items():
        if lost[begin:].any():
            return float(time[_stretch_begin(lost, begin + int(np.argmax(lost[begin:])))]), reason
    return None, ""


def _detached(results: NDArray[Any], wiring: Wiring) -> bool:
    """Tell whether what measures has an output ``attached`` that is false at the end."""
    name = _attached(wiring)
    return name in (results.dtype.names or ()) and not results[name][-1]


def _attached(wiring: Wiring) -> str:
    """Return the output by which what measures tells whether it is attached; nothing if nothing measures."""
    link = wiring.link_to(f"{controller_of(wiring)}.eta_m_valid")
    return f"{link.source.element}.attached" if link else ""


def _commands(controller: str) -> list[str]:
    return [f"{controller}.u[{i}]" for i in count(N_THRUSTERS)]


def _stretch_begin(true: NDArray[np.bool_], end: int) -> int:
    """Return the first row of the unbroken stretch of true rows that the row `end` is in."""
    before = np.flatnonzero(~true[:end])
    return int(before[-1]) + 1 if before.size else 0


def _verdict(mean: NDArray[Any], sway: NDArray[Any]) -> Verdict:
    def beyond(values: NDArray[Any], limits: dict[str, float]) -> bool:
        return bool((np.abs(values) > [limits[axis] for axis in AXES]).any())

    if beyond(sway, SWAY):
        return "oscillates"
    return "offset" if beyond(mean, OFFSET) else "held"


def _variation(time: NDArray[np.float64], commands: NDArray[np.float64]) -> float:
    """Return the largest total variation of a row of the commands, shape (8, rows), by time, in N/s; 0 of one row."""
    total = np.abs(np.diff(commands, axis=1)).sum(axis=1).max()
    return float(total / (time[-1] - time[0])) if len(time) > 1 else 0.0


def _mean(held: NDArray[Any], name: str) -> float | None:
    return float(held[name].mean()) if name in (held.dtype.names or ()) else None
