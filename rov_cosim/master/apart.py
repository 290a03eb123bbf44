"""A run in a process of its own: an FMU that crashes, ends the process or hangs costs this one process.

The process keeps results and whereabouts in files that this one reads along, so a step costs nothing more. It starts a
fresh interpreter, not a fork: an FMU must not meet the threads of its host half copied.
"""

import json
import os
import pickle
import signal
import subprocess
import sys
import tempfile
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import islice
from pathlib import Path
from threading import Thread
from time import monotonic
from typing import Any

from numpy.typing import NDArray

from ..ssp.checks import problems_of
from ..ssp.wiring import Wiring, WiringError
from .exchange import Coupling, jacobi
from .given import Given, with_fed
from .interrupts import deferred
from .memory import Memory, Watch, seen_rows, seen_watch
from .simulation import Progress, SimulationError, simulate
from .slave import CALLS, TYPES

MOST_WARNINGS = 1000
"""Warnings of a run that are handed on."""
_LOOK = 0.02
"""Time in s between two looks at the process."""
_PATIENCE = 5.0
"""Time in s after which a process that was told to stop is killed."""
_TASK, _OUTCOME, _WARNINGS = "task", "outcome", "warnings"
_STDERR = 2


def simulate_apart(
    wiring: Wiring,
    coupling: Coupling = jacobi,
    stop_time: float | None = None,
    progress: Progress = lambda steps: steps,
    warn: Callable[[str], None] = lambda message: None,
    *,
    timeout: float | None = None,
    **how: Any,
) -> NDArray[Any]:
    """Run a system as `simulate` does, in a process of its own.

    Parameters
    ----------
    timeout : time in s after which a call of an FMU that has not returned ends the run; none if left out.
    how : further arguments of `simulate`, that can be pickled.

    Raises
    ------
    SimulationError : as in `simulate`, and for a process that died or hangs; it holds the results so far.
    WiringError : as in `simulate`.
    """
    wiring = wiring if stop_time is None else replace(wiring, stop_time=stop_time)
    if problems := problems_of(wiring):
        raise WiringError(wiring.name, problems)
    with (
        tempfile.TemporaryDirectory(prefix="rov_cosim_", ignore_cleanup_errors=True) as name,
        deferred() as interrupted,
    ):
        folder = Path(name)
        arguments = {"wiring": wiring, "coupling": coupling, **how}
        (folder / _TASK).write_bytes(pickle.dumps(arguments))
        child = _Child(folder, warn)
        n_steps = max(int((wiring.stop_time - wiring.start_time) / wiring.step_size), 1)
        try:
            shown, seen = iter(progress(range(n_steps))), 0
            while child.is_running:
                child.wait(interrupted, timeout)
                taken = min(child.watch.step, n_steps)
                deque(islice(shown, max(taken - seen, 0)), maxlen=0)
                seen = max(seen, taken)
        finally:
            child.close()
        return child.outcome(wiring, how.get("inputs"))


