"""A PID controller in the form of the adaptive PD controller of Hoang & Kreuzer 2007, eq. 4, which is in `feedback`.

    disturbance = J^T(eta) z,        z' = K_I e

z is the integral part, in the earth frame. The gain stands inside the integral so that its change does not jump the
thrust.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from .. import feedback, measurement
from ..frames import jacobian, jacobian_inverse
from ..measurement import measured
from ..vehicle import degrees_of_freedom


def sample(
    x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, w: Any
) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return state and outputs after one sample; no draws are needed."""
    m = measured(x, u, p)
    J = jacobian(m.eta)

    disturbance = J.T @ x.integral
    demand = feedback.pd_law(m, disturbance, np.diag(p.K_P), np.diag(p.K_D), p)

    # The thrusters saturate in body axes, so the rate of the integral part goes there and back.
    rate = jacobian_inverse(m.eta).T @ feedback.where_delivered(J.T @ (p.K_I * m.e), demand, p)
    rate = np.where(p.integration > 0, degrees_of_freedom(p.control_roll_pitch) * rate, 0.0)

    estimate = {"integral": x.integral, "disturbance": disturbance}
    return (
        {"integral": x.integral + p.sample_time * rate, **m.state},
        {**feedback.command(demand.tau, u, p), **estimate, **m.outputs},
    )


def initial_state(p: SimpleNamespace) -> Mapping[str, Any]:
    """Return the state before the first sample, with the initial integral part."""
    return {"integral": p.integral_0, **measurement.initial_state()}
