"""The steps that an FMU takes in a system: the system's own, unless its step is fixed."""

from typing import NamedTuple

from .wiring import Element

_TOLERANCE = 1e-6
"""Of the ratio of two steps, within which it is a whole number."""


class Rate(NamedTuple):
    """Equal steps that an FMU takes in one of the system's, or of how many of these it takes one; one of them is 1."""

    parts: int = 1
    every: int = 1


def rate_of(element: Element, step: float) -> Rate | None:
    """Return the rate of an element in a system that steps by `step` in s; None if its fixed step does not fit.

    The step is fixed by canHandleVariableCommunicationStepSize being false and the stepSize of DefaultExperiment.
    """
    fixed = fixed_step(element)
    if fixed is None:
        return Rate()
    parts, every = step / fixed, fixed / step
    if round(parts) >= 1 and abs(parts - round(parts)) <= _TOLERANCE * parts:
        return Rate(parts=round(parts))
    if round(every) >= 1 and abs(every - round(every)) <= _TOLERANCE * every:
        return Rate(every=round(every))
    return None


def fixed_step(element: Element) -> float | None:
    """Return the only step in s that the FMU of an element takes; None if it takes any, or does not say which."""
    if element.description.coSimulation.canHandleVariableCommunicationStepSize:
        return None
    return named_step(element)


def named_step(element: Element) -> float | None:
    """Return the step in s that the FMU of an element names; None if it names none, or what is none."""
    experiment = element.description.defaultExperiment
    try:
        step = float(experiment.stepSize or 0) if experiment else 0.0
    except ValueError:  # a formal fault, of which is told where the FMU is read
        return None
    return step if 0 < step < float("inf") else None
