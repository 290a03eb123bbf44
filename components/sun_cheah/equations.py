"""Adaptive PD control with saturated position errors, after Sun & Cheah 2003.

    tau = J^T(eta) [-K_P s(e) - K_D eta'] + g_V(eta) - W(eta) theta_hat

theta_hat is the estimate of the unknown forces, `vehicle.FORCES`; W maps them to the body wrench.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from .. import feedback, measurement
from ..frames import jacobian_inverse
from ..measurement import Measured, measured
from ..vehicle import disturbance_map


def saturated_error(e: Any, Delta: Any) -> Any:
    """Return s(e), elementwise: Delta sin(e / Delta) up to |e| = Delta pi / 2, then +-Delta (Arimoto 1996)."""
    return Delta * np.sin(np.clip(e / Delta, -np.pi / 2, np.pi / 2))


def adaptation_law(m: Measured, W: Any, demand: feedback.Demand, p: SimpleNamespace) -> Any:
    """Return the rate of the estimate theta_hat, shape (7,), in N/s; the error in m is the saturated one.

    theta_hat' = Gamma W^T(eta) J^-1(eta) (e' + epsilon_0 s(e))

    W is `disturbance_map` at eta. The body axes in which the thrusters do not deliver the demand are left out.
    """
    rate = feedback.where_delivered(jacobian_inverse(m.eta) @ (m.e_dot + p.epsilon_0 * m.e), demand, p)
    return np.where(p.adaptation > 0, p.Gamma * (W.T @ rate), 0.0)


def sample(
    x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, w: Any
) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return state and outputs after one sample; no draws are needed."""
    m = measured(x, u, p)
    bounded = m._replace(e=saturated_error(m.e, p.Delta))
    W = disturbance_map(m.eta, p.r_B, p.r_C, p.r_A)

    disturbance = W @ x.theta_hat
    demand = feedback.pd_law(bounded, disturbance, np.diag(p.K_P), np.diag(p.K_D), p)
    rate = adaptation_law(bounded, W, demand, p)

    estimate = {"theta_hat": x.theta_hat, "disturbance": disturbance}
    return (
        {"theta_hat": x.theta_hat + p.sample_time * rate, **m.state},
        {**feedback.command(demand.tau, u, p), **estimate, **m.outputs},
    )


def initial_state(p: SimpleNamespace) -> Mapping[str, Any]:
    """Return the state before the first sample, with the initial estimate."""
    return {"theta_hat": p.theta_hat_0, **measurement.initial_state()}
