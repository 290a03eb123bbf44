"""What an FMU logs, told by element: printf arguments in their places by FMPy's logger proxy."""

from collections.abc import Callable
from ctypes import byref
from itertools import count
from weakref import WeakValueDictionary

from fmpy import calloc, free
from fmpy.fmi2 import (
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
    fmi2Warning,
)
from fmpy.logging import addLoggerProxy

MOST_ERRORS = 5
"""Errors of an FMU that are kept."""
_LONGEST = 2047
"""Bytes at which FMPy's proxy cuts a message."""

_numbers = count(1)
_logs: WeakValueDictionary[int, "Log"] = WeakValueDictionary()


class Log:
    """The log of one instance: warnings go to `warn`, after the element's name, errors are kept for who reports one."""

    def __init__(self, element: str, warn: Callable[[str], None]) -> None:
        self.element, self.warn = element, warn
        self.errors: list[str] = []
        number = next(_numbers)
        _logs[number] = self
        self.callbacks = fmi2CallbackFunctions()
        self.callbacks.logger = _LOGGER
        self.callbacks.allocateMemory = _ALLOCATE
        self.callbacks.freeMemory = _FREE
        self.callbacks.componentEnvironment = number
        addLoggerProxy(byref(self.callbacks))

    def take(self, status: int, message: bytes) -> None:
        """Take a message in."""
        lines = message.decode(errors="replace").splitlines() or [""]
        if lines[0].startswith("Traceback"):  # of an FMU that runs Python
            lines = lines[-1:]
        shown = "".join(c if c.isprintable() else " " for c in " ".join(lines))  # no orders to the user's terminal
        text = " ".join(shown.split()) + (" ..." if len(message) >= _LONGEST else "")
        if status > fmi2Warning:
            if text and text not in self.errors and len(self.errors) < MOST_ERRORS:
                self.errors.append(text)
        elif status == fmi2Warning:
            self.warn(f"{self.element}: {text or 'a warning without words'}")

    def tell_errors(self) -> None:
        """Hand on, as warnings, the errors that no call reported."""
        for text in self.errors:
            self.warn(f"{self.element} logged an error, though none of its calls failed: {text}")


def _log(
    environment: int | None, name: bytes | None, status: int, category: bytes | None, message: bytes | None
) -> None:
    log = _logs.get(environment or 0)
    if log is None:  # an FMU that does not give back what it was given, but its name perhaps
        log = next((log for _, log in sorted(_logs.items(), reverse=True) if log.element.encode() == name), None)
    if log is not None:
        log.take(status, message or b"")


# The proxy calls the logger that it was given last, of whatever instance: so there is one for all.
_LOGGER = fmi2CallbackLoggerTYPE(_log)
_ALLOCATE = fmi2CallbackAllocateMemoryTYPE(calloc)
_FREE = fmi2CallbackFreeMemoryTYPE(free)
