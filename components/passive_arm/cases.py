"""Reference cases of the arm: what it measures of given poses."""

import numpy as np

from ..cases import Case
from ..sensing_cases import NEAR, moving, sensor_cases
from .interface import COMPONENT

_IDEAL = {"encoder_counts": 0, "noise_std": 0.0}


CASES = (
    Case("noise", "Encoders and 5 mm of white noise, as by default", 300, lambda t: {"eta": moving(t)}),
    Case("ideal", "Ideal encoders and no noise: the pose comes back", 300, lambda t: {"eta": moving(t)}, _IDEAL),
    Case("encoders", "Encoders of 4096 counts", 300, lambda t: {"eta": moving(t)}, {"noise_std": 0.0}),
    Case(
        "coloured_noise",
        "Noise of position and angle with a memory, another seed, and a bias",
        300,
        lambda t: {"eta": moving(t)},
        {"noise_std_angle": 0.01, "noise_correlation_time": 0.5, "seed": 7, "bias.x": 0.01},
    ),
    Case(
        "out_of_reach",
        "The vehicle backs away until the arm is detached, and returns",
        400,
        lambda t: {"eta": NEAR - np.outer(1.5 * np.sin(0.5 * t) ** 2, [1.0, 0, 0, 0, 0, 0])},
    ),
    Case(
        "pull",
        "The arm pulls like a spring, with a preload",
        200,
        lambda t: {"eta": moving(t)},
        {"stiffness": 5.0, "preload.z": 2.0, **_IDEAL},
    ),
    *sensor_cases(COMPONENT),
)
