"""What the controllers share: the PD law, allocation, and the ports and parameters they all declare.

Frames as in `frames`. In the four-DOF form the rows and errors of roll and pitch are left out: in the feedback, in what
integrates it and in the allocation. What they use of the measured pose is in `measurement`.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from .frames import jacobian
from .interface import (
    POSE,
    POSE_UNITS,
    VELOCITY,
    VELOCITY_UNITS,
    WRENCH,
    WRENCH_UNITS,
    Requirement,
    Signal,
    indexed,
    switch,
    vector,
)
from .measurement import Measured, is_enabled
from .vehicle import N_THRUSTERS, UNIT_DIRECTIONS, allocation_matrix, degrees_of_freedom, limited, restoring

NEGLIGIBLE = 1e-6
"""Part of the demanded wrench in N or N m that counts as met."""


def pd_law(m: Measured, disturbance: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """Return the demanded wrench tau and its part at rest, without the damping term; body frame, each of shape (6,).

    tau = J^T(eta) [-K_P e - K_D eta'] + g_V(eta) - disturbance        (Hoang & Kreuzer 2007, eq. 4)

    disturbance, shape (6,), is the estimated body wrench on the vehicle, in the paper -J^T(eta) Phi(eta) times the
    estimated forces.
    """
    J = jacobian(m.eta)
    at_rest = J.T @ (-p.K_P * m.e) + restoring(m.eta, p.mass, p.g, p.r_G, p.r_B) - disturbance
    return at_rest - J.T @ (p.K_D * m.eta_dot), at_rest


def command(tau: Any, u: SimpleNamespace, p: SimpleNamespace) -> Mapping[str, Any]:
    """Return the outputs tau, u and saturated for a demanded wrench tau, shape (6,)."""
    controlled = np.where(is_enabled(u), degrees_of_freedom(p.control_roll_pitch) * tau, 0.0)
    demanded = allocate(controlled, p)
    delivered = limited(demanded, p.thrust_max)
    return {"tau": controlled, "u": delivered, "saturated": np.max(np.abs(demanded - delivered)) > 0}


def where_delivered(signal: Any, at_rest: Any, p: SimpleNamespace) -> Any:
    """Return a body-frame signal, shape (6,), zero in the axes in which saturated thrusters do not deliver at_rest.

    The error there is not for want of a better estimate, which would wind up. at_rest, shape (6,), is the demanded
    wrench less the damping term, because that carries the noise: frozen at its peaks, the estimate would settle with
    an offset.
    """
    holding = allocate(at_rest, p)
    unmet = thruster_wrenches(p) @ (holding - limited(holding, p.thrust_max))
    return np.where(np.abs(unmet) > NEGLIGIBLE, 0.0, signal)


def allocate(tau: Any, p: SimpleNamespace) -> Any:
    """Return the thruster forces u, shape (8,), of least norm that yield the controlled rows of tau, shape (6,).

    u = B^T (B B^T)^-1 tau        (Hoang & Kreuzer 2007, eq. 4)
    """
    B = thruster_wrenches(p)
    return B.T @ np.linalg.solve(_gram(p), tau)


def thruster_wrenches(p: SimpleNamespace) -> Any:
    """Return the allocation matrix, shape (6, 8), with the rows that are not controlled set to zero."""
    B = allocation_matrix(p.thruster_r, p.thruster_d, p.thruster_enabled)
    return np.diag(degrees_of_freedom(p.control_roll_pitch)) @ B


def allocation_margin(p: SimpleNamespace) -> Any:
    """Return a positive number if the enabled thrusters span the controlled degrees of freedom."""
    gram = _gram(p)
    scale = np.max(np.abs(gram))
    return np.linalg.det(gram / scale) - 1e-12


def _gram(p: SimpleNamespace) -> Any:
    """Return B B^T, shape (6, 6), with ones on the diagonal where a row is not controlled."""
    B = thruster_wrenches(p)
    return B @ B.T + np.diag(1 - degrees_of_freedom(p.control_roll_pitch))


_MEASURED = ("eta_m", "eta_m_valid", "disable")
_ERROR = (*_MEASURED, "eta_d", "control_roll_pitch")
_RATE = (*_MEASURED, "nu_m", "use_measured_velocity", "control_roll_pitch")
_PD = (*_ERROR, *_RATE, "K_P", "K_D", "mass", "g", "r_G", "r_B")
_THRUSTERS = ("thruster_r", "thruster_d", "thruster_enabled", "thrust_max")

INPUTS = (
    vector("eta_m", POSE, "Measured pose in the earth frame", unit=POSE_UNITS),
    switch("eta_m_valid", "Whether eta_m is a measurement; while false it is not used"),
    vector("nu_m", VELOCITY, "Measured body velocity, used with use_measured_velocity", unit=VELOCITY_UNITS),
    vector("eta_d", POSE, "Set-point in the earth frame", unit=POSE_UNITS),
    switch("disable", "Switch the thrusters off and freeze the estimate"),
)


def outputs(estimate: Signal, *disturbance_from: str) -> tuple[Signal, ...]:
    """Return the outputs of a controller with its own estimate among them.

    disturbance_from are the parameters on which the estimated wrench depends in Initialization Mode.
    """
    disturbance = (*_MEASURED, *disturbance_from)
    tau = tuple(dict.fromkeys((*disturbance, *_PD)))
    return (
        indexed("u", N_THRUSTERS, "Thruster force command", unit="N", initially_from=(*tau, *_THRUSTERS)),
        vector("tau", WRENCH, "Demanded wrench, body frame, before limits", unit=WRENCH_UNITS, initially_from=tau),
        estimate,
        vector(
            "disturbance",
            WRENCH,
            "Estimated disturbance wrench on the vehicle, body frame",
            unit=WRENCH_UNITS,
            initially_from=disturbance,
        ),
        vector(
            "eta_dot",
            POSE,
            "Rate of the pose that the law used",
            unit=("m/s",) * 3 + ("rad/s",) * 3,
            initially_from=_RATE,
        ),
        vector("e", POSE, "Pose error that the law used", unit=POSE_UNITS, initially_from=_ERROR),
        switch("saturated", "Whether a thruster command is limited", initially_from=(*tau, *_THRUSTERS)),
    )


GAINS = (
    vector(
        "K_P",
        POSE,
        "Proportional gain (roll and pitch: not in the paper)",
        unit=("N/m", "N/m", "N/m", "N.m/rad", "N.m/rad", "N.m/rad"),
        start=[80.0, 80.0, 100.0, 30.0, 30.0, 30.0],
        minimum=0.0,
        tunable=True,
    ),
    vector(
        "K_D",
        POSE,
        "Derivative gain (roll and pitch: not in the paper)",
        unit=("N.s/m", "N.s/m", "N.s/m", "N.m.s/rad", "N.m.s/rad", "N.m.s/rad"),
        start=[90.0, 90.0, 120.0, 45.0, 45.0, 45.0],
        minimum=0.0,
        tunable=True,
    ),
)
"""The default gains are those of Hoang & Kreuzer 2007, section 4.2."""

CONTROL_ROLL_PITCH = switch(
    "control_roll_pitch", "Control roll and pitch too; false: the paper's four degrees of freedom"
)
REQUIREMENTS = (
    Requirement(
        allocation_margin,
        "The enabled thrusters cannot produce every controlled wrench (B B^T is singular): enable more thrusters, "
        "check thruster[i].r.* and thruster[i].d.*, or set control_roll_pitch to false.",
    ),
    UNIT_DIRECTIONS,
)
