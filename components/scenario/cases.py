"""Reference cases of the scenario: its signals one by one."""

from typing import Any

import numpy as np

from ..cases import Case, varied
from .interface import COMPONENT


def _wandering(t: Any) -> Any:
    return {"set_point": 0.1 * np.sin(np.outer(t, np.arange(1, 7)))}


CASES = (
    Case("set_point", "A set-point that is handed on", 200, _wandering),
    Case(
        "current",
        "A current that varies slowly",
        300,
        lambda t: {},
        {
            "current_mean.x": 0.2,
            "current_std.x": 0.05,
            "current_std.y": 0.05,
            "current_correlation_time": 3.0,
            "seed": 5,
        },
    ),
    Case(
        "pulls",
        "Two pulls of the umbilical, the second one to the end",
        300,
        lambda t: {},
        {"pull[1].F.x": 5.0, "pull[1].begin": 1.5, "pull[1].duration": 3.0, "pull[2].F.z": -2.0, "pull[2].begin": 4.0},
    ),
    Case(
        "moving_set_point",
        "A step after 2 s, and a slow sine",
        400,
        _wandering,
        {"step.x": 0.3, "step.psi": 1.0, "step_begin": 2.0, "motion.y": 0.2, "motion_period": 10.0},
    ),
    Case(
        "every_parameter",
        "No Real parameter at its start value but the sample time",
        300,
        _wandering,
        {**varied(COMPONENT, "sample_time"), "seed": 3},
    ),
)
