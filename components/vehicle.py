"""Rigid-body hydrodynamics that the vehicle and its controller share, and the vehicle parameters they both declare.

Frames as in `frames`. Added mass and damping are stored positive. The default vehicle is that of Hoang & Kreuzer 2007,
section 4: 800 x 500 x 550 mm, about 80 kg, eight thrusters; what the paper leaves open is marked as an estimate.
"""

from typing import Any

import numpy as np

from .frames import array, rotation, skew
from .interface import VELOCITY, XYZ, Requirement, Signal, count, vector

N_THRUSTERS = 8
THRUSTERS = count(N_THRUSTERS)
FORCES = ("dB", "F_C.x", "F_C.y", "F_C.z", "F_A.x", "F_A.y", "F_A.z")
"""The unknown forces in N: excess buoyancy at r_B, umbilical at r_C, arm at r_A; earth frame, on the vehicle.

The paper calls their vector theta, which in code is the pitch angle alone; theta_hat is the paper's estimate of it.
"""

COUPLE = ("M.x", "M.y", "M.z")
"""A couple in N m, earth frame, on the vehicle."""

FOUR_DOF = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 1.0])
"""Selects surge, sway, heave and yaw: the paper's four degrees of freedom."""

_HALF_LENGTH, _HALF_WIDTH = 0.4, 0.25
_CORNERS = [(x, y, 0.0) for x in (_HALF_LENGTH, -_HALF_LENGTH) for y in (_HALF_WIDTH, -_HALF_WIDTH)]
_C = np.sqrt(0.5)
_HORIZONTAL = [(_C, -_C, 0.0), (_C, _C, 0.0), (_C, _C, 0.0), (_C, -_C, 0.0)]
_VERTICAL = [(0.0, 0.0, 1.0)] * 4


def degrees_of_freedom(all_six: Any) -> Any:
    """Return the selection vector, shape (6,): all ones where `all_six` is 1, else `FOUR_DOF`."""
    return np.where(all_six > 0, np.ones(6), FOUR_DOF)


def mass_matrix(mass: Any, inertia: Any, r_G: Any, added_mass: Any) -> Any:
    """Return M = M_RB + M_A about the body origin, shape (6, 6) (Fossen 1994, chapter 2).

    inertia is [I_xx I_yy I_zz I_xy I_xz I_yz] about the body origin in kg m^2, with I_xy the integral of x y dm;
    added_mass, shape (6,), the positive diagonal of M_A.
    """
    i_xx, i_yy, i_zz, i_xy, i_xz, i_yz = (inertia[i] for i in range(6))
    I_O = np.reshape(array([i_xx, -i_xy, -i_xz, -i_xy, i_yy, -i_yz, -i_xz, -i_yz, i_zz]), (3, 3))
    coupling = mass * skew(r_G)
    upper = np.concatenate([mass * np.eye(3), -coupling], axis=1)
    lower = np.concatenate([coupling, I_O], axis=1)
    return np.concatenate([upper, lower], axis=0) + np.diag(added_mass)


def coriolis(M: Any, nu: Any) -> Any:
    """Return C(nu), shape (6, 6), skew-symmetric, for the inertia matrix M (Fossen 1994, chapter 2)."""
    momentum = M @ nu
    S_linear, S_angular = -skew(momentum[0:3]), -skew(momentum[3:6])
    upper = np.concatenate([np.zeros((3, 3)), S_linear], axis=1)
    lower = np.concatenate([S_linear, S_angular], axis=1)
    return np.concatenate([upper, lower], axis=0)


def wrench(r: Any, force: Any) -> Any:
    """Return the body wrench, shape (6,), of a force at point r, both in body coordinates."""
    return np.concatenate([force, skew(r) @ force])


def restoring(eta: Any, mass: Any, g: Any, r_G: Any, r_B: Any) -> Any:
    """Return g_V(eta), shape (6,), of Hoang & Kreuzer 2007, eq. 1.

    It is minus the body wrench of the weight at r_G and an equal buoyancy at r_B.
    """
    up = rotation(eta[3:6]).T @ np.array([0.0, 0.0, 1.0])
    weight = mass * g
    return np.concatenate([np.zeros(3), weight * (skew(r_G - r_B) @ up)])


def disturbance_map(eta: Any, r_B: Any, r_C: Any, r_A: Any) -> Any:
    """Return W(eta), shape (6, 7): W theta is the body wrench of the unknown forces theta on the vehicle.

    The regressor of the paper is Phi(eta) = -J^-T(eta) W(eta), so that J^T Phi theta = -W theta (Hoang & Kreuzer 2007,
    eq. 3).
    """
    to_body = rotation(eta[3:6]).T
    forces = np.concatenate([np.reshape(to_body[:, 2], (3, 1)), to_body, to_body], axis=1)
    moments = [np.reshape(skew(r_B) @ to_body[:, 2], (3, 1)), skew(r_C) @ to_body, skew(r_A) @ to_body]
    return np.concatenate([forces, np.concatenate(moments, axis=1)], axis=0)


