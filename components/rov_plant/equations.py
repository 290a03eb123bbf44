"""Equations of motion of the vehicle (Fossen 1994; Hoang & Kreuzer 2007, eq. 1).

M nu_r' + C(nu_r) nu_r + D(nu_r) nu_r + g_V(eta) = B f + W(eta) theta + arm and umbilical,    eta' = J(eta) nu

with nu_r = nu - nu_c the velocity relative to a uniform current, f the thruster forces after limits and lag, and theta
the unknown forces, `vehicle.FORCES`.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..frames import jacobian, rotation, skew
from ..vehicle import (
    allocation_matrix,
    coriolis,
    degrees_of_freedom,
    limited,
    mass_matrix,
    restoring,
    wrench,
)

NEARLY_SINGULAR = 1e-9
"""Leading minor of the scaled mass matrix below which digits of the acceleration are lost."""


def inertia(p: SimpleNamespace) -> Any:
    """Return M, shape (6, 6), about the body origin."""
    return mass_matrix(p.mass, p.I, p.r_G, p.added_mass)


def unknown_forces(eta: Any, u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Return the body wrench, shape (6,), of excess buoyancy, umbilical and arm (-d_V: Hoang & Kreuzer 2007, eq. 1)."""
    to_body = rotation(eta[3:6]).T
    F_C, F_A = p.forces[1:4] + u.F_umbilical, p.forces[4:7] + u.F_arm
    return wrench(p.r_B, to_body[:, 2] * p.forces[0]) + wrench(p.r_C, to_body @ F_C) + wrench(p.r_A, to_body @ F_A)


def resistance(nu_r: Any, M: Any, p: SimpleNamespace) -> Any:
    """Return C(nu_r) nu_r + D(nu_r) nu_r, shape (6,)."""
    return coriolis(M, nu_r) @ nu_r + (p.D_linear + p.D_quadratic * np.abs(nu_r)) * nu_r


def disturbance(eta: Any, u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Return the body wrench, shape (6,), that thrusters must balance to hold the vehicle still: forces and current."""
    still = np.concatenate([-rotation(eta[3:6]).T @ u.current, np.zeros(3)])
    return unknown_forces(eta, u, p) - resistance(still, inertia(p), p)


def mobility(M: Any, p: SimpleNamespace) -> Any:
    """Return the inverse of M, shape (6, 6), less its rows and columns of locked degrees of freedom: 0 in these."""
    free = np.diag(degrees_of_freedom(1 - p.lock_roll_pitch))
    return free @ np.linalg.solve(free @ M @ free + np.eye(6) - free, free)


def rates(eta: Any, nu: Any, tau: Any, M: Any, u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Return [eta' nu'], shape (12,), under the thruster wrench tau, shape (6,), with M from `inertia`.

    This is Hoang & Kreuzer 2007, eq. 1, in a current, solved for nu' = nu_r' + nu_c'.
    """
    current = rotation(eta[3:6]).T @ u.current
    nu_r = np.concatenate([nu[0:3] - current, nu[3:6]])
    current_rate = np.concatenate([-skew(nu[3:6]) @ current, np.zeros(3)])
    forces = tau + unknown_forces(eta, u, p) - resistance(nu_r, M, p) - restoring(eta, p.mass, p.g, p.r_G, p.r_B)
    return np.concatenate([jacobian(eta) @ nu, mobility(M, p) @ forces + current_rate])


def commanded_thrust(u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Return the thruster forces, shape (8,), that the held command leads to."""
    return limited(np.where(np.abs(u.u) < p.thruster_dead_band, 0.0, u.u), p.thrust_max)


def lagged(s: Any, before: Any, target: Any, p: SimpleNamespace) -> Any:
    """Return forces of the thrusters, or their wrench, a time s after `before`: the exact lag to a held `target`."""
    lags = p.thruster_time_constant > 0
    decay = np.where(lags, np.exp(-s / np.where(lags, p.thruster_time_constant, 1.0)), 0.0)
    return target + (before - target) * decay


def thruster_wrenches(u: SimpleNamespace, p: SimpleNamespace) -> Any:
    """Return B, shape (6, 8): the body wrench of 1 N of each thruster, less what it has lost."""
    return allocation_matrix(p.thruster_r, p.thruster_d, p.thruster_enabled) * (1.0 - u.thrust_loss)


def advance(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, h: Any) -> Mapping[str, Any]:
    """Return the state after h by one step of the classical Runge-Kutta method."""
    M, B, target = inertia(p), thruster_wrenches(u, p), commanded_thrust(u, p)
    tau_before, tau_target = B @ x.thrust, B @ target

    def f(s: Any, z: Any) -> Any:
        return rates(z[0:6], z[6:12], lagged(s, tau_before, tau_target, p), M, u, p)

    z = np.concatenate([x.eta, x.nu])
    k_1 = f(0.0, z)
    k_2 = f(h / 2, z + h / 2 * k_1)
    k_3 = f(h / 2, z + h / 2 * k_2)
    k_4 = f(h, z + h * k_3)
    z = z + h / 6 * (k_1 + 2 * k_2 + 2 * k_3 + k_4)
    return {"eta": z[0:6], "nu": z[6:12], "thrust": lagged(h, x.thrust, target, p)}


def outputs_of(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Mapping[str, Any]:
    """Return pose, velocity, the thruster wrench after limits and lag, and what it has to balance."""
    return {
        "eta": x.eta,
        "nu": x.nu,
        "tau": thruster_wrenches(u, p) @ lagged(0.0, x.thrust, commanded_thrust(u, p), p),
        "disturbance": disturbance(x.eta, u, p),
    }


def initial_state(p: SimpleNamespace) -> Mapping[str, Any]:
    """Return the state at eta_0, nu_0 with the thrusters at rest."""
    return {"eta": p.eta_0, "nu": p.nu_0, "thrust": np.zeros(p.thruster_enabled.shape[0])}


def inertia_margin(p: SimpleNamespace) -> Any:
    """Return a positive number if M is positive definite, by its leading minors (Sylvester), and not nearly singular.

    The minors are those of M scaled to a diagonal of ones, so that they neither overflow nor depend on units.
    """
    M = inertia(p)
    scale = np.diag(1 / np.sqrt(np.diag(M)))
    minors = np.stack([np.linalg.det((scale @ M @ scale)[:k, :k]) for k in range(1, 7)])
    return 0.5 - np.sum(np.where(minors > NEARLY_SINGULAR, 0.0, 1.0))


def lock_margin(p: SimpleNamespace) -> Any:
    """Return a positive number unless roll and pitch are locked away from zero."""
    locked = np.abs(np.concatenate([p.eta_0[3:5], p.nu_0[3:5]]))
    return np.where(p.lock_roll_pitch > 0, 1e-12 - np.max(locked), 1.0)
