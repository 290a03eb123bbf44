"""What every sensor of the pose has: resolution, samples that are lost or come late, and the signals for these."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from .frames import wrap
from .interface import POSE, POSE_UNITS, SAMPLE_TIME, Signal, count, indexed, switch, vector

LONGEST_DELAY = 10
"""Most samples by which a measurement can be late."""


def quantised(value: Any, resolution: Any) -> Any:
    """Return a value rounded to whole multiples of a resolution in its unit; unchanged where that is 0."""
    ideal = resolution <= 0
    step = np.where(ideal, 1.0, resolution)
    return np.where(ideal, value, step * np.floor(value / step + 0.5))


def encoder_resolution(counts: Any) -> Any:
    """Return the resolution in rad of an encoder of so many counts a turn; 0, which is ideal, for 0 counts."""
    ideal = counts <= 0
    return np.where(ideal, 0.0, 2 * np.pi / np.where(ideal, 1.0, counts))


def delayed(history: Any, delay: Any) -> Any:
    """Return row `delay` of the history, shape (LONGEST_DELAY + 1, n), whose first row is the latest."""
    return np.where(np.abs(np.arange(LONGEST_DELAY + 1) - delay) < 0.5, 1.0, 0.0) @ history


def handed_out(
    x: SimpleNamespace, p: SimpleNamespace, pose: Any, measured: Any, w: Any
) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return the values of `STATES` and of `measurement`'s outputs after a pose, shape (6,), was measured, or was not.

    The share p.dropout of the samples is lost by the standard normal draws w, shape (2,).
    """
    # By Box and Muller's transform the exponential of two normal draws is uniform in (0, 1).
    arrives = np.logical_and(measured, np.exp(-(w[0] ** 2 + w[1] ** 2) / 2) >= p.dropout)
    latest = np.where(arrives, np.concatenate([pose[0:3], wrap(pose[3:6])]), x.eta_m[0])
    eta_m = np.concatenate([np.reshape(latest, (1, 6)), x.eta_m])
    valid = np.concatenate([np.reshape(np.where(arrives, 1.0, 0.0), (1,)), x.valid])
    outputs = {"eta_m": delayed(eta_m, p.delay), "eta_m_valid": delayed(valid, p.delay)}
    return {"eta_m": eta_m[:-1], "valid": valid[:-1]}, outputs


def initial_state() -> Mapping[str, Any]:
    """Return the values of `STATES` before the first sample: nothing measured yet."""
    return {"eta_m": np.zeros((LONGEST_DELAY, 6)), "valid": np.zeros(LONGEST_DELAY)}


def measurement(valid_from: tuple[str, ...], pose_from: tuple[str, ...]) -> tuple[Signal, Signal]:
    """Return the outputs eta_m and eta_m_valid.

    Parameters
    ----------
    valid_from : keys of the inputs and parameters on which it depends whether there is a measurement.
    pose_from : keys of those on which its value depends besides.
    """
    valid_from = (*valid_from, "dropout", "delay", "seed")
    return (
        vector(
            "eta_m",
            POSE,
            "Measured pose of the vehicle in the earth frame; holds its last value while it is not valid",
            unit=POSE_UNITS,
            initially_from=(*valid_from, *pose_from),
        ),
        switch("eta_m_valid", "Whether eta_m is a measurement", initially_from=valid_from),
    )


TRUE_POSE = vector("eta", POSE, "True pose of the vehicle in the earth frame", unit=POSE_UNITS)
PARAMETERS = (
    Signal("dropout", "Share of the samples that are lost", start=0.0, minimum=0.0, maximum=1.0),
    Signal(
        "delay",
        "Samples by which eta_m and eta_m_valid are late",
        type="Integer",
        start=0,
        minimum=0,
        maximum=LONGEST_DELAY,
    ),
    Signal("seed", "Selects noise and lost samples; runs with equal seeds repeat", type="Integer", start=1, minimum=0),
    Signal("sample_time", "Time between samples", unit="s", start=SAMPLE_TIME, minimum=1e-6),
)
STATES = (
    Signal(
        "eta_m",
        "Last valid measurement as of each past sample",
        pattern="eta_m[{}].{}",
        axes=(count(LONGEST_DELAY), POSE),
    ),
    indexed("valid", LONGEST_DELAY, "Whether the past sample is a measurement"),
)
