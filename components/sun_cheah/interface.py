"""Interface of the controller; the default gains are those of Hoang & Kreuzer 2007, section 4.2.

The default Delta of 1 m and 1 rad is the saturated error without a scale, as Arimoto defines it.
"""

from .. import feedback, measurement
from ..interface import POSE, POSE_UNITS, Sampled, Signal, switch, vector
from ..vehicle import ATTACK_POINTS, FORCES, THRUSTER_PARAMETERS, WEIGHT_PARAMETERS
from . import equations

COMPONENT = Sampled(
    name="sun_cheah",
    title="Adaptive PD controller with saturated errors",
    description="Set-point controller with saturated errors that learns constant forces (after Sun & Cheah 2003)",
    symbol="SC",
    inputs=feedback.INPUTS,
    outputs=feedback.outputs(
        Signal(
            "theta_hat",
            "Estimated force on the vehicle, earth frame",
            pattern="theta_hat.{}",
            axes=(FORCES,),
            unit="N",
            initially_from=("theta_hat_0",),
        ),
        "theta_hat_0",
        "r_B",
        "r_C",
        "r_A",
        law=("K_P", "K_D", "Delta"),
    ),
    parameters=(
        *feedback.GAINS,
        Signal(
            "Gamma",
            "Adaptation gain; 0: this force is not adapted",
            pattern="Gamma.{}",
            axes=(FORCES,),
            unit="N/m",
            start=10.0,
            minimum=0.0,
            tunable=True,
        ),
        Signal(
            "epsilon_0",
            "Weight of the saturated error in the adaptation",
            unit="1/s",
            start=0.3,
            minimum=0,
            maximum=1,
            tunable=True,
        ),
        vector(
            "Delta",
            POSE,
            "Bound of the saturated error, which is reached at pi / 2 times it",
            unit=POSE_UNITS,
            start=1.0,
            minimum=1e-3,
            tunable=True,
        ),
        switch("adaptation", "Adapt the estimate; false: PD with restoring compensation", start=1, tunable=True),
        feedback.PROJECTION,
        feedback.CONTROL_ROLL_PITCH,
        Signal(
            "theta_hat_0",
            "Initial estimate of the force on the vehicle, earth frame",
            pattern="theta_hat_0.{}",
            axes=(FORCES,),
            unit="N",
        ),
        *measurement.PARAMETERS,
        *WEIGHT_PARAMETERS,
        *ATTACK_POINTS,
        *THRUSTER_PARAMETERS,
    ),
    states=(
        Signal("theta_hat", "Estimated forces", axes=(FORCES,), pattern="theta_hat.{}"),
        *measurement.STATES,
    ),
    initial_state=equations.initial_state,
    sample=equations.sample,
    requirements=feedback.REQUIREMENTS,
)
