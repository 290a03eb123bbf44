"""Reference cases of a sensor of the pose: what it measures of given poses, whatever it measures by."""

from typing import Any

import numpy as np

from .cases import Case, varied
from .interface import Component

NEAR = np.array([0.0, 0.3, 0.1, 0.0, 0.0, 0.2])
"""A pose near the structure, in reach of each sensor."""


def moving(t: Any) -> Any:
    """Return poses that move in all six axes, in reach."""
    slow = np.sin(np.outer(t, [0.9, 0.7, 0.5, 0.6, 0.8, 0.4]))
    return NEAR + slow * [0.2, 0.2, 0.2, 0.2, 0.3, 0.8]


def sensor_cases(component: Component) -> tuple[Case, ...]:
    """Return the cases that every sensor has."""
    return (
        Case(
            "late_and_lost",
            "Measurements that come four samples late, three in ten of them lost",
            300,
            lambda t: {"eta": moving(t)},
            {"delay": 4, "dropout": 0.3},
        ),
        Case(
            "every_parameter",
            "No Real parameter at its start value but the sample time",
            300,
            lambda t: {"eta": moving(t)},
            {**varied(component, "sample_time"), "encoder_counts": 2048, "seed": 3},
        ),
    )
