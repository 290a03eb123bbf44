"""One FMU of a system: FMPy's FMU2Slave, its values in preallocated arrays, its log."""

import os
from collections.abc import Callable, Collection, Iterator
from contextlib import chdir, contextmanager
from ctypes import POINTER, c_char_p, c_double, c_int, c_uint32, cast
from itertools import groupby
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from fmpy import sharedLibraryExtension
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2True
from fmpy.model_description import ModelVariable
from numpy.typing import NDArray

from ..exporters import zig
from ..ssp.rates import Rate
from ..ssp.values import function_type
from ..ssp.wiring import Element
from .log import Log
from .memory import Watch

TYPES = ("Real", "Integer", "Boolean", "String")
"""By which functions values are set and read: those of an Enumeration are the Integers'."""
TEXT_SIZE = 64
"""Bytes of a String that are recorded, of UTF-8."""
_CTYPES: dict[str, Any] = {"Real": c_double, "Integer": c_int, "Boolean": c_int, "String": c_char_p}
_DTYPES: dict[str, Any] = {"Real": np.float64, "Integer": np.int32, "Boolean": np.bool_, "String": f"S{TEXT_SIZE}"}

_STATUSES = {2: "discard", 3: "error", 4: "fatal", 5: "pending: which is not supported"}


_loading = Lock()


@contextmanager
def folder_kept() -> Iterator[None]:
    """Come back to the working folder in the end, whatever an FMU does; not to that of a library being loaded."""
    with _loading:
        before = os.getcwd()
    try:
        yield
    finally:
        with _loading:
            os.chdir(before)


def _library(folder: Path, identifier: str) -> str | None:
    """Return the binary for this machine, or None, whereupon FMPy tells where it would be."""
    places = (folder / "binaries" / f / f"{identifier}{sharedLibraryExtension}" for f in zig.host_folders())
    return next((str(place) for place in places if place.is_file()), None)


class SlaveError(Exception):
    """What an FMU did wrong, in words; `step` is the number of the step in which, None before and after all steps."""

    def __init__(self, slave: "Slave", what: str, step: int | None = None) -> None:
        super().__init__(what)
        self.slave, self.step = slave, step


class Block:
    """Some variables of one type of one FMU, and the memory through which they are read or set.

    `recorded` has the places of those that are recorded, of outputs.
    """

    def __init__(self, type_: str, variables: list[ModelVariable], recorded: Collection[str] | None = None) -> None:
        n = len(variables)
        self.type, self.names = type_, [variable.name for variable in variables]
        kept = [i for i, name in enumerate(self.names) if recorded is None or name in recorded]
        self.recorded = np.array(kept, dtype=np.uintp)
        self.references = (c_uint32 * n)(*(variable.valueReference for variable in variables))
        self.memory = (_CTYPES[type_] * n)()
        self.values = np.frombuffer(self.memory, dtype=np.uintp if type_ == "String" else np.dtype(_CTYPES[type_]))
        self.dtype: np.dtype[Any] = np.dtype(_DTYPES[type_])
        self._pointer = cast(self.memory, POINTER(_CTYPES[type_]))

    def arguments(self, fmu: FMU2Slave) -> tuple[Any, ...]:
        """Return the arguments of the functions that read and set them."""
        return fmu.component, self.references, len(self.names), self._pointer

    @property
    def is_finite(self) -> bool:
        """Whether all its values, of Reals, are finite numbers."""
        return bool(np.isfinite(self.values).all())

    def recordable(self) -> NDArray[Any]:
        """Return all values as they are recorded."""
        if self.type != "String":
            return self.values
        return np.array([(text or b"")[:TEXT_SIZE] for text in self.memory], dtype=self.dtype)


