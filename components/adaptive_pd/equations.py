"""The adaptive PD controller of Hoang & Kreuzer 2007: eq. 4 is in `feedback`, eq. 5 is `adaptation_law`.

theta_hat is the estimate of the unknown forces and couple, `LOADS`; W maps them to the body wrench. The paper has the
seven forces alone; its proof covers any constant loads whose wrench is W(eta) times them.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from .. import feedback, measurement
from ..frames import jacobian_inverse
from ..gain_matrices import symmetric
from ..measurement import Measured, measured
from ..vehicle import COUPLE, FORCES, couple_map, disturbance_map

LOADS = (*FORCES, *COUPLE)
"""What is estimated."""


def disturbance_of(loads: Any, eta: Any, p: SimpleNamespace) -> Any:
    """Return W(eta) loads, the body wrench, shape (6,), of `LOADS`, shape (10,)."""
    forces, couple = loads[: len(FORCES)], loads[len(FORCES) :]
    return disturbance_map(eta, p.r_B, p.r_C, p.r_A) @ forces + couple_map(eta) @ couple


def adaptation_law(m: Measured, demand: feedback.Demand, p: SimpleNamespace) -> Any:
    """Return the rate of the estimate theta_hat, shape (10,), in N/s and N m/s.

    theta_hat' = Gamma W^T(eta) J^-1(eta) (e' + epsilon_0 / (1 + alpha |e|) e)        (Hoang & Kreuzer 2007, eq. 5)

    where W^T J^-1 is the paper's -Phi^T. With p.adapt_by_pose e' is the mean rate since the last sample, at the pose
    half-way. The body axes in which the thrusters do not deliver the demand are left out.
    """
    eta = np.where(p.adapt_by_pose > 0, m.eta_half_way, m.eta)
    e_dot = np.where(p.adapt_by_pose > 0, m.e_dot_mean, m.e_dot)
    epsilon = p.epsilon_0 / (1 + p.alpha * np.sqrt(np.sum(m.e**2)))
    s = feedback.where_delivered(jacobian_inverse(eta) @ (e_dot + epsilon * m.e), demand, p)
    of_forces, of_couple = disturbance_map(eta, p.r_B, p.r_C, p.r_A).T @ s, couple_map(eta).T @ s
    Gamma, of_M = symmetric(p.Gamma[: len(FORCES)], p.Gamma_off), p.Gamma[len(FORCES) :]
    return np.where(p.adaptation > 0, np.concatenate([Gamma @ of_forces, of_M * of_couple]), 0.0)


def sample(
    x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, w: Any
) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return state and outputs after one sample; no draws are needed."""
    m = measured(x, u, p)
    disturbance = disturbance_of(x.theta_hat, m.eta, p)
    K_P, K_D = symmetric(p.K_P, p.K_P_off), symmetric(p.K_D, p.K_D_off)
    demand = feedback.pd_law(m, disturbance, K_P, K_D, p)
    rate = adaptation_law(m, demand, p)
    estimate = {"theta_hat": x.theta_hat, "disturbance": disturbance}
    return (
        {"theta_hat": x.theta_hat + p.sample_time * rate, **m.state},
        {**feedback.command(demand.tau, u, p), **estimate, **m.outputs},
    )


def initial_state(p: SimpleNamespace) -> Mapping[str, Any]:
    """Return the state before the first sample, with the initial estimate."""
    return {"theta_hat": p.theta_hat_0, **measurement.initial_state()}