def couple_map(eta: Any) -> Any:
    """Return the body wrench, shape (6, 3), of a couple of 1 N m about each axis of the earth frame."""
    return np.concatenate([np.zeros((3, 3)), rotation(eta[3:6]).T], axis=0)


def allocation_matrix(r: Any, d: Any, enabled: Any) -> Any:
    """Return B, shape (6, n): column i is the body wrench of 1 N of thruster i, zero if it is not enabled.

    r and d, shape (n, 3), are positions and unit directions of positive force in the body frame.
    """
    moments = [
        r[:, 1] * d[:, 2] - r[:, 2] * d[:, 1],
        r[:, 2] * d[:, 0] - r[:, 0] * d[:, 2],
        r[:, 0] * d[:, 1] - r[:, 1] * d[:, 0],
    ]
    return np.stack([d[:, 0], d[:, 1], d[:, 2], *moments]) * enabled


def limited(u: Any, thrust_max: Any) -> Any:
    """Return the thruster forces u clipped to +-thrust_max; unlimited where thrust_max is 0."""
    return np.where(thrust_max > 0, np.clip(u, -thrust_max, thrust_max), u)


def direction_error(d: Any) -> Any:
    """Return how far the rows of d, shape (n, 3), are from unit length, at the worst."""
    return np.max(np.abs(np.sqrt(d[:, 0] ** 2 + d[:, 1] ** 2 + d[:, 2] ** 2) - 1.0))


WEIGHT_PARAMETERS = (
    Signal("mass", "Dry mass of the vehicle", unit="kg", start=80.0, minimum=1e-3),
    Signal("g", "Acceleration of gravity", unit="m/s2", start=9.81, minimum=0.0),
    vector("r_G", XYZ, "Centre of gravity in the body frame", unit="m"),
    vector("r_B", XYZ, "Centre of buoyancy in the body frame (estimate)", unit="m", start=[0.0, 0.0, 0.05]),
)
_MASS_UNITS = ("kg", "kg", "kg", "kg.m2", "kg.m2", "kg.m2")
_LINEAR_UNITS = ("N.s/m", "N.s/m", "N.s/m", "N.m.s/rad", "N.m.s/rad", "N.m.s/rad")
_QUADRATIC_UNITS = ("N.s2/m2", "N.s2/m2", "N.s2/m2", "N.m.s2/rad2", "N.m.s2/rad2", "N.m.s2/rad2")
MODEL_PARAMETERS = (
    vector(
        "I",
        ("xx", "yy", "zz", "xy", "xz", "yz"),
        "Moment or product of inertia of the dry vehicle about the body origin (estimate)",
        unit="kg.m2",
        start=[3.7, 6.3, 5.9, 0.0, 0.0, 0.0],
    ),
    vector(
        "added_mass",
        VELOCITY,
        "Added mass, positive (roll and pitch: estimate)",
        unit=_MASS_UNITS,
        start=[40.0, 48.0, 56.0, 5.5, 9.4, 8.8],
        minimum=0.0,
    ),
    vector("D_linear", VELOCITY, "Linear damping, positive", unit=_LINEAR_UNITS, minimum=0.0),
    vector(
        "D_quadratic",
        VELOCITY,
        "Quadratic damping, positive (roll and pitch: estimate)",
        unit=_QUADRATIC_UNITS,
        start=[130.0, 195.0, 286.0, 4.8, 9.8, 10.18],
        minimum=0.0,
    ),
)
R_A = vector("r_A", XYZ, "Base of the arm in the body frame (estimate)", unit="m", start=[_HALF_LENGTH, 0.0, 0.0])
ATTACK_POINTS = (
    vector("r_C", XYZ, "Point of attack of the umbilical in the body frame (estimate)", unit="m", start=[0, 0, 0.275]),
    R_A,
)
THRUSTER_PARAMETERS = (
    Signal(
        "thruster_r",
        "Position of the thruster in the body frame (estimate)",
        pattern="thruster[{}].r.{}",
        axes=(THRUSTERS, XYZ),
        unit="m",
        start=_CORNERS + _CORNERS,
    ),
    Signal(
        "thruster_d",
        "Unit direction of the thruster's positive force on the vehicle, body frame (estimate)",
        pattern="thruster[{}].d.{}",
        axes=(THRUSTERS, XYZ),
        start=_HORIZONTAL + _VERTICAL,
        minimum=-1.0,
        maximum=1.0,
    ),
    Signal(
        "thruster_enabled",
        "Whether the thruster works",
        pattern="thruster[{}].enabled",
        axes=(THRUSTERS,),
        type="Boolean",
        start=1,
        minimum=0,
        maximum=1,
        tunable=True,
    ),
    Signal("thrust_max", "Largest force of a thruster either way; 0: no limit", unit="N", start=0.0, minimum=0.0),
)
UNIT_DIRECTIONS = Requirement(
    lambda p: 1e-6 - direction_error(p.thruster_d),
    "A thruster direction is not of unit length: normalise thruster[i].d.x/y/z.",
)
