"""Interface of the controller; its gains are by rules, from the inertia of the paper's vehicle, added mass included.

K_S / M is 0.5 m/s^2 or 0.8 rad/s^2, and the width of the boundary layer K_S / (M Lambda), rounded: in it s decays as
fast as the error does (Slotine & Li 1991, section 7.2).
"""

from .. import feedback, measurement
from ..interface import POSE, VELOCITY_UNITS, WRENCH_UNITS, Sampled, switch, vector
from ..vehicle import MODEL_PARAMETERS, THRUSTER_PARAMETERS, WEIGHT_PARAMETERS
from . import equations

_S_FROM = (*feedback.ERROR_FROM, *feedback.RATE_FROM, "eta_dot_d", "Lambda", "integration")

COMPONENT = Sampled(
    name="sliding_mode",
    title="Sliding-mode controller",
    description="Set-point controller that switches the thrust, in a boundary layer, against all that its model leaves",
    symbol="SM",
    inputs=feedback.INPUTS,
    outputs=feedback.outputs(
        vector("s", POSE, "Sliding variable, earth frame", unit=VELOCITY_UNITS, initially_from=_S_FROM),
        *_S_FROM,
        "K_S",
        "boundary_layer",
        "D_linear",
        law=tuple(signal.key for signal in MODEL_PARAMETERS),
    ),
    parameters=(
        vector(
            "K_S",
            POSE,
            "Switching gain: more than the unknown force or moment in the axis, earth frame",
            unit=WRENCH_UNITS,
            start=[60.0, 64.0, 68.0, 7.4, 12.6, 11.8],
            minimum=0.0,
            tunable=True,
        ),
        vector(
            "Lambda",
            POSE,
            "Rate at which the error decays while sliding",
            unit=("1/s",) * 6,
            start=0.7,
            minimum=0.0,
            tunable=True,
        ),
        vector(
            "boundary_layer",
            POSE,
            "Width Phi of the boundary layer about s = 0; 0: the thrust switches",
            unit=VELOCITY_UNITS,
            start=[0.7, 0.7, 0.7, 1.1, 1.1, 1.1],
            minimum=0.0,
            tunable=True,
        ),
        switch(
            "integration", "Slide on the integral of the error too, so that no offset remains", start=1, tunable=True
        ),
        feedback.CONTROL_ROLL_PITCH,
        *measurement.PARAMETERS,
        *WEIGHT_PARAMETERS,
        *MODEL_PARAMETERS,
        *THRUSTER_PARAMETERS,
    ),
    states=(vector("z", POSE, "Integral of the error"), *measurement.STATES),
    initial_state=equations.initial_state,
    sample=equations.sample,
    requirements=feedback.REQUIREMENTS,
)
