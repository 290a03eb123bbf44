"""An FMU of FMI 3.0 in the check: its arrays element by element, and its reference runs in FMPy.

This project's master runs FMUs of FMI 2.0 alone. An FMU runs in this process here, whoever made it.
"""

from collections.abc import Iterator, Mapping
from copy import copy
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave, fmi3Error
from fmpy.model_description import ModelDescription, ModelVariable

from ..components.interface import SAMPLE_TIME, Component
from ..ssp.places import Place
from ..ssp.wiring import Element
from .check import RunError, Signals, start_values
from .reference import Reference

_TYPES = {"Float64": "Real", "Float32": "Real", "Boolean": "Boolean", "Enumeration": "Integer"}
_TYPES |= {f"{sign}Int{size}": "Integer" for sign in ("", "U") for size in (8, 16, 32, 64)}
"""The types of FMI 2.0 by those of FMI 3.0; a variable of another is left out."""


def scalars(description: ModelDescription, component: Component) -> ModelDescription:
    """Return the description of an FMU of FMI 3.0 with a variable for each element of its arrays.

    An array that has the name and size of a signal of the component has the names of its elements; another has numbers,
    as in ``name[1]`` or ``name[2,1]``.
    """
    flat = copy(description)
    flat.modelVariables = [scalar for scalar, _, _ in _elements(description, component)]
    return flat


def replay(folder: Path, element: Element, reference: Reference, places: Mapping[str, Place]) -> Signals:
    """Return the outputs of an FMU that is unpacked in a folder; the rest is as in `check.replay`."""
    component, case = reference.component, reference.case
    values = start_values(element, reference, places)
    fed = [name for name in component.u.names if name in places]
    read = [name for name in component.y.names if name in places]
    there = {name: places[name].variable for name in (*fed, *read)}
    rows = np.empty((case.steps + 1, len(read)))
    messages: list[str] = []
    instance, told = None, 0

    def outputs() -> Signals:
        return {name: rows[:told, i] / places[name].factor for i, name in enumerate(read)}

    try:
        instance = _Instance(folder, element, component, messages)
        instance.set(values)
        instance.fmu.enterInitializationMode(startTime=0.0)
        for n in range(case.steps + 1):
            if n < case.steps:
                instance.set({there[name]: places[name].factor * reference.inputs[name][n] for name in fed})
            if n == 0:
                instance.fmu.exitInitializationMode()
            rows[n] = instance.get([there[name] for name in read])
            told = n + 1
            if n < case.steps:
                instance.fmu.doStep(n * SAMPLE_TIME, SAMPLE_TIME)
        instance.fmu.terminate()
    except Exception as error:  # FMPy raises plain ones where it cannot load or instantiate
        status = f" ({error.function}: {error.status})" if isinstance(error, FMICallException) else ""
        raise RunError(case.name, " ".join(messages) + status if messages else str(error), outputs()) from error
    finally:
        if instance is not None:
            instance.fmu.freeInstance()
    return outputs()


class _Instance:
    """An instance whose values go by the names of `scalars`; `messages` get why a call failed."""

    def __init__(self, folder: Path, element: Element, component: Component, messages: list[str]) -> None:
        description = read_model_description(str(element.fmu), validate=False)
        self._places = {scalar.name: (array, i) for scalar, array, i in _elements(description, component)}
        self.fmu = FMU3Slave(
            guid=description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=element.name,
        )

        def log(_: object, status: int, category: bytes, message: bytes) -> None:
            if status >= fmi3Error:
                messages.append(message.decode(errors="replace"))

        self.fmu.instantiate(loggingOn=True, logMessage=log)

    def get(self, names: list[str]) -> list[float]:
        """Return the values of variables; each array is read once."""
        arrays: dict[str, list[Any]] = {}
        for array, _ in map(self._places.__getitem__, names):
            if array.name not in arrays:
                arrays[array.name] = self._read(array)
        return [float(arrays[array.name][i]) for array, i in map(self._places.__getitem__, names)]

    def set(self, values: Mapping[str, Any]) -> None:
        """Set variables; what is not named of an array stays."""
        changed: dict[str, tuple[ModelVariable, list[Any]]] = {}
        for name, value in values.items():
            array, i = self._places[name]
            changed.setdefault(array.name, (array, self._read(array)))[1][i] = _of_type(value, array.type)
        for array, elements in changed.values():
            getattr(self.fmu, f"set{_function(array)}")([array.valueReference], elements)

    def _read(self, array: ModelVariable) -> list[Any]:
        return list(getattr(self.fmu, f"get{_function(array)}")([array.valueReference], _size(array)))


def _elements(
    description: ModelDescription, component: Component
) -> Iterator[tuple[ModelVariable, ModelVariable, int]]:
    """Yield a variable for each element of an array, the array, and the place in it."""
    signals = {s.name: s.names for s in component.inputs + component.outputs + component.parameters}
    for array in description.modelVariables:
        if array.type not in _TYPES or array.causality == "independent":
            continue
        size = _size(array)
        names = signals.get(array.name, ())
        if len(names) != size:
            places = [",".join(str(k + 1) for k in place) for place in np.ndindex(*(array.shape or ()))]
            names = tuple(f"{array.name}[{place}]" if place else array.name for place in places)
        starts = str(array.start).split() if array.start is not None else []
        starts *= size if len(starts) == 1 else 1
        for i, name in enumerate(names):
            scalar = copy(array)
            scalar.name, scalar.type, scalar.dimensions, scalar.shape = name, _TYPES[array.type], [], ()
            scalar.start = starts[i] if len(starts) == size else None
            yield scalar, array, i


def _size(array: ModelVariable) -> int:
    return int(np.prod(array.shape or ()))


def _function(array: ModelVariable) -> str:
    return "Int64" if array.type == "Enumeration" else str(array.type)


def _of_type(value: float, type_: str) -> float | int | bool:
    kind = _TYPES[type_]
    return bool(value) if kind == "Boolean" else int(value) if kind == "Integer" else float(value)
