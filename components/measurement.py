"""What becomes of the measured pose: the error and the rate that a law uses, and when there are none.

Frames as in `frames`. In the four-DOF form the rows of roll and pitch are zero.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from .frames import is_regular, jacobian, pose_difference
from .interface import POSE, SAMPLE_TIME, Signal, switch, vector
from .vehicle import degrees_of_freedom


class Measured(NamedTuple):
    """What a law is to use.

    Parameters
    ----------
    eta : pose, shape (6,), the last valid one while there is no measurement.
    e : error eta - eta_d, shape (6,).
    eta_dot : rate of the pose, shape (6,).
    state : the values of `STATES` after the sample.
    """

    eta: Any
    e: Any
    eta_dot: Any
    state: Mapping[str, Any]

    @property
    def outputs(self) -> Mapping[str, Any]:
        """Values of the outputs that every controller has of it."""
        return {"eta_dot": self.eta_dot, "e": self.e}


def measured(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Measured:
    """Return what the law is to use of the measured pose.

    While there is no valid measurement, or the controller is disabled, e and eta' are zero: what integrates them is
    frozen. A singular attitude counts as no measurement.
    """
    dof = degrees_of_freedom(p.control_roll_pitch)
    active = np.logical_and(np.logical_and(u.eta_m_valid > 0, is_regular(u.eta_m)), is_enabled(u))
    eta = np.where(active, u.eta_m, x.eta)
    ready = np.logical_and(active, x.filter_ready > 0)
    filtered, filter_difference = _lead_filter(x, eta, ready, p)
    velocity = np.where(p.use_measured_velocity > 0, jacobian(eta) @ u.nu_m, filtered)
    e = np.where(active, dof * pose_difference(eta, u.eta_d), 0.0)
    eta_dot = np.where(active, dof * velocity, 0.0)
    return Measured(eta, e, eta_dot, {"eta": eta, "filter_difference": filter_difference, "filter_ready": active})


def is_enabled(u: SimpleNamespace) -> Any:
    """Tell whether the controller is not switched off."""
    return u.disable <= 0


def initial_state() -> Mapping[str, Any]:
    """Return the values of `STATES` before the first sample: a filter that waits for a measurement."""
    return {"eta": np.zeros(6), "filter_difference": np.zeros(6), "filter_ready": 0.0}


def _lead_filter(x: SimpleNamespace, eta_m: Any, ready: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """Return eta', shape (6,), by s / (T_f s + 1) from the measured pose, and the filter's state, shape (6,).

    The state d is the input less the low-passed input. It moves with the pose's increments, so that wrapped angles
    need no unwrapping: d_k = a d_(k-1) + (eta_k - eta_(k-1)), a = exp(-T / T_f), the exact zero-order-hold form.
    """
    decay = np.exp(-p.sample_time / p.filter_time_constant)
    d = np.where(ready, decay * x.filter_difference + pose_difference(eta_m, x.eta), 0.0)
    return d / p.filter_time_constant, d


PARAMETERS = (
    Signal("sample_time", "Time between samples", unit="s", start=SAMPLE_TIME, minimum=1e-6),
    Signal("filter_time_constant", "Time constant T_f of the lead filter", unit="s", start=0.1, minimum=1e-6),
    switch("use_measured_velocity", "Take the velocity from nu_m in place of the lead filter"),
)
STATES = (
    vector("eta", POSE, "Pose of the last valid measurement"),
    vector("filter_difference", POSE, "State of the lead filter"),
    Signal("filter_ready", "Whether the lead filter has a last measurement"),
)
