"""The adaptive PD controller of Hoang & Kreuzer 2007, eq. 4 and 5.

    tau     = J^T(eta) [-K_P e - K_D eta'] + g_V(eta) - W(eta) theta_hat,        e = eta - eta_d         (4)
    u       = B^T (B B^T)^-1 tau
    theta_hat' = Gamma W^T(eta) J^-1(eta) (eta' + epsilon_0 / (1 + alpha |e|) e)                         (5)

with W the map from the unknown forces to the body wrench; the paper's regressor is Phi = -J^-T W.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from .. import feedback
from ..frames import jacobian_inverse
from ..vehicle import disturbance_map


def sample(
    x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, w: Any
) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return state and outputs after one sample; no draws are needed."""
    eta, e, eta_dot, state = feedback.measured(x, u, p)
    W = disturbance_map(eta, p.r_B, p.r_C, p.r_A)

    disturbance = W @ x.theta_hat
    tau, at_rest = feedback.pd_law(eta, e, eta_dot, disturbance, p)

    epsilon = p.epsilon_0 / (1 + p.alpha * np.sqrt(np.sum(e**2)))
    s = feedback.where_delivered(jacobian_inverse(eta) @ (eta_dot + epsilon * e), at_rest, p)
    rate = np.where(p.adaptation > 0, p.Gamma * (W.T @ s), 0.0)

    estimate = {"theta_hat": x.theta_hat, "disturbance": disturbance}
    return (
        {"theta_hat": x.theta_hat + p.sample_time * rate, **state},
        {**feedback.command(tau, u, p), **estimate, "eta_dot": eta_dot, "e": e},
    )


def initial_state(p: SimpleNamespace) -> Mapping[str, Any]:
    """Return the state before the first sample, with the initial estimate."""
    return {"theta_hat": p.theta_hat_0, **feedback.initial_state()}
