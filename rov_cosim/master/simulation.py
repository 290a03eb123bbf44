"""The co-simulation master: from a wiring to a table of all outputs."""

from collections import deque
from collections.abc import Callable, Collection, Iterable
from contextlib import ExitStack
from dataclasses import replace
from itertools import islice
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import UserError
from ..ssp.checks import problems_of
from ..ssp.wiring import Wiring, WiringError, suggestion
from .exchange import Coupling, Exchange, InPython, Steps, jacobi, rows_after
from .given import Given, problems_of_given, with_fed
from .in_c import InC, in_c
from .instances import Instances, LoadError
from .interrupts import deferred
from .memory import Memory
from .slave import SlaveError, folder_kept

Progress = Callable[[Iterable[int]], Iterable[int]]

_BATCH = 0.02
"""Time in s that the steps between two looks at Ctrl-C take, about."""
_MOST_GIVEN = 10_000
"""Steps in a batch, for which values that are fed from outside are laid out."""


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
    *,
    instances: Instances | None = None,
    inputs: NDArray[Any] | None = None,
    output_interval: float | None = None,
    recorded: Collection[str] | None = None,
    allow_not_finite: bool = False,
    in_numpy: bool = False,
    memory: Memory | None = None,
) -> NDArray[Any]:
    """Run a system from its start time and return the outputs as a structured array.

    Parameters
    ----------
    wiring : the system.
    coupling : how values are handed on within a step, `jacobi` or `gauss_seidel`.
    stop_time : end of the run in s; the system's own if left out.
    progress : wraps the iterable of steps, for example ``tqdm``.
    warn : called with each warning of an FMU.
    instances : keeps its FMUs loaded, for many runs of them; they are loaded for this run if left out.
    inputs : a table of unconnected inputs over time, as `given.problems_of_given` tells.
    output_interval : time in s; there is a row for the first step at or beyond each multiple of it, and for each step
        if it is left out.
    recorded : the outputs, ``element.variable``, of which there is a field; all if left out.
    allow_not_finite : go on when an output is not finite.
    in_numpy : step in Python, not in C where there is a compiler; the results are the same to the last bit.
    memory : where results are kept; if left out in memory, or in a temporary file if they are many.

    Returns
    -------
    Field ``time`` in s and one for each output that is recorded and each input that is fed; a row for the start and
    each step's end.

    Raises
    ------
    SimulationError : an FMU failed, or the run was interrupted; it holds the results so far.
    WiringError : the system cannot run, or not to this stop time.
    """
    wiring = wiring if stop_time is None else replace(wiring, stop_time=stop_time)
    problems = problems_of(wiring) + list(() if inputs is None else problems_of_given(inputs, wiring))
    spacing = 1.0 if output_interval is None else output_interval / wiring.step_size
    if not 1 - 1e-9 <= spacing < np.inf:
        problems.append(
            f"The output interval is {output_interval} s; expected at least a step of {wiring.step_size:g} s."
        )
    if unknown := sorted({*(recorded or ())} - wiring.outputs):
        problems += [f"There is no output {name}.{suggestion(name, wiring.outputs)}" for name in unknown]
    if problems:
        raise WiringError(wiring.name, problems)
    n_steps = int(np.floor((wiring.stop_time - wiring.start_time) / wiring.step_size * (1 + 1e-9)))
    end = wiring.start_time + n_steps * wiring.step_size
    if wiring.stop_time - end > 1e-6 * wiring.step_size:
        warn(f"The run ends at {end:.9g} s, the last whole step before {wiring.stop_time:.9g} s.")
    given, memory = Given(inputs, wiring) if inputs is not None else None, memory or Memory()
    steps = Steps(coupling, wiring.start_time, wiring.step_size, not allow_not_finite)
    run = _Run(steps, n_steps, spacing, given, memory)
    with ExitStack() as stack:
        interrupted = stack.enter_context(deferred())
        stack.enter_context(folder_kept())
        instances = instances or stack.enter_context(Instances(wiring))
        stack.callback(instances.free)
        try:
            ends = given.ends if given else ()
            run.begin(instances.exchange(wiring, ends, warn, memory.watch, recorded), in_numpy)
            run.take_steps(progress, interrupted)
            for slave in run.exchange.slaves:
                slave.call("terminate")
            for slave in run.exchange.slaves:
                slave.log.tell_errors()
        except LoadError as error:
            raise SimulationError(str(error), run.results) from error
        except SlaveError as error:
            raise SimulationError(_explained(error, wiring), run.results) from error
        except KeyboardInterrupt:
            time = run.results["time"][-1] if len(run.results) else wiring.start_time
            raise SimulationError(f"Interrupted at {time:.6g} s.", run.results, True) from None
    return run.results


