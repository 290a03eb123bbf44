"""Reference cases of the taut wire: what it measures of given poses, and how it pulls."""

from typing import Any

import numpy as np

from ..cases import Case
from ..sensing_cases import NEAR, moving, sensor_cases
from .interface import COMPONENT

_ANGLES = ("phi", "theta", "psi")
IDEAL = {
    **dict.fromkeys(("length_resolution", "encoder_counts", "attitude_resolution"), 0),
    **dict.fromkeys(("length_noise_std", "angle_noise_std"), 0.0),
    **{f"attitude_{error}_std.{axis}": 0.0 for error in ("noise", "drift") for axis in _ANGLES},
}


def _away(t: Any) -> Any:
    """Return poses of a vehicle that backs away from the structure by 4 m and returns, at 2 m/s at most."""
    return NEAR - np.outer(4.0 * np.sin(0.5 * t) ** 2, [1.0, 0, 0, 0, 0, 0])


CASES = (
    Case("errors", "Resolution, noise and drift, as by default", 300, lambda t: {"eta": moving(t)}),
    Case("ideal", "Ideal instruments: the pose comes back", 300, lambda t: {"eta": moving(t)}, IDEAL),
    Case(
        "resolution",
        "Instruments that read in steps, without noise and drift",
        300,
        lambda t: {"eta": moving(t)},
        {**IDEAL, "length_resolution": 0.002, "encoder_counts": 4096, "attitude_resolution": 0.002},
    ),
    Case(
        "coloured_noise",
        "Noise with a memory, a fast drift, another seed, and constant errors",
        300,
        lambda t: {"eta": moving(t)},
        {
            **{"noise_correlation_time": 0.5, "attitude_drift_time": 2.0, "seed": 7},
            **{"wire_bias.length": 0.01, "attitude_bias.psi": 0.02},
        },
    ),
    Case(
        "beyond_its_end",
        "The vehicle backs away to the end of the wire, where the tension rises, and returns",
        400,
        lambda t: {"eta": _away(t)},
        {"winch_rate": 3.0},
    ),
    Case(
        "slow_winch",
        "The same with a winch that is slower than the vehicle: the wire is overloaded, then slack",
        400,
        lambda t: {"eta": _away(t)},
        {**IDEAL, "length_max": 6.0, "winch_rate": 1.7},
    ),
    Case(
        "narrow_gimbal",
        "A gimbal that turns by 74 deg either way, and rises by 46 deg",
        300,
        lambda t: {"eta": moving(t)},
        {"azimuth_max": 1.3, "elevation_max": 0.8},
    ),
    *sensor_cases(COMPONENT),
)
