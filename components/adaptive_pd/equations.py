"""The adaptive PD controller of Hoang & Kreuzer 2007: eq. 4 is in `feedback`, eq. 5 is `adaptation_law`.

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


def adaptation_law(m: Measured, W: Any, at_rest: Any, p: SimpleNamespace) -> Any:
    """Return the rate of the estimate theta_hat, shape (7,), in N/s.

    theta_hat' = Gamma W^T(eta) J^-1(eta) (eta' + epsilon_0 / (1 + alpha |e|) e)        (Hoang & Kreuzer 2007, eq. 5)

    where W^T J^-1 is the paper's -Phi^T; W is `disturbance_map` at eta. The body axes in which the thrusters do not
    deliver at_rest, from `feedback.pd_law`, are left out.
    """
    epsilon = p.epsilon_0 / (1 + p.alpha * np.sqrt(np.sum(m.e**2)))
    s = feedback.where_delivered(jacobian_inverse(m.eta) @ (m.eta_dot + epsilon * m.e), at_rest, p)
    return np.where(p.adaptation > 0, p.Gamma * (W.T @ s), 0.0)


def sample(
    x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, w: Any
) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return state and outputs after one sample; no draws are needed."""
    m = measured(x, u, p)
    W = disturbance_map(m.eta, p.r_B, p.r_C, p.r_A)

    disturbance = W @ x.theta_hat
    tau, at_rest = feedback.pd_law(m, disturbance, p)
    rate = adaptation_law(m, W, at_rest, p)

    estimate = {"theta_hat": x.theta_hat, "disturbance": disturbance}
    return (
        {"theta_hat": x.theta_hat + p.sample_time * rate, **m.state},
        {**feedback.command(tau, u, p), **estimate, **m.outputs},
    )


def initial_state(p: SimpleNamespace) -> Mapping[str, Any]:
    """Return the state before the first sample, with the initial estimate."""
    return {"theta_hat": p.theta_hat_0, **measurement.initial_state()}
