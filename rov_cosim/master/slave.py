"""One FMU of a system: FMPy's FMU2Slave, its values in preallocated arrays, its log."""

from collections.abc import Callable
from ctypes import POINTER, c_double, c_int, c_uint32, cast
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import calloc, free
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
    fmi2True,
    fmi2Warning,
)
from fmpy.model_description import ModelVariable

from ..ssp.wiring import Element, Wiring

TYPES = ("Real", "Integer", "Boolean")
_CTYPES: dict[str, Any] = {"Real": c_double, "Integer": c_int, "Boolean": c_int}
_DTYPES: dict[str, type] = {"Real": np.float64, "Integer": np.int32, "Boolean": np.bool_}


class Block:
    """Some variables of one type of one FMU, and the memory through which they are read or set."""

    def __init__(self, fmu: FMU2Slave, type_: str, variables: list[ModelVariable]) -> None:
        n = len(variables)
        self.references = (c_uint32 * n)(*(variable.valueReference for variable in variables))
        self.names = [variable.name for variable in variables]
        memory = (_CTYPES[type_] * n)()
        self.values = np.frombuffer(memory, dtype=np.dtype(_CTYPES[type_]))
        self._get, self._set = getattr(fmu, f"fmi2Get{type_}"), getattr(fmu, f"fmi2Set{type_}")
        self._arguments = (fmu.component, self.references, n, cast(memory, POINTER(_CTYPES[type_])))

    def read(self) -> None:
        """Read the values from the FMU."""
        self._get(*self._arguments)

    def write(self) -> None:
        """Set the values in the FMU."""
        self._set(*self._arguments)


class SlaveError(FMICallException):
    """A call of an FMU failed in a step; `step` is its number once it is known."""

    def __init__(self, slave: "Slave", function: str, status: int, step: int | None = None) -> None:
        super().__init__(function, status)
        self.slave, self.step = slave, step


class Slave:
    """An instantiated FMU of a system, from the folder where it lies unpacked."""

    def __init__(self, element: Element, folder: Path, warn: Callable[[str], None]) -> None:
        self.element = element
        self.errors: list[str] = []
        description = element.description
        self.fmu = FMU2Slave(
            instanceName=element.name,
            guid=description.guid,
            modelIdentifier=description.coSimulation.modelIdentifier,
            unzipDirectory=str(folder),
        )

        def log(_: object, name: bytes, status: int, category: bytes, message: bytes) -> None:
            text = message.decode(errors="replace")
            if status > fmi2Warning:
                self.errors.append(text.splitlines()[-1] if text else "")
            elif status == fmi2Warning:
                warn(f"{element.name}: {text}")

        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = fmi2CallbackLoggerTYPE(log)
        self._callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        self._callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
        self.fmu.instantiate(callbacks=self._callbacks, loggingOn=True)
        self.outputs: dict[str, Block] = {}
        self.inputs: dict[str, Block] = {}

    def prepare(self, wiring: Wiring) -> None:
        """Set the start values and lay out the memory of outputs and connected inputs."""
        variables = self.element.variables
        for name, value in self.element.start_values.items():
            variable = variables[name]
            getattr(self.fmu, f"set{variable.type}")([variable.valueReference], [value])
        connected = {link.target.variable for link in wiring.links if link.target.element == self.element.name}
        for type_ in _CTYPES:
            of_type = [v for v in variables.values() if v.type == type_]
            if outputs := [v for v in of_type if v.causality == "output"]:
                self.outputs[type_] = Block(self.fmu, type_, outputs)
            if inputs := [v for v in of_type if v.name in connected]:
                self.inputs[type_] = Block(self.fmu, type_, inputs)

    def read(self) -> None:
        """Read all outputs; SlaveError if that fails, as the next two."""
        try:
            for block in self.outputs.values():
                block.read()
        except FMICallException as error:
            raise self._named(error) from error

    def write(self) -> None:
        """Set all connected inputs."""
        try:
            for block in self.inputs.values():
                block.write()
        except FMICallException as error:
            raise self._named(error) from error

    def step(self, time: float, step: float) -> None:
        """Advance from `time` by `step`, in s."""
        try:
            self.fmu.fmi2DoStep(self.fmu.component, time, step, fmi2True)
        except FMICallException as error:
            raise self._named(error) from error

    def _named(self, error: FMICallException) -> SlaveError:
        return SlaveError(self, error.function, error.status)

    @property
    def fields(self) -> list[tuple[str, type]]:
        """Name and type of each output in the results, in the order of its values."""
        return [
            (f"{self.element.name}.{name}", _DTYPES[type_])
            for type_, block in self.outputs.items()
            for name in block.names
        ]
