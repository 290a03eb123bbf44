"""Reference cases of a controller: what it does in open loop with given poses."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from .cases import Case, varied
from .interface import Component
from .noise import standard_normal


def _pose(t: Any, **axes: Any) -> Any:
    """Return poses, shape (len(t), 6), that are zero but for some axes."""
    return np.stack(
        [np.broadcast_to(axes.get(axis, 0.0), t.shape) for axis in ("x", "y", "z", "phi", "theta", "psi")], 1
    )


def _swaying(t: Any) -> Any:
    return _pose(t, x=0.1 * np.sin(t), y=0.2 * np.cos(0.7 * t), z=0.05 * np.sin(2 * t), psi=0.3 * np.sin(0.5 * t))


def turning(t: Any) -> Any:
    """Return poses that move in all six axes."""
    return 0.2 * np.sin(np.outer(t, [0.9, 0.8, 0.7, 1.1, 1.2, 0.6]) + np.arange(6))


def _noisy(t: Any) -> Any:
    noise = np.array([standard_normal(1, k, 6) for k in range(len(t))])
    return _swaying(t) + noise * ([0.005] * 3 + [0.002] * 3)


def controller_cases(
    component: Component, part: str, without: Mapping[str, float], lively: Mapping[str, float]
) -> tuple[Case, ...]:
    """Return the cases of a controller.

    part is what sets the law apart, without the parameters that take it off, lively those that put it to work.
    """
    return (
        Case(
            "step_response",
            "The vehicle rests; the set-point steps in x, z and psi after 1 s",
            200,
            lambda t: {"eta_m_valid": 1.0, "eta_d": np.where(t[:, None] < 1.0, 0.0, [0.5, 0.0, -0.2, 0.0, 0.0, 1.0])},
        ),
        Case(
            "noise",
            "The vehicle sways; the measured pose has 5 mm of noise",
            400,
            lambda t: {"eta_m_valid": 1.0, "eta_m": _noisy(t), "eta_d": [0.2, 0.1, 0.0, 0.0, 0.0, 0.1]},
        ),
        Case(
            "six_degrees",
            "All six degrees of freedom, a centre of gravity that is off, the yaw through half a turn",
            300,
            lambda t: {
                "eta_m_valid": 1.0,
                "eta_m": _pose(
                    t, x=0.3, phi=0.2 * np.sin(t), theta=0.3 * np.cos(t), psi=np.angle(np.exp(1j * (2.0 + 0.4 * t)))
                ),
                "eta_d": [0.0, 0.0, 0.0, 0.0, 0.0, 3.0],
            },
            {"control_roll_pitch": 1, "r_G.x": 0.02, **lively},
        ),
        Case(
            "loss_of_measurement",
            "The measurement is lost from 2 s to 4 s, and the pose has jumped when it returns",
            250,
            lambda t: {
                "eta_m_valid": ((t < 2.0) | (t >= 4.0)).astype(float),
                "eta_m": _swaying(t) + np.where(t[:, None] < 4.0, 0.0, [0.3, 0.0, 0.0, 0.0, 0.0, 0.5]),
            },
        ),
        Case(
            "bridged_gaps",
            "Samples are lost, by threes and eight together, and bridged; the set-point moves, the pose jumps at 4 s",
            200,
            lambda t: {
                "eta_m_valid": ~((np.floor(t / 0.09 + 0.01) % 3 == 1) | ((t > 2.5) & (t < 2.74))),
                "eta_m": _swaying(t) + np.where(t[:, None] < 4.0, 0.0, [0.5, 0.0, 0.0, 0.0, 0.0, 0.0]),
                "eta_d": 0.1 * np.sin(np.outer(t, np.arange(1, 7))),
                "eta_dot_d": 0.1 * np.arange(1, 7) * np.cos(np.outer(t, np.arange(1, 7))),
            },
            {"bridging": 0.3, **({"projection": 1} if "projection" in component.p.names else {})},
        ),
        Case(
            "saturation",
            "Thrusters of 8 N and a set-point far away, near from 4 s on",
            300,
            lambda t: {
                "eta_m_valid": 1.0,
                "eta_m": _swaying(t),
                "eta_d": np.where(t[:, None] < 4.0, [1.0, 0, 1.0, 0, 0, 0], 0.0),
            },
            {"thrust_max": 8.0},
        ),
        Case(
            "disable",
            "Switched off from 2 s to 4 s",
            250,
            lambda t: {"eta_m_valid": 1.0, "eta_m": _swaying(t), "disable": ((t >= 2.0) & (t < 4.0)).astype(float)},
        ),
        Case(
            "singular_attitude",
            "The pitch angle goes through a quarter of a turn, where a measurement is not used",
            300,
            lambda t: {"eta_m_valid": 1.0, "eta_m": _pose(t, x=0.2, theta=0.45 * t)},
            {"control_roll_pitch": 1},
        ),
        Case(
            "measured_velocity",
            f"The velocity is measured in all six axes, and the law does without {part}",
            200,
            lambda t: {
                "eta_m_valid": 1.0,
                "eta_m": turning(t),
                "nu_m": 0.1 * turning(t + 1.0),
                "eta_d": turning(0.5 * t),
            },
            {"use_measured_velocity": 1, "control_roll_pitch": 1, **without},
        ),
        Case(
            "every_parameter",
            "No Real parameter at its start value but the sample time and the thrusters' directions",
            300,
            lambda t: {"eta_m_valid": 1.0, "eta_m": turning(t), "eta_d": turning(0.5 * t)},
            {**varied(component, "sample_time", "thruster_d"), "control_roll_pitch": 1, "thrust_max": 40.0},
        ),
    )
