"""The co-simulation master: from a wiring to a table of all outputs."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, chdir, contextmanager
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException
from numpy.typing import NDArray

from ..errors import UserError
from ..ssp.checks import problems_of
from ..ssp.wiring import Wiring, WiringError
from .exchange import Coupling, Exchange, in_python, jacobi
from .in_c import in_c
from .interrupts import deferred
from .slave import Slave, SlaveError
from .unpacked import Folders, unpacked

Progress = Callable[[Iterable[int]], Iterable[int]]

_BATCH = 0.02
"""Time in s that the steps between two looks at Ctrl-C take, about."""


class SimulationError(UserError):
    """An FMU failed, or the user stopped the run; `results` holds what was computed until then."""

    def __init__(self, message: str, results: NDArray[Any], is_interrupted: bool = False) -> None:
        super().__init__(message)
        self.results, self.is_interrupted = results, is_interrupted


def simulate(
    wiring: Wiring,
    coupling: Coupling = jacobi,
    stop_time: float | None = None,
    progress: Progress = lambda steps: steps,
    warn: Callable[[str], None] = lambda message: None,
    folders: Folders | None = None,
    in_numpy: bool = False,
) -> NDArray[Any]:
    """Run a system from its start time and return the outputs as a structured array.

    Parameters
    ----------
    wiring : the system.
    coupling : how values are handed on within a step, `jacobi` or `gauss_seidel`.
    stop_time : end of the run in s; the system's own if left out.
    progress : wraps the iterable of steps, for example ``tqdm``.
    warn : called with each warning of an FMU.
    folders : where its FMUs lie `unpacked`, for many runs of them; they are unpacked for this run if left out.
    in_numpy : step in Python, not in C where there is a compiler; the results are the same to the last bit.

    Returns
    -------
    Field ``time`` in s and one field for each output, ``element.variable``; a row for the start and each step's end.

    Raises
    ------
    SimulationError : an FMU failed, or the run was interrupted; it holds the results so far.
    WiringError : the system cannot run, or not to this stop time.
    """
    wiring = wiring if stop_time is None else replace(wiring, stop_time=stop_time)
    if problems := problems_of(wiring):
        raise WiringError(wiring.name, problems)
    n_steps = int(np.floor((wiring.stop_time - wiring.start_time) / wiring.step_size * (1 + 1e-9)))
    end = wiring.start_time + n_steps * wiring.step_size
    if wiring.stop_time - end > 1e-6 * wiring.step_size:
        warn(f"The run ends at {end:.9g} s, the last whole step before {wiring.stop_time:.9g} s.")
    rows = np.empty((n_steps + 1, 0))
    done = 0
    fields: list[tuple[str, type]] = []
    with instantiated(wiring, warn, folders) as slaves, deferred() as interrupted:
        try:
            for slave in slaves:
                slave.prepare(wiring)
            exchange = Exchange(slaves, wiring.links)
            fields = [field for slave in slaves for field in slave.fields]
            rows = np.empty((n_steps + 1, len(fields)))
            initialize(exchange, wiring.start_time)
            rows[0], done = exchange.values(), 1
            how = (exchange, coupling, wiring.start_time, wiring.step_size)
            advance = (None if in_numpy else in_c(*how)) or in_python(*how)
            ready, batch = 0, 1
            for n in progress(range(n_steps)):
                if interrupted:
                    raise KeyboardInterrupt
                if n == ready:
                    begin, ready = perf_counter(), min(ready + batch, n_steps)
                    advance(n, rows[n + 1 : ready + 1])
                    batch = 2 * batch if perf_counter() - begin < _BATCH else max(batch // 2, 1)
                done = n + 2
            for slave in slaves:
                slave.fmu.terminate()
        except FMICallException as error:
            if isinstance(error, SlaveError) and error.step is not None:
                done = error.step + 1
            raise SimulationError(_explain(slaves, error, wiring), _table(rows[:done], fields, wiring)) from error
        except KeyboardInterrupt:
            time = wiring.start_time + max(0, done - 1) * wiring.step_size
            raise SimulationError(f"Interrupted at {time:.6g} s.", _table(rows[:done], fields, wiring), True) from None
    return _table(rows, fields, wiring)


def initialize(exchange: Exchange, start_time: float) -> None:
    """Take the slaves through their initialization, with the values that the links hand on."""
    for slave in exchange.slaves:
        slave.fmu.setupExperiment(startTime=start_time)
        slave.fmu.enterInitializationMode()
    if not exchange.propagate():
        raise SimulationError("The initial values do not settle: they depend on each other in a loop.", np.empty(0))
    for slave in exchange.slaves:
        slave.fmu.exitInitializationMode()
    for slave in exchange.slaves:
        slave.read()


@contextmanager
def instantiated(wiring: Wiring, warn: Callable[[str], None], folders: Folders | None = None) -> Iterator[list[Slave]]:
    """Yield the slaves of a system, instantiated, and free them afterwards; `folders` as in `simulate`."""
    slaves: list[Slave] = []
    # An FMU may change the folder that one is in, and FMPy stays in that of a library that does not load.
    with chdir("."), ExitStack() as stack:
        folders = stack.enter_context(unpacked(wiring)) if folders is None else folders
        for element in wiring.elements:
            try:
                slave = Slave(element, folders[element.name, element.fmu], warn)
            except Exception as error:  # FMPy raises plain exceptions when a library does not load
                raise SimulationError(f"{element.name}: the FMU cannot be loaded: {error}", np.empty(0)) from error
            stack.callback(slave.fmu.freeInstance)
            slaves.append(slave)
        yield slaves


def _explain(slaves: list[Slave], error: FMICallException, wiring: Wiring) -> str:
    """Return what the failing FMU logged, or else which call of which FMU failed, and when."""
    messages = [f"{slave.element.name}: {text}" for slave in slaves for text in dict.fromkeys(slave.errors)]
    if messages or not isinstance(error, SlaveError):
        return " ".join(messages) or str(error)
    when = "" if error.step is None else f"At {wiring.start_time + error.step * wiring.step_size:.9g} s: "
    return f"{error.slave.element.name}: {when}{error}"


def _table(rows: NDArray[np.float64], fields: list[tuple[str, type]], wiring: Wiring) -> NDArray[Any]:
    table = np.empty(len(rows), dtype=[("time", np.float64), *fields])
    table["time"] = wiring.start_time + np.arange(len(rows)) * wiring.step_size
    for column, (name, _) in enumerate(fields):
        table[name] = rows[:, column]
    return table
