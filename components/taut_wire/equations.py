"""Geometry of the taut wire, its instruments and errors, and the winch that keeps its tension.

The wire runs straight from the fairlead at r_A on the vehicle to the attachment on the structure. What is read, shape
(6,), is its length, its azimuth about the body's z axis and its elevation above the body's xy plane, then the roll,
pitch and heading of the vehicle.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from .. import sensing
from ..frames import array, is_regular, rotation
from ..noise import gauss_markov


def wire_from(eta: Any, p: SimpleNamespace) -> Any:
    """Return the vector from the fairlead to the attachment in body axes, shape (3,), in m for a vehicle at eta."""
    return rotation(eta[3:6]).T @ (p.attachment - eta[0:3]) - p.r_A


def spherical(wire: Any) -> Any:
    """Return length in m, azimuth and elevation in rad, shape (3,), of a vector in body axes."""
    out = wire[0] ** 2 + wire[1] ** 2
    return array([np.sqrt(out + wire[2] ** 2), np.arctan2(wire[1], wire[0]), np.arctan2(wire[2], np.sqrt(out))])


def vector(length: Any, azimuth: Any, elevation: Any) -> Any:
    """Return the vector in body axes, shape (3,), with this length and direction: the inverse of `spherical`."""
    out = np.cos(elevation)
    return length * array([out * np.cos(azimuth), out * np.sin(azimuth), np.sin(elevation)])


def pose_from(reading: Any, p: SimpleNamespace) -> Any:
    """Return the pose eta, shape (6,), of the vehicle whose instruments read so (Hoang & Kreuzer 2007, section 1)."""
    wire = vector(reading[0], reading[1], reading[2])
    return np.concatenate([p.attachment - rotation(reading[3:6]) @ (p.r_A + wire), reading[3:6]])


def resolution(p: SimpleNamespace) -> Any:
    """Return the steps, shape (6,), in which the instruments read: m, then rad."""
    encoder = sensing.encoder_resolution(p.encoder_counts)
    return array([p.length_resolution, encoder, encoder] + [p.attitude_resolution] * 3)


def paid_out(x: SimpleNamespace, length: Any, p: SimpleNamespace) -> Any:
    """Return the length of wire in m that is paid out after a sample with the attachment `length` away.

    The winch pays out and hauls in at p.winch_rate at most, until the tension is the set one, from an empty drum to
    p.length_max. It begins at rest.
    """
    goal = length - p.winch_tension / p.winch_stiffness
    most = p.winch_rate * p.sample_time
    last = np.where(x.started > 0, x.paid, goal)
    return np.clip(last + np.clip(goal - last, -most, most), 0.0, p.length_max)


def sample(
    x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, w: Any
) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return state and outputs after measuring the true pose u.eta with the standard normal draws w, shape (11,)."""
    true = np.concatenate([spherical(wire_from(u.eta, p)), u.eta[3:6]])
    length, azimuth, elevation = true[0], true[1], true[2]
    in_length = np.logical_and(length >= p.length_min, length <= p.length_max)
    in_angle = np.logical_and(np.abs(azimuth) <= p.azimuth_max, np.abs(elevation) <= p.elevation_max)
    in_limits = np.logical_and(np.logical_and(in_length, in_angle), is_regular(u.eta))

    paid = paid_out(x, length, p)
    tension = p.winch_stiffness * np.maximum(length - paid, 0.0)
    taut = tension >= p.slack_tension

    started = x.started > 0
    deviation = np.concatenate([array([p.length_noise_std] + [p.angle_noise_std] * 2), p.attitude_noise_std])
    noise = gauss_markov(x.noise, started, w[0:6], deviation, p.noise_correlation_time, p.sample_time)
    drift = gauss_markov(x.drift, started, w[6:9], p.attitude_drift_std, p.attitude_drift_time, p.sample_time)
    error = noise + np.concatenate([p.wire_bias, p.attitude_bias + drift])
    reading = sensing.quantised(true + error, resolution(p))
    memory, measurement = sensing.handed_out(x, p, pose_from(reading, p), np.logical_and(in_limits, taut), w[9:11])

    state = {**memory, "noise": noise, "drift": drift, "paid": paid, "started": 1.0}
    outputs = {
        **measurement,
        "attached": in_limits,
        "taut": taut,
        "wire": reading[0:3],
        "attitude": reading[3:6],
        "reach": length,
        "tension": tension,
        "F_arm": rotation(u.eta[3:6]) @ vector(tension, azimuth, elevation),
    }
    return state, outputs


def initial_state(p: SimpleNamespace) -> Mapping[str, Any]:
    """Return the state before the first sample: nothing measured yet, and the winch at rest from the first one on."""
    return {**sensing.initial_state(), "noise": np.zeros(6), "drift": np.zeros(3), "paid": 0.0, "started": 0.0}
