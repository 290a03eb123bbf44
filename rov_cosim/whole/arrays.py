"""The variables of a system in FMI 3.0: the signals of its elements as arrays."""

from collections.abc import Sequence
from copy import copy
from math import prod
from typing import NamedTuple

from fmpy.model_description import ModelVariable

from ..components.interface import Sampled, Signal
from ..exporters import fmi3_description
from ..exporters.build import components
from .layout import Layout, Shown


class _Owned(NamedTuple):
    """A signal of an element, with the names of its elements in the system."""

    element: str
    signal: Signal
    sampled: bool

    @property
    def names(self) -> list[str]:
        return [f"{self.element}.{name}" for name in self.signal.names]


def arrays(layout: Layout) -> list[ModelVariable]:
    """Return the variables of a system whose elements are components of this project, as FMI 3.0 has them.

    A signal is one variable if all of it is shown, else each of its elements is one. A value reference is that of the
    first element in FMI 2.0.
    """
    signals = _by_first_name(layout)
    variables: list[ModelVariable] = []
    rest = layout.variables
    while rest:
        found = signals.get(rest[0].variable.name)
        shown = rest[: found.signal.size] if found else rest[:1]
        if found and [one.variable.name for one in shown] == found.names:
            variables.append(_array(found, shown))
        else:
            variables.append(_scalar(rest[0].variable))
            shown = rest[:1]
        rest = rest[len(shown) :]
    return variables


def terminals(layout: Layout, variables: Sequence[ModelVariable]) -> dict[str, dict[str, str]]:
    """Return the terminals that the `arrays` of a system make, those of each element apart."""
    shown = {variable.name for variable in variables}
    made: dict[str, dict[str, str]] = {}
    for element in layout.wiring.elements:
        component = components()[element.description.modelName]
        ports = [s for s in component.inputs + component.outputs if f"{element.name}.{s.name}" in shown]
        made |= fmi3_description.terminals(ports, element.name)
    return made


def size(variable: ModelVariable) -> int:
    """Return the number of elements of a variable."""
    return prod(int(dimension.start) for dimension in variable.dimensions)


def _by_first_name(layout: Layout) -> dict[str, _Owned]:
    found = {}
    for element in layout.wiring.elements:
        component = components()[element.description.modelName]
        for signal in component.inputs + component.outputs + component.parameters:
            owned = _Owned(element.name, signal, isinstance(component, Sampled))
            found[owned.names[0]] = owned
    return found


def _array(owned: _Owned, shown: list[Shown]) -> ModelVariable:
    first = shown[0].variable
    variable = fmi3_description.array(owned.signal, first.causality, first.valueReference, owned.sampled)
    variable.name = f"{owned.element}.{owned.signal.name}"
    if first.causality != "output":
        variable.start = " ".join(one.variable.start for one in shown)
    return variable


def _scalar(declared: ModelVariable) -> ModelVariable:
    variable = copy(declared)
    variable.type = fmi3_description.TYPES[declared.type]
    variable.canHandleMultipleSetPerTimeInstant = None
    return variable
