"""The FMUs of systems, unpacked, loaded and instantiated, for one run or for many."""

import os
from collections.abc import Callable, Collection, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

from ..errors import UserError
from ..ssp.rates import Rate, rate_of
from ..ssp.wiring import Element, End, Wiring
from .exchange import Exchange
from .memory import Watch
from .slave import Slave
from .unpacked import Folders, unpacked


class LoadError(UserError):
    """The library of an FMU cannot be loaded, or makes no instance."""


class Instances:
    """The FMUs of some systems, unpacked until the context ends; libraries stay loaded from run to run.

    A run gets fresh instances, not ones that fmi2Reset took back: that costs as little, and forgets nothing. For one
    thread at a time; two of these share no memory of a library.
    """

    def __init__(self, *wirings: Wiring, folders: Folders | None = None) -> None:
        self._stack = ExitStack()
        self._folders = self._stack.enter_context(unpacked(*wirings)) if folders is None else folders
        self._slaves: dict[tuple[str, Path], Slave] = {}
        self._laid_out: tuple[object, Exchange] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._unload(list(self._slaves))
        self._stack.close()

    def exchange(
        self,
        wiring: Wiring,
        fed: Sequence[End],
        warn: Callable[[str], None],
        watch: Watch | None = None,
        recorded: Collection[str] | None = None,
    ) -> Exchange:
        """Return the system's FMUs as fresh instances with its start values set, and what goes between them.

        `recorded` is as in `simulation.simulate`.

        Raises
        ------
        LoadError : an FMU cannot be loaded or instantiated.
        SlaveError : a start value cannot be set.
        """
        watch = watch or Watch()
        slaves = [
            self._instantiated(element, number, wiring.step_size, warn, watch)
            for number, element in enumerate(wiring.elements)
        ]
        exchange = self._exchange(slaves, wiring, fed, None if recorded is None else frozenset(recorded))
        for slave in slaves:
            slave.set_start_values()
        return exchange

    def free(self) -> None:
        """Free all instances; libraries of which there can be one instance in a process are unloaded too."""
        alone = []
        for key, slave in self._slaves.items():
            if slave.element.description.coSimulation.canBeInstantiatedOnlyOncePerProcess:
                alone.append(key)  # what its memory holds may outlive an instance
            elif slave.fmu.component is not None:
                slave.free()
        self._unload(alone)

    def _instantiated(
        self, element: Element, number: int, step: float, warn: Callable[[str], None], watch: Watch
    ) -> Slave:
        key = element.name, element.fmu
        rate = rate_of(element, step) or Rate()  # those that do not fit are a problem of the wiring
        try:
            if key not in self._slaves:
                self._slaves[key] = Slave(element, self._folders[key], warn, watch, number, rate)
                self._laid_out = None
                return self._slaves[key]
            slave = self._slaves[key]
            slave.number, slave.watch, slave.rate = number, watch, rate
            slave.instantiate(element, warn)
        except Exception as error:  # FMPy raises plain exceptions when a library does not load
            reason = str(error).replace(f"{self._folders[key]}{os.sep}", "")
            raise LoadError(f"{element.name}: the FMU cannot be loaded: {reason}") from error
        return slave

    def _exchange(
        self, slaves: list[Slave], wiring: Wiring, fed: Sequence[End], recorded: frozenset[str] | None
    ) -> Exchange:
        form = [id(slave) for slave in slaves], wiring.links, tuple(fed), recorded
        if self._laid_out is None or self._laid_out[0] != form:
            ends = {*(link.target for link in wiring.links), *fed}
            self._laid_out = None  # its memory goes
            for slave in slaves:
                prefix = f"{slave.element.name}."
                kept = None if recorded is None else {n[len(prefix) :] for n in recorded if n.startswith(prefix)}
                slave.lay_out([end.variable for end in ends if end.element == slave.element.name], kept)
            self._laid_out = form, Exchange(slaves, wiring.links, fed)
        return self._laid_out[1]

    def _unload(self, keys: list[tuple[str, Path]]) -> None:
        for key in keys:
            self._slaves.pop(key).unload()
            self._laid_out = None