class _Run:
    """The steps of one run, and the rows recorded so far."""

    def __init__(self, steps: Steps, n_steps: int, spacing: float, given: Given | None, memory: Memory) -> None:
        self.exchange: Exchange
        self._loop: InPython | InC
        self._steps, self._n_steps, self._spacing, self._given, self._memory = steps, n_steps, spacing, given, memory
        self._rows = np.zeros(0, [("time", np.float64)])

    @property
    def results(self) -> NDArray[Any]:
        """The rows recorded so far, with what was fed."""
        return with_fed(self._rows[: self._memory.watch.recorded], self._given)

    def begin(self, exchange: Exchange, in_numpy: bool) -> None:
        """Take the slaves through their initialization, and record the first row."""
        self.exchange = exchange
        loop = None if in_numpy else in_c(exchange, self._steps, self._memory.watch)
        self._loop = loop or InPython(exchange, self._steps, self._memory.watch)
        initialize(exchange, self._loop, self._steps.start_time, self._values(0, 1))
        rows = self._memory.rows(rows_after(self._n_steps, self._spacing) + 1, exchange.dtype)
        self._loop.begin(rows[:1])
        self._rows = rows

    def take_steps(self, progress: Progress, interrupted: list[int]) -> None:
        """Take all steps, a batch at a time."""
        shown = iter(progress(range(self._n_steps)))
        batch, done = 1, 0
        while done < self._n_steps:
            if interrupted or self._memory.watch.stop:
                raise KeyboardInterrupt
            begin, end = perf_counter(), min(done + batch, self._n_steps)
            rows = self._rows[rows_after(done, self._spacing) + 1 : rows_after(end, self._spacing) + 1]
            self._loop.run(done, end - done, self._values(done, end), self._spacing, rows)
            deque(islice(shown, end - done), maxlen=0)
            batch, done = (2 * batch if perf_counter() - begin < _BATCH else max(batch // 2, 1)), end
            batch = min(batch, _MOST_GIVEN) if self._given else batch
        next(shown, None)  # its end

    def _values(self, first: int, end: int) -> NDArray[np.float64] | None:
        """Return what is fed from outside at the beginning of some steps, a row a step."""
        if self._given is None:
            return None
        times = self._steps.start_time + np.arange(first, end, dtype=np.float64) * self._steps.step
        return self._given.at(times)


def initialize(
    exchange: Exchange, loop: InPython | InC, start_time: float, given: NDArray[np.float64] | None = None
) -> None:
    """Take the slaves through their initialization, with the values that the links hand on."""
    for slave in exchange.slaves:
        slave.call("setupExperiment", startTime=start_time)
        slave.call("enterInitializationMode")
    if unsettled := loop.settle(given):
        why = f"{', '.join(unsettled[:3])} still change{'s' if len(unsettled) == 1 else ''}"
        what = f"The initial values do not settle: {why}, in a loop of connections or on their own."
        raise SimulationError(what, np.empty(0))
    for slave in exchange.slaves:
        slave.call("exitInitializationMode")


def _explained(error: SlaveError, wiring: Wiring) -> str:
    """Return what went wrong, after the element and the time, in words."""
    when = "" if error.step is None else f"At {wiring.start_time + error.step * wiring.step_size:.9g} s: "
    return f"{error.slave.element.name}: {when}{error}"
