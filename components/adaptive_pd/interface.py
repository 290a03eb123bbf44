"""Interface of the controller; the default gains are those of Hoang & Kreuzer 2007, section 4.2."""

from .. import feedback, measurement
from ..interface import Sampled, Signal, switch
from ..vehicle import ATTACK_POINTS, COUPLE, FORCES, THRUSTER_PARAMETERS, WEIGHT_PARAMETERS
from . import equations

_UNITS = ("N",) * len(FORCES) + ("N.m",) * len(COUPLE)

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
    ),
    parameters=(
        *feedback.GAINS,
        Signal(
            "Gamma",
            "Adaptation gain; 0: this force or couple is not adapted",
            pattern="Gamma.{}",
            axes=(equations.LOADS,),
            unit=("N/m",) * len(FORCES) + ("N.m/rad",) * len(COUPLE),
            start=[10.0] * len(FORCES) + [0.0] * len(COUPLE),
            minimum=0.0,
            tunable=True,
        ),
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
    requirements=feedback.REQUIREMENTS,
)
