"""Time signals of a scenario: current, pulls of the umbilical, thrusters that fail, set-points that step and sway."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..noise import gauss_markov


def is_on(t: Any, begin: Any, duration: Any, sample_time: Any) -> Any:
    """Tell whether t is between the samples nearest to begin and begin + duration; a duration of 0 has no end."""
    since = t - begin + sample_time / 2
    return np.logical_and(since >= 0, np.logical_or(duration <= 0, since < duration))


def sample(
    x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, w: Any
) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return state and outputs at the time x.samples * sample_time, with the standard normal draws w, shape (3,)."""
    t = x.samples * p.sample_time
    variation = gauss_markov(x.variation, x.samples > 0, w, p.current_std, p.current_correlation_time, p.sample_time)
    risen = np.where(p.pull_rise > 0, (t - p.pull_begin) / np.where(p.pull_rise > 0, p.pull_rise, 1.0), 1.0)
    pulling = np.where(is_on(t, p.pull_begin, p.pull_duration, p.sample_time), np.clip(risen, 0.0, 1.0), 0.0)
    failed = np.where(is_on(t, p.thrust_loss_begin, 0.0, p.sample_time), 1.0, 0.0)
    stepped = np.where(is_on(t, p.step_begin, 0.0, p.sample_time), 1.0, 0.0)
    angle = 2 * np.pi * t / p.motion_period
    state = {"samples": x.samples + 1, "variation": variation}
    outputs = {
        "current": p.current_mean + variation,
        "F_umbilical": pulling @ p.pull_F,
        "thrust_loss": failed * p.thrust_loss,
        "eta_d": u.set_point + stepped * p.step + np.sin(angle) * p.motion,
        "eta_dot_d": 2 * np.pi / p.motion_period * np.cos(angle) * p.motion,
    }
    return state, outputs


def initial_state(p: SimpleNamespace) -> Mapping[str, Any]:
    """Return the state before the first sample."""
    return {"samples": 0.0, "variation": np.zeros(3)}
