"""What becomes of the measured pose: the error and the rate that a law uses, and when there are none.

Frames as in `frames`. In the four-DOF form the rows of roll and pitch are zero.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from .frames import array, is_regular, jacobian, pose_difference
from .interface import POSE, SAMPLE_TIME, Signal, switch, vector
from .vehicle import degrees_of_freedom

ROUNDING = 1e-6
"""Share of a sample by which a gap may exceed what is bridged."""


class Measured(NamedTuple):
    """What a law is to use.

    Parameters
    ----------
    eta : pose, shape (6,), the last valid one while there is no measurement.
    e : error eta - eta_d, shape (6,).
    eta_dot : rate of the pose, shape (6,).
    e_dot : rate of the error, eta' - eta_d', shape (6,).
    e_dot_mean : mean rate of the error since the last sample by the difference of the poses, shape (6,): unlike e_dot
        it is not late, and its sum over the samples is the way.
    eta_half_way : pose half-way to the last measurement, shape (6,), at which e_dot_mean is meant.
    state : the values of `STATES` after the sample.
    """

    eta: Any
    e: Any
    eta_dot: Any
    e_dot: Any
    e_dot_mean: Any
    eta_half_way: Any
    state: Mapping[str, Any]

    @property
    def outputs(self) -> Mapping[str, Any]:
        """Values of the outputs that every controller has of it."""
        return {"eta_dot": self.eta_dot, "e": self.e}


def measured(x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Measured:
    """Return what the law is to use of the measured pose.

    A gap of up to p.bridging s since the last measurement is bridged: pose and rate hold. While there is no measurement
    beyond that, or the controller is disabled, the errors and rates are zero: what integrates them is frozen. A
    singular attitude counts as no measurement. A pose that no motion leads to starts the filter anew.
    """
    dof = degrees_of_freedom(p.control_roll_pitch)
    arrived = np.logical_and(np.logical_and(u.eta_m_valid > 0, is_regular(u.eta_m)), is_enabled(u))
    samples = np.maximum(x.samples, 1.0)
    in_time = samples * p.sample_time <= p.bridging + ROUNDING * p.sample_time
    bridged = np.logical_and(
        np.logical_and(x.samples > 0, is_enabled(u)), np.logical_and(in_time, np.logical_not(arrived))
    )
    active = np.logical_or(arrived, bridged)

    eta = np.where(arrived, u.eta_m, x.eta)
    way = pose_difference(eta, x.eta)
    follows = np.logical_and(np.logical_and(arrived, x.samples > 0), _is_plausible(way, samples * p.sample_time, p))
    d = np.where(
        follows, _lead_filter(x.filter_difference, way, samples, p), np.where(bridged, x.filter_difference, 0.0)
    )

    velocity = np.where(p.use_measured_velocity > 0, jacobian(eta) @ u.nu_m, d / p.filter_time_constant)
    way = np.where(follows, way, 0.0)
    return Measured(
        eta=eta,
        e=np.where(active, dof * pose_difference(eta, u.eta_d), 0.0),
        eta_dot=np.where(active, dof * velocity, 0.0),
        e_dot=np.where(active, dof * (velocity - u.eta_dot_d), 0.0),
        e_dot_mean=np.where(np.logical_or(follows, bridged), dof * (way / p.sample_time - u.eta_dot_d), 0.0),
        eta_half_way=eta - way / 2,
        state={
            "eta": eta,
            "filter_difference": d,
            "samples": np.where(arrived, 1.0, np.where(bridged, x.samples + 1, 0.0)),
        },
    )


def is_enabled(u: SimpleNamespace) -> Any:
    """Tell whether the controller is not switched off."""
    return u.disable <= 0


def initial_state() -> Mapping[str, Any]:
    """Return the values of `STATES` before the first sample: a filter that waits for a measurement."""
    return {"eta": np.zeros(6), "filter_difference": np.zeros(6), "samples": 0.0}


def _is_plausible(way: Any, time: Any, p: SimpleNamespace) -> Any:
    """Tell whether a motion can lead a way, shape (6,), in a time in s."""
    largest = array([p.plausible_speed] * 3 + [p.plausible_turn_rate] * 3)
    return np.max(np.abs(way) - largest * time) <= 0


def _lead_filter(d: Any, way: Any, n: Any, p: SimpleNamespace) -> Any:
    """Return the state of the lead filter s / (T_f s + 1), shape (6,), n samples after it was d; eta' is state / T_f.

    The state is the pose less the low-passed pose. It moves with the way since the last measurement, so that wrapped
    angles need no unwrapping: d <- a^n d + (1 - a^n) / (n (1 - a)) way, a = exp(-T / T_f), the exact zero-order-hold
    form of a way in n equal steps.
    """
    ratio = -p.sample_time / p.filter_time_constant
    return np.exp(n * ratio) * d + np.expm1(n * ratio) / (n * np.expm1(ratio)) * way


PARAMETERS = (
    Signal("sample_time", "Time between samples", unit="s", start=SAMPLE_TIME, minimum=1e-6),
    Signal("filter_time_constant", "Time constant T_f of the lead filter", unit="s", start=0.1, minimum=1e-6),
    switch("use_measured_velocity", "Take the velocity from nu_m in place of the lead filter"),
    Signal("bridging", "Longest time since the last measurement that is bridged; 0: none", unit="s", minimum=0.0),
    Signal(
        "plausible_speed",
        "Speed in an axis above which a change of the measured position is a jump, no velocity",
        unit="m/s",
        start=10.0,
        minimum=1e-3,
    ),
    Signal(
        "plausible_turn_rate",
        "Rate above which a change of a measured angle is a jump, no velocity",
        unit="rad/s",
        start=20.0,
        minimum=1e-3,
    ),
)
STATES = (
    vector("eta", POSE, "Pose of the last valid measurement"),
    vector("filter_difference", POSE, "State of the lead filter"),
    Signal("samples", "Samples since the last measurement; 0: there is none to go on from"),
)