class _Child:
    """The process that runs the system."""

    def __init__(self, folder: Path, warn: Callable[[str], None]) -> None:
        self._folder, self._warn, self._read = folder, warn, 0
        # Its standard input ends with this process; Ctrl-C is answered here alone; no module is of the user's folder.
        # What an FMU prints goes where warnings go, not between the lines of a table.
        command = [sys.executable, "-P", "-m", __name__, str(folder)]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=_STDERR, start_new_session=True)
        self.watch = Watch()
        self._shared: Watch | None = None
        self._at, self._since = (0, 0, 0, 0), monotonic()
        self._told, self._limit = 0.0, 0.0

    @property
    def is_running(self) -> bool:
        """Whether the process has not ended."""
        return self._process.poll() is None

    def wait(self, interrupted: list[int], timeout: float | None) -> None:
        """Wait a moment, hand warnings on, and end a process that should stop or that hangs."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_LOOK)
        self._look()
        if interrupted:
            self._told = self._told or monotonic()
            self.watch.stop = 1  # at each look, for the process may have begun to look since
        at = self.watch.step, self.watch.slave, self.watch.call, self.watch.variable
        if at != self._at:
            self._at, self._since = at, monotonic()
        if timeout is not None and self.watch.call and monotonic() - self._since > timeout:
            self._limit = timeout
        if self._limit or (self._told and monotonic() - self._told > _PATIENCE):
            self._kill()

    def close(self) -> None:
        """End the process if it has not ended, and take in what it left."""
        self._kill()
        assert self._process.stdin
        self._process.stdin.close()
        self._look()

    def _kill(self) -> None:
        """Kill the process, and what an FMU started in it."""
        if hasattr(os, "killpg"):
            with suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
        self._process.kill()
        self._process.wait()

    def outcome(self, wiring: Wiring, inputs: NDArray[Any] | None) -> NDArray[Any]:
        """Return the results of the process, or raise what it raised, or what it died of."""
        results = seen_rows(self._folder)[: self.watch.recorded]
        if len(results) and inputs is not None:
            results = with_fed(results, Given(inputs, wiring))
        try:
            kind, *details = json.loads((self._folder / _OUTCOME).read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise SimulationError(self._end(wiring), results, bool(self._told)) from None
        if kind == "wiring":
            raise WiringError(*details)
        if kind == "failed":
            raise SimulationError(details[0], results, details[1])
        return results

    def _look(self) -> None:
        with suppress(FileNotFoundError, ValueError):  # not there yet, or not of its size
            self._shared = self._shared or seen_watch(self._folder)
            self.watch = self._shared
        with suppress(FileNotFoundError), (self._folder / _WARNINGS).open(encoding="utf-8") as file:
            file.seek(self._read)
            for line in iter(file.readline, ""):
                if line.endswith("\n"):
                    self._warn(json.loads(line))
                    self._read = file.tell()

    def _end(self, wiring: Wiring) -> str:
        """Return where and how the process ended."""
        watch, code = self.watch, self._process.returncode
        call, name = chr(watch.call), wiring.elements[watch.slave].name
        time = wiring.start_time + watch.step * wiring.step_size
        when = f"At {time:.9g} s: " if watch.recorded else ""
        function = _FUNCTIONS.get(call, "").format(TYPES[watch.type]) or "no call of an FMU"
        if self._limit:
            return f"{name}: {when}{function} does not return within {self._limit:g} s."
        if self._told:
            return f"Interrupted; {name}: {when}{function} did not return within {_PATIENCE:g} s."
        how = f"died of {signal.Signals(-code).name}" if code < 0 else f"ended itself with status {code}"
        return f"{name}: {when}the process {how} in {function}."


_FUNCTIONS = {
    "l": "the loading of its library",
    "i": "fmi2Instantiate",
    **{call: f"fmi2{name[0].upper()}{name[1:]}" for name, call in CALLS.items()},
    "g": "fmi2Get{}",
    "s": "fmi2Set{}",
    "d": "fmi2DoStep",
    "F": "fmi2FreeInstance",
    "u": "the unloading of its library",
}
"""What a process may die in, by `Watch.call`."""


def _run(folder: Path) -> None:
    """Run the task in a folder: what the process does."""
    tempfile.tempdir = str(folder)  # what is unpacked goes with the folder, however this process ends
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=lambda: (sys.stdin.read(), os._exit(1)), daemon=True).start()  # the other process has ended
    told = 0

    def warn(message: str) -> None:
        nonlocal told
        told += 1
        if told <= MOST_WARNINGS:  # opened each time, for an FMU may close what is open
            with (folder / _WARNINGS).open("a", encoding="utf-8") as file:
                file.write(json.dumps(message) + "\n")

    try:
        simulate(**pickle.loads((folder / _TASK).read_bytes()), warn=warn, memory=Memory(folder))
        outcome: list[object] = ["done"]
    except WiringError as error:
        outcome = ["wiring", error.where, error.problems]
    except SimulationError as error:
        outcome = ["failed", str(error), error.is_interrupted]
    if told > MOST_WARNINGS:
        with (folder / _WARNINGS).open("a", encoding="utf-8") as file:
            file.write(json.dumps(f"{told - MOST_WARNINGS} more warnings are not shown.") + "\n")
    (folder / f"{_OUTCOME}.part").write_text(json.dumps(outcome), encoding="utf-8")
    (folder / f"{_OUTCOME}.part").rename(folder / _OUTCOME)
    os._exit(0)  # what an FMU left behind in this process has no say any more


if __name__ == "__main__":
    _run(Path(sys.argv[1]))
