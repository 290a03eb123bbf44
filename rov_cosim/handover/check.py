"""Does an FMU behave as the reference? Replays reference runs and says, signal by signal, where it first departs."""

from collections.abc import Callable, Mapping
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from fmpy.fmi1 import FMICallException
from numpy.typing import NDArray

from ..components.interface import SAMPLE_TIME
from ..errors import UserError
from ..exporters.model_description import literal
from ..master.slave import Slave
from ..ssp.places import Place
from ..ssp.values import parse
from ..ssp.wiring import Element
from .reference import TOLERANCE, Reference

Signals = dict[str, NDArray[np.float64]]
LEAST = 1e-3
"""Value of a signal in its unit below which it is judged as if it were as large."""


class CheckError(UserError):
    """The FMU cannot be checked at all; the message tells why."""


class RunError(CheckError):
    """A reference run cannot be replayed; others may."""


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


def replay(element: Element, folder: Path, reference: Reference, places: Mapping[str, Place]) -> Signals:
    """Return the outputs of an FMU over a reference run, by our names and in our units.

    Parameters
    ----------
    folder : where the FMU lies unpacked.
    places : the FMU's variables by ours; outputs without one are left out, and inputs are not set.

    Raises
    ------
    CheckError : the FMU cannot be loaded.
    RunError : it has not a parameter of the run, or fails; the message has what it logged.
    """
    try:
        with chdir("."):  # FMPy stays in the folder of a library that does not load
            slave = Slave(element, folder, lambda message: None)
    except Exception as error:  # FMPy raises plain exceptions when a library does not load
        raise CheckError(f"The FMU cannot be loaded: {' '.join(str(error).split())}") from error
    try:
        return _replayed(slave, reference, places)
    except FMICallException as error:
        raise RunError(f"{reference.case.name}: {' '.join(slave.errors) or error}") from error
    finally:
        slave.unload()


def departures(outputs: Signals, reference: Reference) -> dict[str, Departure]:
    """Return the signals that depart from a reference run by more than `TOLERANCE`."""
    found = {}
    for signal, values in outputs.items():
        expected = reference.outputs[signal]
        allowed = TOLERANCE * max(LEAST, np.abs(expected).max())
        wrong = np.flatnonzero(~(np.abs(values - expected) <= allowed))
        if wrong.size:
            n = wrong[0]
            time = float(reference.outputs["time"][n])
            explanation = _explanation(values, expected)
            found[signal] = Departure(reference.case.name, time, float(values[n]), float(expected[n]), explanation)
    return found


def _replayed(slave: Slave, reference: Reference, places: Mapping[str, Place]) -> Signals:
    variables = slave.element.variables
    inputs = [name for name in reference.component.u.names if name in places]
    signals = [name for name in reference.component.y.names if name in places]

    def set_(name: str, value: float) -> None:
        variable, factor = variables[places[name].variable], places[name].factor
        typed = parse(literal(factor * value, variable.type), variable.type)
        getattr(slave.fmu, f"set{variable.type}")([variable.valueReference], [typed])

    def outputs() -> list[float]:
        found = [(variables[places[name].variable], places[name].factor) for name in signals]
        return [float(getattr(slave.fmu, f"get{v.type}")([v.valueReference])[0]) / factor for v, factor in found]

    for name, value in reference.case.parameters.items():
        if name not in places:
            raise RunError(f"{reference.case.name}: the FMU has no variable {name}, which this run sets.")
        set_(name, value)
    for name in inputs:
        set_(name, reference.inputs[name][0])
    slave.fmu.setupExperiment(startTime=0.0)
    slave.fmu.enterInitializationMode()
    slave.fmu.exitInitializationMode()
    rows = [outputs()]
    for n in range(reference.case.steps):
        for name in inputs:
            set_(name, reference.inputs[name][n])
        slave.step(n * SAMPLE_TIME, SAMPLE_TIME)
        rows.append(outputs())
    return dict(zip(signals, np.array(rows).T, strict=True))


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
