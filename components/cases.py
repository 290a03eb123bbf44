"""Reference cases: runs of a component alone, by which another tool's import of it is judged."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .instance import Instance
from .interface import SAMPLE_TIME, Component


@dataclass(frozen=True)
class Case:
    """A run of a component from its start values, with inputs that are set at the begin of each step.

    Parameters
    ----------
    name, description : what it shows.
    steps : number of communication steps.
    inputs : ``t -> {input key: value}``, of shape (len(t), *shape of the input); the others keep their start.
    parameters : values by scalar name.
    """

    name: str
    description: str
    steps: int
    inputs: Callable[[NDArray[np.float64]], Mapping[str, Any]]
    parameters: Mapping[str, float] = field(default_factory=dict)

    def times(self) -> NDArray[np.float64]:
        """Return the communication points, shape (steps + 1,), in s."""
        return np.arange(self.steps + 1, dtype=np.float64) * np.float64(SAMPLE_TIME)

    def input_values(self, component: Component) -> NDArray[np.float64]:
        """Return the inputs at each of `times`, shape (steps + 1, number of scalar inputs), in declared order."""
        t = self.times()
        given = self.inputs(t)
        columns = [
            np.broadcast_to(given[signal.key], (len(t), *signal.shape)).reshape(len(t), -1)
            if signal.key in given
            else np.broadcast_to(signal.elements(signal.start), (len(t), signal.size))
            for signal in component.inputs
        ]
        return np.concatenate(columns, axis=1).astype(float)

    def output_values(self, component: Component) -> NDArray[np.float64]:
        """Return the outputs at each of `times`, shape (steps + 1, number of scalar outputs), in declared order."""
        instance, values = Instance(component), self.input_values(component)
        inputs = range(component.u.size)
        outputs = range(component.u.size, component.u.size + component.y.size)
        first = component.u.size + component.y.size
        places = [first + component.p.names.index(name) for name in self.parameters]
        instance.set(places, list(self.parameters.values()))
        instance.set(inputs, values[0].tolist())
        instance.enter_initialization()
        instance.exit_initialization()
        rows = [instance.get(outputs)]
        for n in range(self.steps):
            instance.set(inputs, values[n].tolist())
            instance.do_step(n * SAMPLE_TIME, SAMPLE_TIME)
            rows.append(instance.get(outputs))
        return np.array(rows)


def varied(component: Component, *kept: str) -> dict[str, float]:
    """Return a value other than the start value for each Real parameter, but for the signals that are kept."""
    values: dict[str, float] = {}
    for signal in component.parameters:
        if signal.type == "Real" and signal.key not in kept:
            limits = signal.elements(signal.minimum), signal.elements(signal.maximum)
            start = signal.elements(signal.start)
            other = np.clip(np.where(start == 0, 0.01 + 0.001 * np.arange(signal.size), 1.03 * start), *limits)
            values |= dict(zip(signal.names, other.tolist(), strict=True))
    return values


def cases_of(component: Component) -> tuple[Case, ...]:
    """Return the cases in the component's folder."""
    found: tuple[Case, ...] = import_module(f"{__package__}.{component.name}.cases").CASES
    return found
