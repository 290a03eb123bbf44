"""What runs inside a pythonfmu FMU: the calls of FMI 2.0, handed on to a component's instance."""

import atexit
import ctypes
import math
import os
from collections.abc import Callable
from contextlib import suppress
from functools import cache, wraps
from pathlib import Path
from typing import Any, ClassVar, TypeVar, cast

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from ..components.instance import ComponentError, Instance
from ..components.interface import Component

held: list[dict[str, Any]] = []
"""References to the globals of main modules; see `pythonfmu_export`."""

Method = TypeVar("Method", bound=Callable[..., Any])


def _complaint(error: BaseException) -> ComponentError:
    """Return the error for the FMU's log; one that no check foresaw keeps its type."""
    return error if isinstance(error, ComponentError) else ComponentError(repr(error))


def _reported(method: Method) -> Method:
    """Let an error leave a method only so that the FMU survives it.

    pythonfmu turns an exception into fmi2Fatal with its text as the log message, but first drops one reference to the
    class, the instance and the log queue, which it drops again when the FMU is freed. One more of each balances that.
    """

    @wraps(method)
    def guarded(self: "ComponentSlave", *args: Any, **kwargs: Any) -> Any:
        try:
            return method(self, *args, **kwargs)
        except BaseException as error:
            for owned in (type(self), self, self.log_queue):
                ctypes.pythonapi.Py_IncRef(ctypes.py_object(owned))
            raise _complaint(error) from None

    return cast(Method, guarded)


@cache
def _release_interpreter_once(library: Path) -> None:
    """Let pythonfmu's library release its interpreter state before the process ends.

    On Linux its exit handlers release it twice, after which the heap is sometimes found corrupted: a run that was fine
    ends with an abort. Released early, it is gone when they come.
    """
    if hasattr(os, "RTLD_NOLOAD"):
        with suppress(OSError):  # a host may have loaded the library from elsewhere
            loaded = ctypes.CDLL(str(library), mode=os.RTLD_NOLOAD | os.RTLD_NOW)
            atexit.register(loaded.finalizePythonInterpreter)


class ComponentSlave(Fmi2Slave):
    """A component behind pythonfmu's interface; a subclass in the FMU says which."""

    component: ClassVar[Component]

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        if self.resources is not None:
            root = Path(self.resources).parent
            _release_interpreter_once(root / "binaries" / "linux64" / f"{self.component.name}.so")
        self._instance = Instance(self.component, lambda message: self.log(message, Fmi2Status.warning))
        groups = (self.component.inputs, self.component.outputs, self.component.parameters)
        self._names = [name for group in groups for signal in group for name in signal.names]
        self._types = [signal.type for group in groups for signal in group for _ in signal.names]

    @_reported
    def setup_experiment(
        self, start_time: float, stop_time: float | None = None, tolerance: float | None = None
    ) -> None:
        """Take the times of the run."""
        self._instance.set_times(start_time, math.inf if stop_time is None else stop_time)

    @_reported
    def enter_initialization_mode(self) -> None:
        """Begin the initialization."""
        self._instance.enter_initialization()

    @_reported
    def exit_initialization_mode(self) -> None:
        """Fix the initial state."""
        self._instance.exit_initialization()

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance; a failure is logged and answered with False, which pythonfmu reports as fmi2Discard."""
        try:
            self._instance.do_step(current_time, step_size)
        except BaseException as error:  # Ctrl-C too: nothing may escape from here
            self.log(str(_complaint(error)), Fmi2Status.error)
            return False
        return True

    @_reported
    def terminate(self) -> None:
        """End the run."""
        self._instance.terminate()

    @_reported
    def get_real(self, vrs: list[int]) -> list[float]:
        """Return Real values."""
        return self._instance.get(self._of_type("Real", vrs))

    @_reported
    def get_integer(self, vrs: list[int]) -> list[int]:
        """Return Integer values."""
        return [int(value) for value in self._instance.get(self._of_type("Integer", vrs))]

    @_reported
    def get_boolean(self, vrs: list[int]) -> list[bool]:
        """Return Boolean values."""
        return [value > 0 for value in self._instance.get(self._of_type("Boolean", vrs))]

    @_reported
    def get_string(self, vrs: list[int]) -> list[str]:
        """Refuse: no component has a String."""
        return [str(vr) for vr in self._of_type("String", vrs)]

    @_reported
    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set Real values."""
        self._instance.set(self._of_type("Real", vrs), values)

    @_reported
    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        """Set Integer values."""
        self._instance.set(self._of_type("Integer", vrs), values)

    @_reported
    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        """Set Boolean values."""
        self._instance.set(self._of_type("Boolean", vrs), values)

    @_reported
    def set_string(self, vrs: list[int], values: list[str]) -> None:
        """Refuse: no component has a String."""
        self._of_type("String", vrs)

    def _of_type(self, type_: str, vrs: list[int]) -> list[int]:
        for vr in vrs:
            if not 0 <= vr < len(self._types):
                raise ComponentError(
                    f"There is no variable with value reference {vr}; expected 0 to {len(self._types) - 1}."
                )
            if self._types[vr] != type_:
                raise ComponentError(
                    f"{self._names[vr]} (value reference {vr}) is of type {self._types[vr]}, not {type_}."
                )
        return vrs

    @_reported
    def _get_fmu_state(self) -> bytes:
        return self._instance.save()

    @_reported
    def _set_fmu_state(self, state: bytes) -> None:
        self._instance.restore(state)

    @staticmethod
    def _fmu_state_to_bytes(state: bytes) -> bytes:
        return state

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> bytes:
        return state
