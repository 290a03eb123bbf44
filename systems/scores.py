"""How well a run held the vehicle: errors in hold, effort, estimate, and a verdict by stated rules."""

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ..components.interface import POSE, count
from ..components.vehicle import N_THRUSTERS
from .assessment import AXES, SETTLED, axes, controller_of, disturbances, errors, measured, pose
from .wiring import Wiring

HOLD_DURATION = 60.0
"""The last part of a run, in s, in which holding is scored."""
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
    saturated : share of the hold in which a command is limited; None if the controller does not tell.
    wrong_force, wrong_moment : root mean square of the estimated less the true disturbance, in N over X, Y and Z, and
        in N m about the vertical: the part of the unknown forces that shows at rest; None if nothing is estimated, or
        the truth is not told.
    reason : why the vehicle is lost, if it is.
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
    saturated: float | None = None
    wrong_force: float | None = None
    wrong_moment: float | None = None
    reason: str = ""


def score(results: NDArray[Any], wiring: Wiring) -> Score:
    """Return the score of a run's results."""
    time, controller = results["time"], controller_of(wiring)
    begin = time[-1] - HOLD_DURATION
    held = results[time > begin]
    error = errors(held, wiring)[:, [POSE.index(axis) for axis in AXES]]
    mean, rms, worst = error.mean(axis=0), np.sqrt((error**2).mean(axis=0)), np.abs(error).max(axis=0)
    tilt = float(np.abs(pose(held, wiring)[3:5]).max())
    told = disturbances(held, wiring)
    if not any(estimated.any() for estimated, _ in told.values()):
        told = {}  # a PD controller's zero is no estimate
    wrong = {axis: np.sqrt(np.mean((estimated - true) ** 2)) for axis, (estimated, true) in told.items()}
    settling = [axis.settling for axis in axes(results, wiring)]
    settled = max((np.inf if s is None else s) for s in settling)
    reason = _loss(worst, tilt, measured(results, wiring)[time > time[-1] - UNMEASURED])
    return Score(
        verdict="lost" if reason else _verdict(mean, error.std(axis=0)),
        settling=settled if settled <= begin else None,
        mean=float(np.abs(mean[:3]).max()),
        rms=float(rms[:3].max()),
        worst=float(worst[:3].max()),
        mean_yaw=float(abs(mean[3])),
        rms_yaw=float(rms[3]),
        worst_yaw=float(worst[3]),
        tilt=tilt,
        effort=_effort(held, controller),
        saturated=_mean(held, f"{controller}.saturated"),
        wrong_force=float(np.sqrt(sum(wrong[axis] ** 2 for axis in "XYZ"))) if wrong else None,
        wrong_moment=float(wrong["N"]) if wrong else None,
        reason=reason,
    )


def _loss(worst: NDArray[Any], tilt: float, measured: NDArray[Any]) -> str:
    """Return why the vehicle is lost, or nothing."""
    if not measured.any():
        return "the arm does not measure at the end"
    if not np.isfinite(worst).all():
        return "the pose is not finite"
    far = [name for name, value in zip(AXES, worst, strict=True) if value > LOST[name]]
    if far:
        return f"{', '.join(far)} beyond {LOST['x']:g} m or {np.degrees(LOST['psi']):g} deg"
    return f"tilted beyond {np.degrees(CAPSIZED):g} deg" if tilt > CAPSIZED else ""


def _verdict(mean: NDArray[Any], sway: NDArray[Any]) -> Verdict:
    def beyond(values: NDArray[Any], limits: dict[str, float]) -> bool:
        return bool((np.abs(values) > [limits[axis] for axis in AXES]).any())

    if beyond(sway, SWAY):
        return "oscillates"
    return "offset" if beyond(mean, OFFSET) else "held"


def _effort(held: NDArray[Any], controller: str) -> float | None:
    names = [f"{controller}.u[{i}]" for i in count(N_THRUSTERS)]
    if not set(names) <= set(held.dtype.names or ()):
        return None
    return float(np.sqrt((np.stack([held[name] for name in names]) ** 2).sum(axis=0).mean()))


def _mean(held: NDArray[Any], name: str) -> float | None:
    return float(held[name].mean()) if name in (held.dtype.names or ()) else None
