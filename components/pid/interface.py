"""Interface of the controller; K_I is by the rule of thumb omega_n / 10 K_P (Fossen 2011, section 12.2).

omega_n = sqrt(K_P / M), with the inertia M, added mass included, of the paper's vehicle in each axis.
"""

from .. import feedback, measurement
from ..interface import POSE, WRENCH_UNITS, Sampled, switch, vector
from ..vehicle import THRUSTER_PARAMETERS, WEIGHT_PARAMETERS
from . import equations

COMPONENT = Sampled(
    name="pid",
    title="PID controller",
    description="Set-point controller that removes the offset of constant unknown forces by integrating the error",
    symbol="PID",
    inputs=feedback.INPUTS,
    outputs=feedback.outputs(
        vector(
            "integral",
            POSE,
            "Integral part: estimated disturbance on the vehicle, earth frame, moments about the Euler angles' axes",
            unit=WRENCH_UNITS,
            initially_from=("integral_0",),
        ),
        "integral_0",
    ),
    parameters=(
        *feedback.GAINS,
        vector(
            "K_I",
            POSE,
            "Integral gain (by a rule of thumb)",
            unit=("N/(m.s)",) * 3 + ("N.m/(rad.s)",) * 3,
            start=[6.5, 6.3, 8.6, 5.4, 4.1, 4.3],
            minimum=0.0,
            tunable=True,
        ),
        switch("integration", "Integrate the error; false: the integral part stays as it is", start=1, tunable=True),
        feedback.CONTROL_ROLL_PITCH,
        vector("integral_0", POSE, "Initial integral part, earth frame", unit=WRENCH_UNITS),
        feedback.PROJECTION,
        *measurement.PARAMETERS,
        *WEIGHT_PARAMETERS,
        *THRUSTER_PARAMETERS,
    ),
    states=(vector("integral", POSE, "Integral part"), *measurement.STATES),
    initial_state=equations.initial_state,
    sample=equations.sample,
    requirements=feedback.REQUIREMENTS,
)
