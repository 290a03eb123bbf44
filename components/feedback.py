"""What the controllers share: the PD law, allocation, and the ports and parameters they all declare.

Frames as in `frames`. In the four-DOF form the rows and errors of roll and pitch are left out: in the feedback, in what
integrates it and in the allocation. What they use of the measured pose is in `measurement`.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, NamedTuple

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


class Demand(NamedTuple):
    """What a law demands of the thrusters, body frame, each of shape (6,).

    Parameters
    ----------
    tau : the wrench.
    at_rest : its part without the damping term.
    estimated : its part that the error has no share in: what the estimate takes to hold the vehicle.
    """

    tau: Any
    at_rest: Any
    estimated: Any


def pd_law(m: Measured, disturbance: Any, K_P: Any, K_D: Any, p: SimpleNamespace) -> Demand:
    """Return what the PD law demands, with a compensation; the gains are matrices, shape (6, 6).

    tau = J^T(eta) [-K_P e - K_D e'] + g_V(eta) - disturbance        (Hoang & Kreuzer 2007, eq. 4)

    The paper's set-point rests, so its e' is eta'. disturbance, shape (6,), is the estimated body wrench on the
    vehicle, in the paper -J^T(eta) Phi(eta) times the estimated forces.
    """
    J = jacobian(m.eta)
    g_V = restoring(m.eta, p.mass, p.g, p.r_G, p.r_B)
    controlled = np.diag(degrees_of_freedom(p.control_roll_pitch))
    at_rest = J.T @ (-controlled @ (K_P @ m.e)) + g_V - disturbance
    return Demand(at_rest - J.T @ (controlled @ (K_D @ m.e_dot)), at_rest, g_V - disturbance)


def command(tau: Any, u: SimpleNamespace, p: SimpleNamespace) -> Mapping[str, Any]:
    """Return the outputs tau, u and saturated for a demanded wrench tau, shape (6,)."""
    controlled = np.where(is_enabled(u), degrees_of_freedom(p.control_roll_pitch) * tau, 0.0)
    demanded = allocate(controlled, p)
    delivered = limited(demanded, p.thrust_max)
    return {"tau": controlled, "u": delivered, "saturated": np.max(np.abs(demanded - delivered)) > 0}


def where_delivered(signal: Any, demand: Demand, p: SimpleNamespace) -> Any:
    """Return what an estimate of the disturbance integrates, body frame, shape (6,), zero in the axes to leave out.

    Those in which saturated thrusters do not deliver the wrench at rest: the error there is not for want of a better
    estimate, which would wind up. At rest, because the damping term carries the noise: frozen at its peaks, the
    estimate would settle with an offset.

    With p.projection those in which the thrusters cannot deliver what is estimated already, and the signal asks for
    more of it: the estimate stays among the disturbances that the thrusters can hold (parameter projection: Ioannou &
    Sun 1996, section 4.4). The error has no share in that, so its noise has none either.
    """
    judged = np.where(p.projection > 0, demand.estimated, demand.at_rest)
    holding = allocate(judged, p)
    unmet = thruster_wrenches(p) @ (holding - limited(holding, p.thrust_max))
    # A positive signal takes from the demanded wrench.
    left_out = np.logical_and(np.abs(unmet) > NEGLIGIBLE, np.logical_or(p.projection <= 0, signal * unmet < 0))
    return np.where(left_out, 0.0, signal)


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
ERROR_FROM = (*_MEASURED, "eta_d", "control_roll_pitch")
RATE_FROM = (*_MEASURED, "nu_m", "use_measured_velocity", "control_roll_pitch")
"""The inputs and parameters on which the outputs e and eta_dot depend in Initialization Mode."""

_WEIGHT = ("mass", "g", "r_G", "r_B")
_THRUSTERS = ("thruster_r", "thruster_d", "thruster_enabled", "thrust_max")

INPUTS = (
    vector("eta_m", POSE, "Measured pose in the earth frame", unit=POSE_UNITS),
    switch("eta_m_valid", "Whether eta_m is a measurement; while false it is not used"),
    vector("nu_m", VELOCITY, "Measured body velocity, used with use_measured_velocity", unit=VELOCITY_UNITS),
    vector("eta_d", POSE, "Set-point in the earth frame", unit=POSE_UNITS),
    vector("eta_dot_d", POSE, "Rate of the set-point", unit=VELOCITY_UNITS),
    switch("disable", "Switch the thrusters off and freeze the estimate"),
)


def outputs(estimate: Signal, *disturbance_from: str, law: tuple[str, ...] = ("K_P", "K_D")) -> tuple[Signal, ...]:
    """Return the outputs of a controller with its own estimate among them.

    disturbance_from are the parameters on which the estimated wrench depends in Initialization Mode, law those on which
    the demanded one does besides.
    """
    disturbance = (*_MEASURED, *disturbance_from)
    tau = tuple(dict.fromkeys((*disturbance, *ERROR_FROM, *RATE_FROM, "eta_dot_d", *law, *_WEIGHT)))
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
            unit=VELOCITY_UNITS,
            initially_from=RATE_FROM,
        ),
        vector("e", POSE, "Pose error that the law used", unit=POSE_UNITS, initially_from=ERROR_FROM),
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
PROJECTION = switch(
    "projection",
    "Stop the estimate at what the thrusters can hold; false: where they do not deliver what is demanded at rest",
)
REQUIREMENTS = (
    Requirement(
        allocation_margin,
        "The enabled thrusters cannot produce every controlled wrench (B B^T is singular): enable more thrusters, "
        "check thruster[i].r.* and thruster[i].d.*, or set control_roll_pitch to false.",
    ),
    UNIT_DIRECTIONS,
)
