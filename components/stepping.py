"""How a component gets from one communication point to the next: flat vectors in, flat vectors out, nothing kept."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .interface import Component, Continuous, Sampled
from .noise import standard_normal

Vector = NDArray[np.float64]

SINGLE = 2.0**-23
"""Relative spacing of numbers in single precision, in which some hosts keep time."""

STEP_TOLERANCE = SINGLE
"""Relative excess over whole internal steps that is rounding, that of a step in single precision too."""

SAMPLE_TOLERANCE = 1e-6
"""Share of the period by which the end of a step may pass a sample that belongs to the next step."""


class Result(NamedTuple):
    """State and outputs after a step, and the number of samples taken since the start."""

    x: Vector
    y: Vector
    samples: int


def leeway(time: float, step: float) -> float:
    """Return by how much a time may be off, in s, where a step begins or ends that a host rounds to single precision.

    It is two spacings of such numbers, but at most a quarter of the step, which no step beside it comes near. It is 0
    where they lie further apart than that: a host cannot keep its steps apart by them, and must have better ones.
    """
    return min(2 * SINGLE * abs(time), step / 4) if SINGLE * abs(time) <= step / 4 else 0.0


def initial(component: Component, u: Vector, p: Vector) -> tuple[Vector, Vector]:
    """Return the initial state, and the outputs that a run with these inputs would start with."""
    x = np.asarray(component.x.pack(component.initial_state(component.p.unpack(p))), dtype=float)
    if isinstance(component, Sampled):
        return x, _sample(component, x, u, p, 0)[1]
    return x, _outputs(component, x, u, p)


def advance(
    component: Component, before: Result, u: Vector, p: Vector, start: float, time: float, step: float
) -> Result:
    """Return the result of a step from `time` to `time + step` of a run that began at `start`, in s."""
    if isinstance(component, Sampled):
        return _take_samples(component, before, u, p, start, time, step)
    return _integrate(component, before, u, p, step)


def internal_steps(component: Component, before: Result, p: Vector, start: float, time: float, step: float) -> float:
    """Return about how many internal steps or samples `advance` takes."""
    parameters = component.p.unpack(p)
    if isinstance(component, Sampled):
        return (time + step - start) / float(getattr(parameters, component.period)) - before.samples
    assert isinstance(component, Continuous)
    return step / float(getattr(parameters, component.max_step))


def _take_samples(
    component: Sampled, before: Result, u: Vector, p: Vector, start: float, time: float, step: float
) -> Result:
    """Take all samples due before the end of a step; one that is due at its end belongs to the next step."""
    period = float(getattr(component.p.unpack(p), component.period))
    end = time + step
    rounding = max(SAMPLE_TOLERANCE * period + 4 * np.spacing(abs(end)), leeway(end - start, min(step, period)))
    x, y, samples = before
    while samples * period < end - start - rounding:
        x, y = _sample(component, x, u, p, samples)
        samples += 1
    return Result(x, y, samples)


def _sample(component: Sampled, x: Vector, u: Vector, p: Vector, index: int) -> tuple[Vector, Vector]:
    parameters = component.p.unpack(p)
    draws = np.zeros(0)
    if component.draws:
        draws = standard_normal(int(getattr(parameters, component.seed)), index, component.draws)
    state, outputs = component.sample(component.x.unpack(x), component.u.unpack(u), parameters, draws)
    return np.asarray(component.x.pack(state), dtype=float), np.asarray(component.y.pack(outputs), dtype=float)


def _integrate(component: Component, before: Result, u: Vector, p: Vector, step: float) -> Result:
    """Integrate in internal steps of the longest allowed length, the last one shortened."""
    assert isinstance(component, Continuous)
    inputs, parameters = component.u.unpack(u), component.p.unpack(p)
    longest = float(getattr(parameters, component.max_step))
    whole = int(np.ceil(step / longest * (1 - STEP_TOLERANCE))) - 1
    x = before.x
    for i in range(whole + 1):
        h = longest if i < whole else step - whole * longest
        x = np.asarray(component.x.pack(component.advance(component.x.unpack(x), inputs, parameters, h)), dtype=float)
    return Result(x, _outputs(component, x, u, p), before.samples)


def _outputs(component: Component, x: Vector, u: Vector, p: Vector) -> Vector:
    assert isinstance(component, Continuous)
    outputs = component.outputs_of(component.x.unpack(x), component.u.unpack(u), component.p.unpack(p))
    return np.asarray(component.y.pack(outputs), dtype=float)
