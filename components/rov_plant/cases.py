"""Reference cases of the vehicle: how it moves under given thrusts."""

from typing import Any

import numpy as np

from ..cases import Case, varied
from .interface import COMPONENT

_FORWARD = np.array([1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0])
_UP = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0])
_TURN = np.array([-1.0, 1.0, -1.0, 1.0, 0.0, 0.0, 0.0, 0.0])


def _mixed(t: Any) -> Any:
    return np.outer(8 * np.sin(0.8 * t), _FORWARD) + np.outer(5 * np.cos(t), _UP) + np.outer(3 * np.sin(0.3 * t), _TURN)


CASES = (
    Case("surge", "Thrust ahead from 1 s on", 300, lambda t: {"u": np.where(t[:, None] < 1.0, 0.0, 10.0 * _FORWARD)}),
    Case("mixed", "Ahead, up and around, in four degrees of freedom", 300, lambda t: {"u": _mixed(t)}),
    Case(
        "six_degrees",
        "The same, free in roll and pitch, with the centre of gravity off",
        300,
        lambda t: {"u": _mixed(t)},
        {"lock_roll_pitch": 0, "r_G.x": 0.02, "eta_0.phi": 0.3, "nu_0.p": 0.2},
    ),
    Case(
        "forces",
        "Buoyancy, umbilical, arm and a current",
        300,
        lambda t: {
            "F_arm": np.outer(np.sin(t), [2.0, -1.5, 1.0]),
            "F_umbilical": np.outer(np.cos(t), [1.0, 2.0, -1.5]),
            "current": [0.1, -0.05, 0.03],
        },
        {"dB": 10.0, "F_C.y": -5.0, "F_A.x": 3.0},
    ),
    Case(
        "limited_thrusters",
        "Thrusters with a lag, a limit and a dead band, one of them lost",
        300,
        lambda t: {"u": 2.0 * _mixed(t)},
        {"thruster_time_constant": 0.3, "thrust_max": 6.0, "thruster_dead_band": 2.0, "thruster[2].enabled": 0},
    ),
    Case(
        "failing_thrusters",
        "Each thruster loses another share of its force after 3 s, the last ones all of it and more",
        300,
        lambda t: {"u": _mixed(t), "thrust_loss": np.outer(t > 3.0, 0.2 * np.arange(1, 9))},
    ),
    Case(
        "every_parameter",
        "No Real parameter at its start value but the thrusters' directions; free in roll and pitch",
        300,
        lambda t: {
            "u": 4.0 * np.sin(np.outer(t, 0.3 + 0.1 * np.arange(8))),
            "F_arm": np.outer(np.sin(t), [2.0, -1.5, 1.0]),
        },
        {**varied(COMPONENT, "thruster_d"), "lock_roll_pitch": 0, "thrust_max": 3.0},
    ),
)
