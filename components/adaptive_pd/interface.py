"""Interface of the controller; the default gains are those of Hoang & Kreuzer 2007, section 4.2."""

from .. import feedback, measurement
from ..gain_matrices import off_diagonal, positive_definite
from ..interface import POSE, Sampled, Signal, switch
from ..vehicle import ATTACK_POINTS, COUPLE, FORCES, THRUSTER_PARAMETERS, WEIGHT_PARAMETERS
from . import equations

_UNITS = ("N",) * len(FORCES) + ("N.m",) * len(COUPLE)
_GAMMA = Signal(
    "Gamma",
    "Adaptation gain; 0: this force or couple is not adapted",
    pattern="Gamma.{}",
    axes=(equations.LOADS,),
    unit=("N/m",) * len(FORCES) + ("N.m/rad",) * len(COUPLE),
    start=[10.0] * len(FORCES) + [0.0] * len(COUPLE),
    minimum=0.0,
    tunable=True,
)
_TURNS = ("phi", "theta", "psi")


def _unit(per: str, one: str, other: str) -> str:
    """Return the unit of a gain between two axes of the pose; per is "" or ".s"."""
    turns = sum(axis in _TURNS for axis in (one, other))
    return (f"N{per}/m", f"N{per}/rad", f"N.m{per}/rad")[turns]


_OFF_DIAGONAL = (
    off_diagonal(feedback.GAINS[0], POSE, lambda one, other: _unit("", one, other)),
    off_diagonal(feedback.GAINS[1], POSE, lambda one, other: _unit(".s", one, other)),
    off_diagonal(_GAMMA, FORCES, lambda one, other: "N/m"),
)
"""What couples two axes, or two forces; the couple M is adapted by itself."""

COMPONENT = Sampled(
    name="adaptive_pd",
    title="Adaptive PD controller",
    description="Set-point controller that estimates and cancels constant unknown forces (Hoang & Kreuzer 2007)",
    symbol="PD",
    inputs=feedback.INPUTS,
    outputs=feedback.outputs(
        Signal(
            "theta_hat",
            "Estimated force or couple on the vehicle, earth frame",
            pattern="theta_hat.{}",
            axes=(equations.LOADS,),
            unit=_UNITS,
            initially_from=("theta_hat_0",),
        ),
        "theta_hat_0",
        "r_B",
        "r_C",
        "r_A",
        law=("K_P", "K_P_off", "K_D", "K_D_off"),
    ),
    parameters=(
        *feedback.GAINS,
        _GAMMA,
        *_OFF_DIAGONAL,
        Signal(
            "epsilon_0",
            "Weight of the error in the adaptation",
            unit="1/s",
            start=0.3,
            minimum=0,
            maximum=1,
            tunable=True,
        ),
        Signal("alpha", "Saturation of the error in the adaptation", start=2.0, minimum=0.0, tunable=True),
        switch("adaptation", "Adapt the estimate; false: PD with restoring compensation", start=1, tunable=True),
        switch("adapt_by_pose", "Adapt by the way of the measured pose in place of the filtered velocity"),
        feedback.PROJECTION,
        feedback.CONTROL_ROLL_PITCH,
        Signal(
            "theta_hat_0",
            "Initial estimate of the force or couple on the vehicle, earth frame",
            pattern="theta_hat_0.{}",
            axes=(equations.LOADS,),
            unit=_UNITS,
        ),
        *measurement.PARAMETERS,
        *WEIGHT_PARAMETERS,
        *ATTACK_POINTS,
        *THRUSTER_PARAMETERS,
    ),
    states=(
        Signal("theta_hat", "Estimated forces and couple", axes=(equations.LOADS,), pattern="theta_hat.{}"),
        *measurement.STATES,
    ),
    initial_state=equations.initial_state,
    sample=equations.sample,
    requirements=(
        *feedback.REQUIREMENTS,
        positive_definite("K_P", len(POSE)),
        positive_definite("K_D", len(POSE)),
        positive_definite("Gamma", len(FORCES)),
    ),
)
