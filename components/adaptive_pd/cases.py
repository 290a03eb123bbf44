"""Reference cases of the adaptive controller."""

from ..cases import Case
from ..feedback_cases import controller_cases, turning
from .interface import COMPONENT

CASES = (
    *controller_cases(COMPONENT, "adaptation", {"adaptation": 0}, {"theta_hat_0.dB": 5.0}),
    Case(
        "extended_law",
        "A couple is adapted too, by the way of the pose in all six axes; the measurement is lost from 4 s on",
        200,
        lambda t: {"eta_m_valid": (t < 4.0).astype(float), "eta_m": turning(t)},
        {
            **{"adapt_by_pose": 1, "projection": 1, "thrust_max": 20.0, "control_roll_pitch": 1},
            **{f"Gamma.M.{axis}": gain for axis, gain in zip("xyz", (2.0, 3.0, 4.0), strict=True)},
        },
    ),
)
