"""How well a run held the vehicle: errors in hold, effort, estimate, and a verdict by stated rules."""

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ..components.interface import POSE, count
from ..components.vehicle import N_THRUSTERS
from .assessment import AXES, SETTLED, axes, controller_of, disturbances, errors, pose
from .wiring import Wiring

HOLD = 60.0
"""The last part of a run, in s, in which holding is scored."""
OFFSET = {"x": 5e-3, "y": 5e-3, "z": 5e-3, "psi": np.radians(1.0)}
"""Mean error in hold, in m and rad, beyond which an axis has an offset; 5 mm is the arm's own error."""
SWAY = SETTLED
"""Root mean square about the mean, in m and rad, beyond which an axis oscillates."""
LOST = {"x": 1.0, "y": 1.0, "z": 1.0, "psi": np.pi / 2}
"""Error in hold, in m and rad, beyond which the vehicle is lost."""

Verdict = Literal["held", "offset", "oscillates", "lost"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
"""From best to worst."""


@dataclass(frozen=True)
class Score:
    """How a run did. Errors are those of the hold; position errors the largest of x, y, z, in m, yaw in rad.

    Parameters
    ----------
    verdict : "lost" if the run failed, the measurement is gone at its end, or an axis is beyond `LOST`; else
        "oscillates" if one is beyond `SWAY`; else "offset" if one is beyond `OFFSET`; else "held".
    settling : time in s after which every axis stays within `assessment.SETTLED`; None: never.
    mean, rms, worst : of the position error; rms about zero.
    mean_yaw, rms_yaw, worst_yaw : of the yaw error.
    tilt : the largest angle of roll or pitch in rad.
    effort : root mean square of the thruster commands, all together, in N.
    saturated : share of the hold in which a command is limited.
    wrong_force, wrong_moment : root mean square of the estimated less the true disturbance, in N over X, Y and Z, and
        in N m about the vertical: the part of theta that shows at rest; None if nothing is estimated, or the truth is
        not told.
    reason : why a run failed, if it did.
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


def score(results: NDArray[Any], wiring: Wiring, failure: str = "") -> Score:
    """Return the score of a run's results; `failure` tells why it ended early, if it did."""
    if failure:
        return Score("lost", reason=failure)
    hold = results["time"] > results["time"][-1] - HOLD
    held, controller = results[hold], controller_of(wiring)
    error = errors(results, wiring)[hold][:, [POSE.index(axis) for axis in AXES]]
    mean, rms, worst = error.mean(axis=0), np.sqrt((error**2).mean(axis=0)), np.abs(error).max(axis=0)
    u = np.stack([held[f"{controller}.u[{i}]"] for i in count(N_THRUSTERS)])
    told = disturbances(held, wiring)
    if not any(estimated.any() for estimated, _ in told.values()):
        told = {}  # a PD controller's zero is no estimate
    wrong = {axis: np.sqrt(np.mean((estimated - true) ** 2)) for axis, (estimated, true) in told.items()}
    settling = [axis.settling for axis in axes(results, wiring)]
    return Score(
        verdict=_verdict(mean, error.std(axis=0), worst, bool(held["passive_arm.eta_m_valid"][-100:].any())),
        settling=None if None in settling else max(s for s in settling if s is not None),
        mean=float(np.abs(mean[:3]).max()),
        rms=float(rms[:3].max()),
        worst=float(worst[:3].max()),
        mean_yaw=float(abs(mean[3])),
        rms_yaw=float(rms[3]),
        worst_yaw=float(worst[3]),
        tilt=float(np.abs(pose(held, wiring)[3:5]).max()),
        effort=float(np.sqrt((u**2).sum(axis=0).mean())),
        saturated=float(held[f"{controller}.saturated"].mean()),
        wrong_force=float(np.sqrt(sum(wrong[axis] ** 2 for axis in "XYZ"))) if wrong else None,
        wrong_moment=float(wrong["N"]) if wrong else None,
    )


def _verdict(mean: NDArray[Any], sway: NDArray[Any], worst: NDArray[Any], measured: bool) -> Verdict:
    def beyond(values: NDArray[Any], limits: dict[str, float]) -> bool:
        return bool((np.abs(values) > [limits[axis] for axis in AXES]).any())

    if not measured or not np.isfinite(worst).all() or beyond(worst, LOST):
        return "lost"
    if beyond(sway, SWAY):
        return "oscillates"
    return "offset" if beyond(mean, OFFSET) else "held"