class Slave:
    """An FMU of a system, loaded from the folder where it lies unpacked, and its instance.

    `number` is its place in the system; `watch` is told what it is called for.
    """

    def __init__(
        self,
        element: Element,
        folder: Path,
        warn: Callable[[str], None],
        watch: Watch | None = None,
        number: int = 0,
        rate: Rate | None = None,
    ) -> None:
        self.number, self.watch, self.rate = number, watch or Watch(), rate or Rate()
        description = element.description
        # FMPy goes to the library's folder meanwhile, and stays there if it does not load.
        with _loading, chdir("."):
            self.fmu: FMU2Slave = self._call(
                lambda: FMU2Slave(
                    instanceName=element.name,
                    guid=description.guid,
                    modelIdentifier=description.coSimulation.modelIdentifier,
                    unzipDirectory=str(folder),
                    libraryPath=_library(folder, description.coSimulation.modelIdentifier),
                ),
                "l",
            )
        self.outputs: dict[str, Block] = {}
        self.inputs: dict[str, Block] = {}
        self.instantiate(element, warn)

    def instantiate(self, element: Element, warn: Callable[[str], None]) -> None:
        """Make an instance, in place of an earlier one if there was; its element may have other start values."""
        self.element = element
        self.log = Log(element.name, warn)
        self.errors = self.log.errors
        try:
            self._call(lambda: self.fmu.instantiate(callbacks=self.log.callbacks, loggingOn=True), "i")
        except Exception as error:  # a plain one of FMPy's
            raise SlaveError(self, " ".join(self.errors) or f"{error} (fmi2Instantiate)") from error

    def free(self) -> None:
        """Free the instance; the library stays loaded."""
        self._call(lambda: self.fmu.fmi2FreeInstance(self.fmu.component), "F")
        self.fmu.component = None

    def unload(self) -> None:
        """Free the instance if there is one, and unload the library."""
        if self.fmu.component is not None:
            self.free()
        self._call(self.fmu.freeLibrary, "u")

    def lay_out(self, fed: Collection[str], recorded: Collection[str] | None = None) -> None:
        """Lay out the memory of the outputs, with those to record, all if left out, and of the inputs that are fed."""
        self.outputs, self.inputs = {}, {}
        variables = self.element.variables.values()
        for type_ in TYPES:
            of_type = [v for v in variables if function_type(v) == type_]
            if outputs := [v for v in of_type if v.causality == "output"]:
                self.outputs[type_] = Block(type_, outputs, recorded)
            if inputs := [v for v in of_type if v.name in fed]:
                self.inputs[type_] = Block(type_, inputs)

    def set_start_values(self) -> None:
        """Set what differs from the FMU's own start values; SlaveError if that fails, as in all that follows."""
        known = self.element.variables
        typed = ((known[name], value) for name, value in self.element.start_values.items())
        for type_, group in groupby(typed, lambda one: function_type(one[0])):
            variables, values = zip(*group, strict=True)
            set_ = getattr(self.fmu, f"set{type_}")
            self._call(set_, "s", type_, [variable.valueReference for variable in variables], [*values])

    def call(self, function: str, **arguments: Any) -> None:
        """Call a function of the FMU's life by FMPy's name, for example ``terminate``."""
        self._call(lambda: getattr(self.fmu, function)(**arguments), CALLS[function])

    def read(self) -> None:
        """Read all outputs."""
        self._transfer("Get", self.outputs)

    def write(self) -> None:
        """Set all inputs that are fed."""
        self._transfer("Set", self.inputs)

    def step(self, time: float, step: float) -> None:
        """Advance from `time` by `step`, in s."""
        self._call(self.fmu.fmi2DoStep, "d", "Real", self.fmu.component, time, step, fmi2True)

    def check_finite(self, block: Block | None) -> None:
        """Raise SlaveError if a value of a block is not finite."""
        if block is None or block.is_finite:
            return
        raise self.not_finite(block, int(np.flatnonzero(~np.isfinite(block.values))[0]))

    def failed(self, function: str, status: int) -> SlaveError:
        """Return what went wrong in a call: the reasons that the FMU logged, if it did."""
        name = _STATUSES.get(status, "none of FMI's")
        if not self.errors:
            return SlaveError(self, f"{function} failed with status {status} ({name}).")
        return SlaveError(self, f"{' '.join(self.errors)} ({function}: {name}).")

    def not_finite(self, block: Block, variable: int) -> SlaveError:
        """Return what is wrong with a variable of a block that is not finite."""
        what = "is fed" if block in self.inputs.values() else "is"
        cure = "check what it follows from, or go on by --allow-not-finite"
        return SlaveError(self, f"{block.names[variable]} {what} {block.values[variable]:g}: {cure}.")

    def _transfer(self, way: str, blocks: dict[str, Block]) -> None:
        for type_, block in blocks.items():
            function = getattr(self.fmu, f"fmi2{way}{type_}")
            self._call(function, way[0].lower(), type_, *block.arguments(self.fmu))

    def _call(self, function: Callable[..., Any], call: str, type_: str = "Real", *arguments: Any) -> Any:
        """Call a function of the FMU; the watch is told of it by a letter, and its failure is told in words."""
        watch = self.watch
        watch.slave, watch.type, watch.call = self.number, TYPES.index(type_), ord(call)
        try:
            return function(*arguments)
        except FMICallException as error:
            raise self.failed(error.function, error.status) from error
        finally:
            watch.call = 0

    def fields(self, all_: bool = True) -> list[tuple[str, Any]]:
        """Name and type of each output, of all or of those that are recorded, in the order of the values."""
        return [
            (f"{self.element.name}.{name}", block.dtype)
            for block in self.outputs.values()
            for name in (block.names if all_ else [block.names[i] for i in block.recorded])
        ]


CALLS = {
    "setupExperiment": "p",
    "enterInitializationMode": "e",
    "exitInitializationMode": "x",
    "terminate": "t",
}
"""The letter by which `Watch.call` names a function of the FMU's life."""
