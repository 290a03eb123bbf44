"""Interface of the controller; the default gains are those of Hoang & Kreuzer 2007, section 4.2."""

from ..interface import (
    POSE,
    POSE_UNITS,
    SAMPLE_TIME,
    VELOCITY,
    VELOCITY_UNITS,
    WRENCH,
    WRENCH_UNITS,
    Requirement,
    Sampled,
    Signal,
    indexed,
    switch,
    vector,
)
from ..vehicle import (
    ATTACK_POINTS,
    N_THRUSTERS,
    THETA,
    THRUSTER_PARAMETERS,
    UNIT_DIRECTIONS,
    WEIGHT_PARAMETERS,
)
from . import equations

_STIFFNESS = ("N/m", "N/m", "N/m", "N.m/rad", "N.m/rad", "N.m/rad")
_DAMPING = ("N.s/m", "N.s/m", "N.s/m", "N.m.s/rad", "N.m.s/rad", "N.m.s/rad")
_MEASURED = ("eta_m", "eta_m_valid", "disable")
_DISTURBANCE = (*_MEASURED, "theta_hat_0", "r_B", "r_C", "r_A")
_ERROR = (*_MEASURED, "eta_d", "control_roll_pitch")
_RATE = (*_MEASURED, "nu_m", "use_measured_velocity", "control_roll_pitch")
_TAU = tuple(dict.fromkeys((*_DISTURBANCE, *_ERROR, *_RATE, "K_P", "K_D", "mass", "g", "r_G")))
_COMMAND = (*_TAU, "thruster_r", "thruster_d", "thruster_enabled", "thrust_max")

COMPONENT = Sampled(
    name="adaptive_pd",
    title="Adaptive PD controller",
    description="Set-point controller that estimates and cancels constant unknown forces (Hoang & Kreuzer 2007)",
    symbol="PD",
    inputs=(
        vector("eta_m", POSE, "Measured pose in the earth frame", unit=POSE_UNITS),
        switch("eta_m_valid", "Whether eta_m is a measurement; while false it is not used"),
        vector("nu_m", VELOCITY, "Measured body velocity, used with use_measured_velocity", unit=VELOCITY_UNITS),
        vector("eta_d", POSE, "Set-point in the earth frame", unit=POSE_UNITS),
        switch("disable", "Switch the thrusters off and freeze the estimate"),
    ),
    outputs=(
        indexed("u", N_THRUSTERS, "Thruster force command", unit="N", initially_from=_COMMAND),
        vector("tau", WRENCH, "Demanded wrench, body frame, before limits", unit=WRENCH_UNITS, initially_from=_TAU),
        Signal(
            "theta_hat",
            "Estimated force on the vehicle, earth frame",
            pattern="theta_hat.{}",
            axes=(THETA,),
            unit="N",
            initially_from=("theta_hat_0",),
        ),
        vector(
            "disturbance",
            WRENCH,
            "Estimated disturbance wrench on the vehicle, body frame",
            unit=WRENCH_UNITS,
            initially_from=_DISTURBANCE,
        ),
        vector(
            "eta_dot",
            POSE,
            "Rate of the pose that the law used",
            unit=("m/s",) * 3 + ("rad/s",) * 3,
            initially_from=_RATE,
        ),
        vector("e", POSE, "Pose error that the law used", unit=POSE_UNITS, initially_from=_ERROR),
        switch("saturated", "Whether a thruster command is limited", initially_from=_COMMAND),
    ),
    parameters=(
        vector(
            "K_P",
            POSE,
            "Proportional gain (roll and pitch: not in the paper)",
            unit=_STIFFNESS,
            start=[80.0, 80.0, 100.0, 30.0, 30.0, 30.0],
            minimum=0.0,
            tunable=True,
        ),
        vector(
            "K_D",
            POSE,
            "Derivative gain (roll and pitch: not in the paper)",
            unit=_DAMPING,
            start=[90.0, 90.0, 120.0, 45.0, 45.0, 45.0],
            minimum=0.0,
            tunable=True,
        ),
        Signal(
            "Gamma",
            "Adaptation gain; 0: this force is not adapted",
            pattern="Gamma.{}",
            axes=(THETA,),
            unit="N/m",
            start=10.0,
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
        switch("control_roll_pitch", "Control roll and pitch too; false: the paper's four degrees of freedom"),
        Signal(
            "theta_hat_0",
            "Initial estimate of the force on the vehicle, earth frame",
            pattern="theta_hat_0.{}",
            axes=(THETA,),
            unit="N",
        ),
        Signal("sample_time", "Time between samples", unit="s", start=SAMPLE_TIME, minimum=1e-6),
        Signal("filter_time_constant", "Time constant T_f of the lead filter", unit="s", start=0.1, minimum=1e-6),
        switch("use_measured_velocity", "Take the velocity from nu_m in place of the lead filter"),
        *WEIGHT_PARAMETERS,
        *ATTACK_POINTS,
        *THRUSTER_PARAMETERS,
    ),
    states=(
        Signal("theta_hat", "Estimated forces", axes=(THETA,), pattern="theta_hat.{}"),
        vector("eta", POSE, "Pose of the last valid measurement"),
        vector("filter_difference", POSE, "State of the lead filter"),
        Signal("filter_ready", "Whether the lead filter has a last measurement"),
    ),
    initial_state=equations.initial_state,
    sample=equations.sample,
    requirements=(
        Requirement(
            equations.allocation_margin,
            "The enabled thrusters cannot produce every controlled wrench (B B^T is singular): enable more thrusters, "
            "check thruster[i].r.* and thruster[i].d.*, or set control_roll_pitch to false.",
        ),
        UNIT_DIRECTIONS,
    ),
)
