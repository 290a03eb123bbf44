"""Does an FMU behave as the reference? Replays reference runs and says, signal by signal, where it first departs."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..components.interface import SAMPLE_TIME
from ..errors import UserError
from ..exporters.model_description import literal
from ..master.apart import simulate_apart
from ..master.simulation import SimulationError, simulate
from ..ssp.places import Place
from ..ssp.values import Value, parse
from ..ssp.wiring import Element, End, Wiring, WiringError
from ..study.settings import Settings
from .reference import TOLERANCE, Reference

Signals = dict[str, NDArray[np.float64]]
LEAST = 1e-3
"""Value of a signal in its unit below which it is judged as if it were as large."""


class CheckError(UserError):
    """The FMU cannot be checked at all; the message tells why."""


class RunError(CheckError):
    """A reference run cannot be replayed to its end; others may. `outputs` has what it gave until then."""

    def __init__(self, case: str, reason: str, outputs: Signals | None = None) -> None:
        super().__init__(f"{case}: {reason}")
        self.reason, self.outputs = reason, outputs or {}


@dataclass(frozen=True)
class Departure:
    """Where a signal first departs from a reference run, and what would explain the whole of it, if anything does."""

    case: str
    time: float
    value: float
    expected: float
    explanation: str

    def __str__(self) -> str:
        departure = f"departs in {self.case} at {self.time:g} s: {self.value:.6g} instead of {self.expected:.6g}"
        return f"{departure}; {self.explanation}" if self.explanation else departure


def replay(element: Element, reference: Reference, places: Mapping[str, Place]) -> Signals:
    """Return the outputs of an FMU over a reference run, by our names and in our units.

    Parameters
    ----------
    places : the FMU's variables by ours; outputs without one are left out, and inputs are not set.

    Raises
    ------
    RunError : it has not a parameter of the run, cannot be loaded, or fails; the message has what it logged.
    """
    component, case = reference.component, reference.case
    begun = replace(element, start_values=start_values(element, reference, places))
    wiring = Wiring(case.name, (begun,), (), case.steps * SAMPLE_TIME, SAMPLE_TIME)
    fed = [name for name in component.u.names if name in places]
    ends = {name: str(End(element.name, place.variable)) for name, place in places.items()}
    table = np.empty(len(reference.inputs), [("time", float), *((ends[name], float) for name in fed)])
    table["time"] = reference.inputs["time"]
    for name in fed:
        table[ends[name]] = places[name].factor * reference.inputs[name]
    run = simulate_apart if Settings().isolates(wiring) else simulate
    read = [name for name in component.y.names if name in places]

    def outputs(results: NDArray[Any]) -> Signals:
        return {name: results[ends[name]] / places[name].factor for name in read}

    try:
        return outputs(run(wiring, inputs=table if fed else None))
    except SimulationError as error:
        raise RunError(case.name, str(error), outputs(error.results) if error.results.size else None) from error
    except WiringError as error:
        raise RunError(case.name, str(error)) from error


def start_values(element: Element, reference: Reference, places: Mapping[str, Place]) -> dict[str, Value]:
    """Return the parameters that a reference run sets, by the FMU's names; RunError if it has not one of them."""
    case, variables = reference.case, element.variables
    if lacking := [name for name in case.parameters if name not in places]:
        raise RunError(case.name, f"the FMU has no variable {lacking[0]}, which this run sets.")
    values = {}
    for name, value in case.parameters.items():
        variable, factor = variables[places[name].variable], places[name].factor
        values[variable.name] = parse(literal(factor * value, variable.type), variable.type)
    return values


def departures(outputs: Signals, reference: Reference) -> dict[str, Departure]:
    """Return the signals that depart from a reference run by more than `TOLERANCE`, as far as the outputs go."""
    found = {}
    for signal, values in outputs.items():
        allowed = TOLERANCE * max(LEAST, np.abs(reference.outputs[signal]).max())
        expected = reference.outputs[signal][: len(values)]
        wrong = np.flatnonzero(~(np.abs(values - expected) <= allowed))
        if wrong.size:
            n = wrong[0]
            time = float(reference.outputs["time"][n])
            explanation = _explanation(values, expected)
            found[signal] = Departure(reference.case.name, time, float(values[n]), float(expected[n]), explanation)
    return found


_EXPLANATIONS: dict[str, Callable[[NDArray[np.float64]], NDArray[np.float64]]] = {
    "the sign is flipped": lambda expected: -expected,
    "it is in degrees": np.degrees,
    "it is in radians": np.radians,
    "it is in thousandths": lambda expected: 1e3 * expected,
    "it is in thousands": lambda expected: 1e-3 * expected,
    "it comes a step late": lambda expected: np.concatenate([expected[:1], expected[:-1]]),
}


def _explanation(values: NDArray[np.float64], expected: NDArray[np.float64]) -> str:
    for explanation, of in _EXPLANATIONS.items():
        wrong = of(expected)
        # What is nearly zero or nearly the same either way explains nothing.
        if np.abs(wrong - expected).max() > LEAST and _agree(values, wrong):
            return explanation
    return ""


def _agree(values: NDArray[np.float64], expected: NDArray[np.float64]) -> bool:
    return bool((np.abs(values - expected) <= TOLERANCE * max(LEAST, np.abs(expected).max())).all())
