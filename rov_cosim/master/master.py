"""The co-simulation master: couplings of slaves, initial values, results."""

import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from threading import current_thread, main_thread
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException
from numpy.typing import NDArray

from ..ssp.wiring import Link, Wiring, WiringError
from .slave import Slave

PASSES = 100
"""Passes over the links, beyond one for each, in which initial values that follow each other must settle."""

Progress = Callable[[Iterable[int]], Iterable[int]]


class SimulationError(RuntimeError):
    """An FMU failed, or the user stopped the run; `results` holds what was computed until then."""

    def __init__(self, message: str, results: NDArray[Any]) -> None:
        super().__init__(message)
        self.results = results


class Loop:
    """The slaves of a system in order, and the copies that carry outputs to inputs."""

    def __init__(self, slaves: list[Slave], links: tuple[Link, ...]) -> None:
        self.slaves, self.n_links = slaves, len(links)
        by_name = {slave.element.name: slave for slave in slaves}
        grouped: dict[tuple[str, str, str], list[tuple[int, int, float]]] = {}
        for source, target, factor in links:
            type_ = by_name[source.element].element.variables[source.variable].type
            places = grouped.setdefault((source.element, target.element, type_), [])
            outputs, inputs = by_name[source.element].outputs[type_], by_name[target.element].inputs[type_]
            places.append((outputs.names.index(source.variable), inputs.names.index(target.variable), factor))
        self._copies: dict[str, list[tuple[NDArray[Any], ...]]] = {}
        for (source_name, target_name, type_), places in grouped.items():
            from_, to, factors = (np.array(column) for column in zip(*places, strict=True))
            values = (by_name[source_name].outputs[type_].values, by_name[target_name].inputs[type_].values)
            factors = factors.astype(values[1].dtype)
            self._copies.setdefault(target_name, []).append((*values, from_, to, factors))

    def feed(self, slave: Slave) -> None:
        """Set the connected inputs of a slave from the outputs last read."""
        for source, target, from_, to, factors in self._copies.get(slave.element.name, ()):
            target[to] = factors * source[from_]
        slave.write()

    def propagate(self) -> bool:
        """Hand initial outputs on until no value changes any more; tell whether that came to pass."""
        before = None
        for _ in range(PASSES + self.n_links):
            for slave in self.slaves:
                slave.read()
            for slave in self.slaves:
                self.feed(slave)
            if before is not None and np.array_equal(before, self.values(), equal_nan=True):
                return True
            before = self.values()
        return False

    def values(self) -> NDArray[np.float64]:
        """Return all outputs last read, in the order of the results' columns."""
        blocks = [block.values for slave in self.slaves for block in slave.outputs.values()]
        return np.concatenate([np.zeros(0), *blocks])


Coupling = Callable[[Loop, float, float], None]


def jacobi(loop: Loop, time: float, step: float) -> None:
    """Hand all outputs on, then step all: what every other master does. A connection delays by a step."""
    for slave in loop.slaves:
        loop.feed(slave)
    for slave in loop.slaves:
        slave.step(time, step)
    for slave in loop.slaves:
        slave.read()


def gauss_seidel(loop: Loop, time: float, step: float) -> None:
    """Feed and step one after the other, in the system's order: each sees the results of those before it."""
    for slave in loop.slaves:
        loop.feed(slave)
        slave.step(time, step)
        slave.read()


COUPLINGS: dict[str, Coupling] = {"jacobi": jacobi, "gauss-seidel": gauss_seidel}


