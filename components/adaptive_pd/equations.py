"""The adaptive PD controller of Hoang & Kreuzer 2007, eq. 4 and 5.

    tau     = J^T(eta) [-K_P e - K_D eta'] + g_V(eta) - W(eta) theta_hat,        e = eta - eta_d         (4)
    u       = B^T (B B^T)^-1 tau
    theta_hat' = Gamma W^T(eta) J^-1(eta) (eta' + epsilon_0 / (1 + alpha |e|) e)                         (5)

with W the map from the unknown forces to the body wrench; the paper's regressor is Phi = -J^-T W. In the four-DOF form
the rows and errors of roll and pitch are left out: in the feedback, in the adaptation and in the allocation.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..frames import is_regular, jacobian, jacobian_inverse, pose_difference
from ..vehicle import allocation_matrix, degrees_of_freedom, disturbance_map, limited, restoring

NEGLIGIBLE = 1e-6
"""Part of the demanded wrench in N or N m that counts as met."""


def lead_filter(x: SimpleNamespace, eta_m: Any, ready: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """Return eta', shape (6,), by s / (T_f s + 1) from the measured pose, and the filter's state, shape (6,).

    The state d is the input less the low-passed input. It moves with the pose's increments, so that wrapped angles
    need no unwrapping: d_k = a d_(k-1) + (eta_k - eta_(k-1)), a = exp(-T / T_f), the exact zero-order-hold form.
    """
    decay = np.exp(-p.sample_time / p.filter_time_constant)
    d = np.where(ready, decay * x.filter_difference + pose_difference(eta_m, x.eta), 0.0)
    return d / p.filter_time_constant, d


def thruster_wrenches(p: SimpleNamespace) -> Any:
    """Return the allocation matrix, shape (6, 8), with the rows that are not controlled set to zero."""
    return np.diag(_dof(p)) @ allocation_matrix(p.thruster_r, p.thruster_d, p.thruster_enabled)


def allocate(tau: Any, p: SimpleNamespace) -> Any:
    """Return the thruster forces, shape (8,), of least norm that yield the controlled rows of tau, shape (6,)."""
    B = thruster_wrenches(p)
    return B.T @ np.linalg.solve(_gram(p), tau)


def adaptation_rate(W: Any, s: Any, unmet: Any, p: SimpleNamespace) -> Any:
    """Return theta_hat', shape (7,), in N/s for the body-frame error signal s = J^-1 (eta' + epsilon e), shape (6,).

    unmet, shape (6,), is the part of the wrench demanded at rest that saturated thrusters do not deliver. Its axes are
    left out: the error there is not for want of a better estimate, which would wind up. The demand is that at rest
    because the damping term carries the noise: frozen at its peaks, the estimate would settle with an offset.
    """
    return p.Gamma * (W.T @ np.where(np.abs(unmet) > NEGLIGIBLE, 0.0, s))


def sample(
    x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, w: Any
) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return state and outputs after one sample; no draws are needed."""
    dof = _dof(p)
    enabled = u.disable <= 0
    active = np.logical_and(np.logical_and(u.eta_m_valid > 0, is_regular(u.eta_m)), enabled)
    eta = np.where(active, u.eta_m, x.eta)
    J = jacobian(eta)

    ready = np.logical_and(active, x.filter_ready > 0)
    filtered, filter_difference = lead_filter(x, eta, ready, p)
    velocity = np.where(p.use_measured_velocity > 0, J @ u.nu_m, filtered)
    eta_dot = np.where(active, dof * velocity, 0.0)
    e = np.where(active, dof * pose_difference(eta, u.eta_d), 0.0)

    W = disturbance_map(eta, p.r_B, p.r_C, p.r_A)
    disturbance = W @ x.theta_hat
    at_rest = dof * (J.T @ (-p.K_P * e) + restoring(eta, p.mass, p.g, p.r_G, p.r_B) - disturbance)
    tau = np.where(enabled, at_rest - dof * (J.T @ (p.K_D * eta_dot)), 0.0)
    demanded = allocate(tau, p)
    delivered = limited(demanded, p.thrust_max)

    epsilon = p.epsilon_0 / (1 + p.alpha * np.sqrt(np.sum(e**2)))
    s = jacobian_inverse(eta) @ (eta_dot + epsilon * e)
    holding = allocate(at_rest, p)
    # Without a measurement e and eta_dot are zero, so the estimate is frozen.
    rate = adaptation_rate(W, s, thruster_wrenches(p) @ (holding - limited(holding, p.thrust_max)), p)

    state = {
        "theta_hat": x.theta_hat + np.where(p.adaptation > 0, p.sample_time * rate, 0.0),
        "eta": eta,
        "filter_difference": filter_difference,
        "filter_ready": active,
    }
    outputs = {
        "u": delivered,
        "tau": tau,
        "theta_hat": x.theta_hat,
        "disturbance": disturbance,
        "eta_dot": eta_dot,
        "e": e,
        "saturated": np.max(np.abs(demanded - delivered)) > 0,
    }
    return state, outputs


def initial_state(p: SimpleNamespace) -> Mapping[str, Any]:
    """Return the state before the first sample: the initial estimate and a filter that waits for a measurement."""
    return {
        "theta_hat": p.theta_hat_0,
        "eta": np.zeros(6),
        "filter_difference": np.zeros(6),
        "filter_ready": 0.0,
    }


def allocation_margin(p: SimpleNamespace) -> Any:
    """Return a positive number if the enabled thrusters span the controlled degrees of freedom."""
    gram = _gram(p)
    scale = np.max(np.abs(gram))
    return np.linalg.det(gram / scale) - 1e-12


def _dof(p: SimpleNamespace) -> Any:
    return degrees_of_freedom(p.control_roll_pitch)


def _gram(p: SimpleNamespace) -> Any:
    """Return B B^T, shape (6, 6), with ones on the diagonal where a row is not controlled."""
    B = thruster_wrenches(p)
    return B @ B.T + np.diag(1 - _dof(p))
