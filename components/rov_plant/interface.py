"""Interface of the vehicle.

Masses and damping of the default vehicle are the totals of Hoang & Kreuzer 2007, section 4.1. Estimates, from a solid
box of the vehicle's size: the inertias; the added mass in roll and pitch (yaw's ratio of added to rigid-body inertia);
the damping in roll and pitch (yaw's, scaled with the integral of |lever|^3 over the faces that move broadside).
"""

from typing import Any

import numpy as np

from ..interface import (
    POSE,
    POSE_UNITS,
    VELOCITY,
    VELOCITY_UNITS,
    WRENCH,
    WRENCH_UNITS,
    XYZ,
    Continuous,
    Requirement,
    Signal,
    indexed,
    switch,
    vector,
)
from ..vehicle import (
    ATTACK_POINTS,
    FORCES,
    MODEL_PARAMETERS,
    N_THRUSTERS,
    THRUSTER_PARAMETERS,
    UNIT_DIRECTIONS,
    WEIGHT_PARAMETERS,
)
from . import equations

_UPRIGHT: dict[str, Any] = {
    "minimum": [*[-np.inf] * 4, -np.pi / 2, -np.inf],
    "maximum": [*[np.inf] * 4, np.pi / 2, np.inf],
}
_LOADS = ("F_arm", "F_umbilical", "eta_0", "forces", "r_B", "r_C", "r_A")
_DRAG = ("current", "mass", "I", "r_G", "added_mass", "D_linear", "D_quadratic")

COMPONENT = Continuous(
    name="rov_plant",
    title="Underwater vehicle with eight thrusters",
    description="Six-degree-of-freedom underwater vehicle with thrusters, current and unknown constant forces",
    symbol="ROV",
    inputs=(
        indexed("u", N_THRUSTERS, "Thruster force command", unit="N"),
        vector("F_arm", XYZ, "Further force on the vehicle at r_A, earth frame", unit="N"),
        vector("F_umbilical", XYZ, "Further force on the vehicle at r_C, earth frame", unit="N"),
        vector("current", XYZ, "Velocity of the water, earth frame", unit="m/s"),
        indexed("thrust_loss", N_THRUSTERS, "Share of its force that the thruster has lost; 1: dead, 2: reversed"),
    ),
    outputs=(
        vector(
            "eta",
            POSE,
            "Pose of the vehicle in the earth frame",
            unit=POSE_UNITS,
            **_UPRIGHT,
            initially_from=("eta_0",),
        ),
        vector(
            "nu",
            VELOCITY,
            "Velocity of the vehicle in the body frame",
            unit=VELOCITY_UNITS,
            initially_from=("nu_0",),
        ),
        vector(
            "tau",
            WRENCH,
            "Wrench of the thrusters on the vehicle after limits and lag, body frame",
            unit=WRENCH_UNITS,
            initially_from=(
                "u",
                "thrust_loss",
                "thruster_r",
                "thruster_d",
                "thruster_enabled",
                "thrust_max",
                "thruster_dead_band",
                "thruster_time_constant",
            ),
        ),
        vector(
            "disturbance",
            WRENCH,
            "Wrench of excess buoyancy, umbilical, arm and current on the vehicle if it were still, body frame",
            unit=WRENCH_UNITS,
            initially_from=(*_LOADS, *_DRAG),
        ),
    ),
    parameters=(
        *WEIGHT_PARAMETERS,
        *MODEL_PARAMETERS,
        *ATTACK_POINTS,
        Signal(
            "forces",
            "Force on the vehicle, earth frame: excess buoyancy at r_B (up), umbilical at r_C, arm at r_A",
            pattern="{}",
            axes=(FORCES,),
            unit="N",
            tunable=True,
        ),
        vector("eta_0", POSE, "Initial pose in the earth frame", unit=POSE_UNITS, **_UPRIGHT),
        vector("nu_0", VELOCITY, "Initial velocity in the body frame", unit=VELOCITY_UNITS),
        *THRUSTER_PARAMETERS,
        Signal(
            "thruster_dead_band",
            "Least force command that a thruster follows; a lesser one gives none",
            unit="N",
            minimum=0.0,
        ),
        Signal("thruster_time_constant", "Time constant of the thrusters; 0: ideal", unit="s", minimum=0.0),
        switch("lock_roll_pitch", "Hold roll and pitch at zero: the paper's four degrees of freedom", start=1),
        Signal("max_step", "Longest internal integration step", unit="s", start=0.01, minimum=1e-6),
    ),
    states=(
        vector("eta", POSE, "Pose"),
        vector("nu", VELOCITY, "Velocity"),
        indexed("thrust", N_THRUSTERS, "Thruster force"),
    ),
    initial_state=equations.initial_state,
    advance=equations.advance,
    outputs_of=equations.outputs_of,
    requirements=(
        Requirement(
            equations.inertia_margin,
            "The mass matrix is not positive definite: I.* are moments about the body origin, so they must exceed "
            "those of the mass at r_G; check mass, r_G.*, I.* and added_mass.*.",
        ),
        Requirement(
            equations.lock_margin,
            "Roll and pitch are locked at zero, but eta_0.phi, eta_0.theta, nu_0.p or nu_0.q is not zero: set these "
            "to 0 or lock_roll_pitch to false.",
        ),
        UNIT_DIRECTIONS,
    ),
)