def simulate(
    wiring: Wiring,
    coupling: Coupling = jacobi,
    stop_time: float | None = None,
    progress: Progress = lambda steps: steps,
    warn: Callable[[str], None] = lambda message: None,
) -> NDArray[Any]:
    """Run a system from its start time and return the outputs as a structured array.

    Parameters
    ----------
    wiring : the system, its FMUs extracted.
    coupling : how values are handed on within a step, `jacobi` or `gauss_seidel`.
    stop_time : end of the run in s; the system's own if left out.
    progress : wraps the iterable of steps, for example ``tqdm``.
    warn : called with each warning of an FMU.

    Returns
    -------
    Field ``time`` in s and one field for each output, ``element.variable``; a row for the start and each step's end.

    Raises
    ------
    SimulationError : an FMU failed, or the run was interrupted; it holds the results so far.
    WiringError : the system cannot run, or not to this stop time.
    """
    wiring = wiring if stop_time is None else replace(wiring, stop_time=stop_time)
    if problems := wiring.problems():
        raise WiringError(wiring.name, problems)
    n_steps = int(np.floor((wiring.stop_time - wiring.start_time) / wiring.step_size * (1 + 1e-9)))
    end = wiring.start_time + n_steps * wiring.step_size
    if wiring.stop_time - end > 1e-6 * wiring.step_size:
        warn(f"The run ends at {end:.9g} s, the last whole step before {wiring.stop_time:.9g} s.")
    rows = np.empty((n_steps + 1, 0))
    done = 0
    fields: list[tuple[str, type]] = []
    with instantiated(wiring, warn) as slaves, _deferred_interrupt() as interrupted:
        try:
            for slave in slaves:
                slave.prepare(wiring)
            loop = Loop(slaves, wiring.links)
            fields = [field for slave in slaves for field in slave.fields]
            rows = np.empty((n_steps + 1, len(fields)))
            initialize(loop, wiring.start_time)
            rows[0], done = loop.values(), 1
            for n in progress(range(n_steps)):
                if interrupted:
                    raise KeyboardInterrupt
                coupling(loop, wiring.start_time + n * wiring.step_size, wiring.step_size)
                rows[n + 1], done = loop.values(), n + 2
            for slave in slaves:
                slave.fmu.terminate()
        except FMICallException as error:
            raise SimulationError(_explain(slaves, error), _table(rows[:done], fields, wiring)) from error
        except KeyboardInterrupt:
            time = wiring.start_time + max(0, done - 1) * wiring.step_size
            raise SimulationError(f"Interrupted at {time:.6g} s.", _table(rows[:done], fields, wiring)) from None
    return _table(rows, fields, wiring)


def initialize(loop: Loop, start_time: float) -> None:
    """Take the slaves through their initialization, with the values that the links hand on."""
    for slave in loop.slaves:
        slave.fmu.setupExperiment(startTime=start_time)
        slave.fmu.enterInitializationMode()
    if not loop.propagate():
        raise SimulationError("The initial values do not settle: they depend on each other in a loop.", np.empty(0))
    for slave in loop.slaves:
        slave.fmu.exitInitializationMode()
    for slave in loop.slaves:
        slave.read()


@contextmanager
def instantiated(wiring: Wiring, warn: Callable[[str], None]) -> Iterator[list[Slave]]:
    """Yield the slaves of a system, instantiated, and free them afterwards."""
    slaves: list[Slave] = []
    with ExitStack() as stack:
        for element in wiring.elements:
            try:
                slave = Slave(element, warn)
            except Exception as error:  # FMPy raises plain exceptions when a library does not load
                raise SimulationError(f"{element.name}: the FMU cannot be loaded: {error}", np.empty(0)) from error
            stack.callback(slave.fmu.freeInstance)
            slaves.append(slave)
        yield slaves


@contextmanager
def _deferred_interrupt() -> Iterator[list[int]]:
    """Yield a list that Ctrl-C fills: raised within a step, it would break an FMU that runs Python.

    A second Ctrl-C is not held back, for the user whose step does not end.
    """
    received: list[int] = []
    if current_thread() is not main_thread() or signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        yield received  # signals go to the main thread, or the caller does not want them
        return

    def receive(number: int, frame: object) -> None:
        received.append(number)
        signal.signal(signal.SIGINT, before)

    before = signal.signal(signal.SIGINT, receive)
    try:
        yield received
    finally:
        signal.signal(signal.SIGINT, before)


def _explain(slaves: list[Slave], error: FMICallException) -> str:
    """Return what the failing FMU logged, or else the call that failed."""
    messages = [f"{slave.element.name}: {text}" for slave in slaves for text in dict.fromkeys(slave.errors)]
    return " ".join(messages) or str(error)


def _table(rows: NDArray[np.float64], fields: list[tuple[str, type]], wiring: Wiring) -> NDArray[Any]:
    table = np.empty(len(rows), dtype=[("time", np.float64), *fields])
    table["time"] = wiring.start_time + np.arange(len(rows)) * wiring.step_size
    for column, (name, _) in enumerate(fields):
        table[name] = rows[:, column]
    return table
