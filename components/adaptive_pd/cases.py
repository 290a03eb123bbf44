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
    Case(
        "full_gains",
        "Gains that couple the axes, and the forces, of a vehicle that moves in all six",
        200,
        lambda t: {"eta_m_valid": 1.0, "eta_m": turning(t), "eta_d": turning(0.5 * t)},
        {
            **{"control_roll_pitch": 1, "K_P_off.x.z": 30.0, "K_P_off.y.psi": -15.0, "K_P_off.phi.theta": 5.0},
            **{"K_D_off.x.y": 25.0, "K_D_off.z.theta": -20.0, "Gamma_off.dB.F_A.z": 6.0, "Gamma_off.F_C.x.F_A.x": -4.0},
        },
    ),
)
