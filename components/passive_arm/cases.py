"""Reference cases of the arm: what it measures of given poses."""

from typing import Any

import numpy as np

from ..cases import Case, varied
from .interface import COMPONENT

_NEAR = np.array([0.0, 0.3, 0.1, 0.0, 0.0, 0.2])
_IDEAL = {"encoder_counts": 0, "noise_std": 0.0}


def _moving(t: Any) -> Any:
    slow = np.sin(np.outer(t, [0.9, 0.7, 0.5, 0.6, 0.8, 0.4]))
    return _NEAR + slow * [0.2, 0.2, 0.2, 0.2, 0.3, 0.8]


CASES = (
    Case("noise", "Encoders and 5 mm of white noise, as by default", 300, lambda t: {"eta": _moving(t)}),
    Case("ideal", "Ideal encoders and no noise: the pose comes back", 300, lambda t: {"eta": _moving(t)}, _IDEAL),
    Case("encoders", "Encoders of 4096 counts", 300, lambda t: {"eta": _moving(t)}, {"noise_std": 0.0}),
    Case(
        "coloured_noise",
        "Noise of position and angle with a memory, another seed, and a bias",
        300,
        lambda t: {"eta": _moving(t)},
        {"noise_std_angle": 0.01, "noise_correlation_time": 0.5, "seed": 7, "bias.x": 0.01},
    ),
    Case(
        "out_of_reach",
        "The vehicle backs away until the arm is detached, and returns",
        400,
        lambda t: {"eta": _NEAR - np.outer(1.5 * np.sin(0.5 * t) ** 2, [1.0, 0, 0, 0, 0, 0])},
    ),
    Case(
        "pull",
        "The arm pulls like a spring, with a preload",
        200,
        lambda t: {"eta": _moving(t)},
        {"stiffness": 5.0, "preload.z": 2.0, **_IDEAL},
    ),
    Case(
        "late_and_lost",
        "Measurements that come four samples late, three in ten of them lost",
        300,
        lambda t: {"eta": _moving(t)},
        {"delay": 4, "dropout": 0.3},
    ),
    Case(
        "every_parameter",
        "No Real parameter at its start value but the sample time",
        300,
        lambda t: {"eta": _moving(t)},
        {**varied(COMPONENT, "sample_time"), "encoder_counts": 2048, "seed": 3},
    ),
)
