"""Many copies of a plant side by side, each released in a state of its own, and how each begins to move."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...components.interface import POSE, VELOCITY, WRENCH
from ...ssp.values import Value
from ...ssp.wiring import Element, Wiring
from ..runs import simulated
from ..settings import Settings
from .newton import Array, cross, displacement

STEP, STEPS, DEGREE = 0.002, 10, 4
"""Step in s, their number, and the degree of the polynomial in time that goes through the pose."""


@dataclass(frozen=True)
class Release:
    """A state in which a plant is let go, shape (6,) each, and values of its inputs and parameters by name."""

    eta: Array
    nu: Array
    values: Mapping[str, float]


class Motion(NamedTuple):
    """How a plant begins to move, in body axes, shape (6,) each: velocity and acceleration by its pose; its outputs."""

    velocity: Array
    acceleration: Array
    nu: Array
    tau: Array
    disturbance: Array


def begun(plant: Element, releases: Sequence[Release], settings: Settings) -> list[Motion] | None:
    """Return how a plant moves after each release; None if the run failed.

    Raises
    ------
    WiringError : it takes no copies, or not these values.
    """
    elements = []
    for i, release in enumerate(releases):
        values: dict[str, Value] = {
            name: bool(value) if plant.variables[name].type == "Boolean" else value
            for name, value in release.values.items()
        }
        values |= {f"eta_0.{axis}": value for axis, value in zip(POSE, release.eta.tolist(), strict=True)}
        values |= {f"nu_0.{axis}": value for axis, value in zip(VELOCITY, release.nu.tolist(), strict=True)}
        elements.append(replace(plant, name=f"{i}", start_values={**plant.start_values, **values}))
    wiring = Wiring(plant.name, tuple(elements), (), STEPS * STEP, STEP)
    plain = replace(settings, start_time=None, stop_time=None, step=None, output_interval=None, input=None)
    done = simulated(wiring, plain, progress=lambda steps: steps)
    if done.failure:
        return None

    def columns(i: int, group: str, axes: Sequence[str]) -> Array:
        return np.stack([done.results[f"{i}.{group}.{axis}"] for axis in axes], axis=1)

    motions = []
    t = done.results["time"][1:, None]
    powers = np.linalg.pinv(t ** np.arange(1, DEGREE + 1))
    for i, release in enumerate(releases):
        way = np.stack([displacement(eta, release.eta) for eta in columns(i, "eta", POSE)[1:]])
        rate, half = (powers @ way)[:2]
        turning = np.concatenate([cross(rate[3:], rate[:3]), np.zeros(3)])
        outputs = (("nu", VELOCITY), ("tau", WRENCH), ("disturbance", WRENCH))
        motions.append(Motion(rate, 2 * half - turning, *(columns(i, name, axes)[0] for name, axes in outputs)))
    return motions
