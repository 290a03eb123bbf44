"""Does an FMU behave as the reference? Replays reference runs and says, signal by signal, where it first departs."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from fmpy.fmi1 import FMICallException
from numpy.typing import NDArray

from ..components.interface import SAMPLE_TIME, Component
from ..errors import UserError
from ..exporters.model_description import literal
from ..master.slave import Slave
from ..ssp.fmu_file import FmuError, described
from ..ssp.wiring import Element, parse, suggestion
from .reference import TOLERANCE, Reference

Signals = dict[str, NDArray[np.float64]]
MOST_PROBLEMS = 8
LEAST = 1e-3
"""Value of a signal in its unit below which it is judged as if it were as large."""


class CheckError(UserError):
    """The FMU cannot be checked at all; the message tells why."""


@dataclass(frozen=True)
class Departure:
    """Where a signal first departs from a reference run, and what would explain the whole of it, if anything does."""

    case: str
    time: float
    value: float
    expected: float
    explanation: str

    def __str__(self) -> str:
        told = f"departs in {self.case} at {self.time:g} s: {self.value:.6g} instead of {self.expected:.6g}"
        return f"{told}; {self.explanation}" if self.explanation else told


def opened(fmu: Path) -> Element:
    """Return an FMU as an element.

    Raises
    ------
    CheckError : it is not an FMU that can be run here.
    """
    try:
        description = described(fmu)
    except FmuError as error:
        raise CheckError(str(error)) from None
    return Element(description.modelName, fmu.absolute(), description)


def theirs(element: Element, component: Component, names: Mapping[str, str]) -> dict[str, str]:
    """Return the names of an FMU's variables by those of the component; `names` has ours by theirs where they differ.

    Raises
    ------
    CheckError : with a line for each variable that the FMU has not, or that the mapping names in vain.
    """
    known = [*component.u.names, *component.y.names, *component.p.names]
    twice = {ours for ours in names.values() if list(names.values()).count(ours) > 1}
    problems = [
        f"The map names {ours}, which is no variable of {component.name}."
        for ours in names.values()
        if ours not in known
    ]
    problems += [f"The map has {ours} more than once." for ours in sorted(twice)]
    problems += [
        f"The map names {their}, which the FMU has not." + suggestion(their, element.variables)
        for their in names
        if their not in element.variables
    ]
    by_ours = {ours: ours for ours in known} | {ours: their for their, ours in names.items()}
    problems += [
        f"The FMU has no variable {by_ours[ours]}." + suggestion(by_ours[ours], element.variables)
        for ours in [*component.u.names, *component.y.names]
        if by_ours[ours] not in element.variables
    ]
    if problems:
        more = [f"... and {len(problems) - MOST_PROBLEMS} more."] if len(problems) > MOST_PROBLEMS else []
        raise CheckError("\n".join([*problems[:MOST_PROBLEMS], *more]))
    return by_ours


def replay(element: Element, folder: Path, reference: Reference, names: Mapping[str, str]) -> Signals:
    """Return the outputs of an FMU, unpacked in a folder, over a reference run; `names` has theirs by ours.

    Raises
    ------
    CheckError : the FMU cannot be loaded, has not a parameter of the run, or fails; the message has what it logged.
    """
    try:
        slave = Slave(element, folder, lambda message: None)
    except Exception as error:  # FMPy raises plain exceptions when a library does not load
        raise CheckError(f"The FMU cannot be loaded: {error}") from error
    try:
        return _replayed(slave, reference, names)
    except FMICallException as error:
        raise CheckError(f"{reference.case.name}: {' '.join(slave.errors) or error}") from error
    finally:
        slave.fmu.freeInstance()


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


def _replayed(slave: Slave, reference: Reference, names: Mapping[str, str]) -> Signals:
    variables = slave.element.variables
    component = reference.component

    def set_(name: str, value: float) -> None:
        if names[name] not in variables:
            raise CheckError(f"{reference.case.name}: the FMU has no variable {names[name]}, which this run sets.")
        variable = variables[names[name]]
        typed = parse(literal(value, variable.type), variable.type)
        getattr(slave.fmu, f"set{variable.type}")([variable.valueReference], [typed])

    def outputs() -> list[float]:
        found = [variables[names[name]] for name in component.y.names]
        return [float(getattr(slave.fmu, f"get{v.type}")([v.valueReference])[0]) for v in found]

    for name, value in reference.case.parameters.items():
        set_(name, value)
    for name in component.u.names:
        set_(name, reference.inputs[name][0])
    slave.fmu.setupExperiment(startTime=0.0)
    slave.fmu.enterInitializationMode()
    slave.fmu.exitInitializationMode()
    rows = [outputs()]
    for n in range(reference.case.steps):
        for name in component.u.names:
            set_(name, reference.inputs[name][n])
        slave.step(n * SAMPLE_TIME, SAMPLE_TIME)
        rows.append(outputs())
    return dict(zip(component.y.names, np.array(rows).T, strict=True))


_EXPLANATIONS: dict[str, Callable[[NDArray[np.float64]], NDArray[np.float64]]] = {
    "the sign is flipped": lambda expected: -expected,
    "it is in degrees": np.degrees,
    "it is in radians": np.radians,
    "it is in thousandths": lambda expected: 1e3 * expected,
    "it is in thousands": lambda expected: 1e-3 * expected,
    "it comes a step late": lambda expected: np.concatenate([expected[:1], expected[:-1]]),
}


def _explanation(values: NDArray[np.float64], expected: NDArray[np.float64]) -> str:
    for told, of in _EXPLANATIONS.items():
        wrong = of(expected)
        # What is nearly zero or nearly the same either way explains nothing.
        if np.abs(wrong - expected).max() > LEAST and _agree(values, wrong):
            return told
    return ""


def _agree(values: NDArray[np.float64], expected: NDArray[np.float64]) -> bool:
    return bool((np.abs(values - expected) <= TOLERANCE * max(LEAST, np.abs(expected).max())).all())
