"""One running copy of a component: its values, its clock, its checks, save and restore. No FMI in here.

Values are doubles in one vector ordered [inputs, outputs, parameters]; a variable's index in it is its value reference.
"""

import struct
from collections.abc import Callable, Sequence
from enum import IntEnum
from hashlib import sha256
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from . import stepping
from .interface import Component, Layout
from .stepping import Result, Vector

TIME_TOLERANCE = 1e-9
"""Tolerance on the communication point, relative to the time since the start, at least in s; also the shortest step."""

MOST_INTERNAL_STEPS = 1_000_000
"""Internal steps or samples that one step may take; more would look like a hang."""

STATE_VERSION = 3
"""Version of a saved state; raised whenever its form changes."""

_HEADER = struct.Struct("<16sI")
_FLAGS_AND_CLOCK = 8


class Phase(IntEnum):
    """Where an instance is in its life."""

    INSTANTIATED = 0
    INITIALIZING = 1
    RUNNING = 2
    TERMINATED = 3


class ComponentError(ValueError):
    """Input that a component refuses; the message names the thing and the cure. The instance is as before."""

    def __repr__(self) -> str:
        return str(self)  # what pythonfmu hands to the FMU's logger


class Instance:
    """A component at work.

    Parameters
    ----------
    component : what runs.
    warn : called with a message for each notice of the component.
    """

    def __init__(self, component: Component, warn: Callable[[str], None] = lambda message: None) -> None:
        self.component = component
        self._warn = warn
        layout = Layout(component.inputs + component.outputs + component.parameters)
        self._names, self._minimum, self._maximum = layout.names, layout.minimum, layout.maximum
        n_u, n_y = component.u.size, component.y.size
        self._outputs = slice(n_u, n_u + n_y)
        self._values = layout.start
        self._u, self._y, self._p = self._values[:n_u], self._values[self._outputs], self._values[n_u + n_y :]
        tunable = [signal.tunable for signal in component.parameters for _ in signal.names]
        self._is_fixed = np.concatenate([np.zeros(n_u + n_y, dtype=bool), ~np.array(tunable, dtype=bool)])
        self._x = np.zeros(component.x.size)
        self.phase = Phase.INSTANTIATED
        self.time = self._start_time = 0.0
        self._skew = 0.0  # of the host's clock: what its times are off by, beyond the rounding of doubles
        self._stop_time = np.inf
        self._samples = 0
        self._stale = True
        self._unchecked = True
        # A saved state fits this interface alone: its names, in this order.
        names = "\n".join((str(STATE_VERSION), component.name, *layout.names, *component.x.names))
        self._fingerprint = sha256(names.encode()).digest()[:16]

    def set(self, references: Sequence[int], values: Sequence[float]) -> None:
        """Set inputs or parameters; all of them, or none if one is refused.

        Raises
        ------
        ComponentError : a value is not finite or out of its range, an output or a fixed parameter is set, or the run
            is over.
        """
        if self.phase is Phase.TERMINATED:
            raise ComponentError("Values can be set only until the run ends; the component is terminated.")
        index, new = np.asarray(references, dtype=np.intp), np.asarray(values, dtype=float)
        bad = ~self._legal(new, index)
        if bad.any():
            raise ComponentError(self._range_message(int(index[bad][0]), float(new[bad][0])))
        if (is_output := self._is_output(index)).any():
            name = self._names[index[is_output][0]]
            raise ComponentError(f"{name} is an output: only inputs and parameters can be set.")
        if self.phase >= Phase.RUNNING and self._is_fixed[index].any():
            name = self._names[index[self._is_fixed[index]][0]]
            raise ComponentError(f"{name} is a fixed parameter: set it before the initialization ends.")
        self._values[index] = new
        self._stale = True
        self._unchecked |= bool((index >= self._outputs.stop).any())

    def get(self, references: Sequence[int]) -> list[float]:
        """Return values; before the first step the outputs follow from the inputs and parameters set so far.

        Raises
        ------
        ComponentError : the parameters are inconsistent, or yield initial values out of range.
        """
        index = np.asarray(references, dtype=np.intp)
        if self.phase < Phase.RUNNING and self._stale and self._is_output(index).any():
            self._preview()
        values: list[float] = self._values[index].tolist()
        return values

    def set_times(self, start: float, stop: float = np.inf) -> None:
        """Take the times in s at which the run starts, 0 if never set, and beyond which no step may go."""
        self._expect(Phase.INSTANTIATED, "The times of the run can be set")
        if not (np.isfinite(start) and stop >= start):
            raise ComponentError(
                f"The run is from {start:.9g} s to {stop:.9g} s; expected finite times, the stop not before the start."
            )
        self.time = self._start_time = float(start)
        self._stop_time = float(stop)

    def enter_initialization(self) -> None:
        """Begin the initialization."""
        self._expect(Phase.INSTANTIATED, "The initialization can begin")
        self.phase = Phase.INITIALIZING

    def exit_initialization(self) -> None:
        """Fix the initial state from the parameters and end the initialization."""
        self._expect(Phase.INITIALIZING, "The initialization can end")
        self._x = self._preview()
        self.phase = Phase.RUNNING
        self._notify(np.full_like(self._y, np.nan))

    def do_step(self, time: float, step: float) -> None:
        """Advance from `time` to `time + step` in s with the inputs held.

        A host that keeps time in single precision rounds each `time`: taken within `leeway`. The clock here then goes
        on by the steps, so that each has its samples, and expects the next step where the host's clock will be. No step
        may end beyond the stop time by both clocks; within `leeway` it may where the host's clock has been rounded.

        Raises
        ------
        ComponentError : the step is not positive, far too long or goes beyond the stop time, the time is not where the
            last step ended, the parameters are inconsistent, or the result leaves its range. The state is then that
            before the step.
        """
        self._expect(Phase.RUNNING, "A step can be taken")
        expected = self.time + self._skew
        rounding = TIME_TOLERANCE * max(1.0, self.time - self._start_time) + 4 * np.spacing(abs(self.time))
        tolerance = max(rounding, stepping.leeway(expected, step))
        if not abs(time - expected) <= tolerance < np.inf:
            raise ComponentError(f"Expected the communication point {expected:.9g} s but was {time:.9g} s.")
        if not (step > 0 and np.isfinite(time + step)):
            raise ComponentError(f"The step size is {step:g} s; expected a positive number of seconds.")
        begin = time - self._skew if abs(time - expected) <= rounding else self.time
        if min(begin, time) + step > self._stop_time + (rounding if begin == time else tolerance):
            raise ComponentError(
                f"The step ends at {time + step:.9g} s; expected at most the stop time {self._stop_time:.9g} s."
            )
        self._check_parameters()
        if step >= TIME_TOLERANCE:
            before = Result(self._x, self._y.copy(), self._samples)
            n = stepping.internal_steps(self.component, before, self._p, self._start_time, begin, step)
            if not n <= MOST_INTERNAL_STEPS:
                raise ComponentError(
                    f"The step of {step:g} s takes {n:.3g} internal steps; expected at most {MOST_INTERNAL_STEPS}: "
                    "take a shorter one."
                )
            with np.errstate(all="ignore"):  # what diverges is caught below, with a message
                after = stepping.advance(self.component, before, self._u, self._p, self._start_time, begin, step)
            self._check_result(after.x, after.y, f"The step from {time:.9g} s failed")
            self._x, self._y[:], self._samples = after
            self._notify(before.y)
        self._skew = time - begin
        self.time = begin + step

    def terminate(self) -> None:
        """End the run; values stay readable. Once more is no harm."""
        if self.phase is not Phase.TERMINATED:
            self._expect(Phase.RUNNING, "The run can be terminated")
            self.phase = Phase.TERMINATED

    def save(self) -> bytes:
        """Return all that the rest of the run depends on."""
        flags = (float(self.phase), float(self._stale), float(self._unchecked))
        clock = (self.time, self._skew, self._start_time, self._stop_time, float(self._samples))
        content = np.concatenate([flags, clock, self._x, self._values]).astype("<f8").tobytes()
        return _HEADER.pack(self._fingerprint, crc32(content)) + content

    def restore(self, state: bytes) -> None:
        """Return to a state that `save` returned, of this or of another instance of the component.

        Raises
        ------
        ComponentError : the bytes are not such a state.
        """
        size = _HEADER.size + 8 * (_FLAGS_AND_CLOCK + self._x.size + self._values.size)
        if len(state) != size:
            raise ComponentError(f"The saved state has {len(state)} bytes; expected {size}.")
        fingerprint, checksum = _HEADER.unpack(state[: _HEADER.size])
        if fingerprint != self._fingerprint:
            raise ComponentError("The saved state is of another component, or of another version of this one.")
        if checksum != crc32(state[_HEADER.size :]):
            raise ComponentError("The saved state is damaged: it is not what this component has saved.")
        content = np.frombuffer(state[_HEADER.size :], dtype="<f8")
        phase, stale, unchecked, time, skew, start, stop, samples = content[:_FLAGS_AND_CLOCK].tolist()
        self.phase, self._stale, self._unchecked = Phase(int(phase)), bool(stale), bool(unchecked)
        self.time, self._skew, self._start_time = time, skew, start
        self._stop_time, self._samples = stop, int(samples)
        vector = content[_FLAGS_AND_CLOCK:]
        self._x, self._values[:] = vector[: self._x.size].copy(), vector[self._x.size :]

    def _preview(self) -> Vector:
        """Compute the outputs that the run would start with; return its initial state."""
        self._check_parameters()
        with np.errstate(all="ignore"):
            x, y = stepping.initial(self.component, self._u, self._p)
        self._check_result(x, y, f"The initialization at {self.time:.9g} s failed")
        self._y[:] = y
        self._stale = False
        return x

    def _expect(self, phase: Phase, what: str) -> None:
        if self.phase is not phase:
            raise ComponentError(f"{what} only while {phase.name.lower()}; the component is {self.phase.name.lower()}.")

    def _check_parameters(self) -> None:
        if not self._unchecked:
            return
        if unmet := self.component.unmet(self.component.p.unpack(self._p)):
            raise ComponentError(" ".join(unmet))
        self._unchecked = False

    def _check_result(self, x: Vector, y: Vector, what: str) -> None:
        legal, finite = self._legal(y, self._outputs), np.isfinite(x)
        if legal.all() and finite.all():
            return
        if not legal.all():
            i = int(np.argmin(legal))
            reason = self._range_message(self._outputs.start + i, y[i])
        else:
            i = int(np.argmin(finite))
            reason = f"the state {self.component.x.names[i]} is {x[i]:g}; expected a finite number."
        raise ComponentError(f"{what}: {reason} Check the inputs and parameters, or take a shorter step.")

    def _is_output(self, index: NDArray[np.intp]) -> NDArray[np.bool_]:
        return (index >= self._outputs.start) & (index < self._outputs.stop)

    def _legal(self, values: Vector, where: slice | NDArray[np.intp]) -> NDArray[np.bool_]:
        return np.isfinite(values) & (values >= self._minimum[where]) & (values <= self._maximum[where])

    def _notify(self, previous: Vector) -> None:
        for notice in self.component.notices:
            i = self.component.y.names.index(notice.key)
            if self._y[i] == notice.value and previous[i] != notice.value:
                self._warn(f"At {self.time:.9g} s: {notice.message}")

    def _range_message(self, reference: int, value: float) -> str:
        low, high = self._minimum[reference], self._maximum[reference]
        bounds = [f"at least {low:g}"] if low != -np.inf else []
        bounds += [f"at most {high:g}"] if high != np.inf else []
        range_ = f" of {' and '.join(bounds)}" if bounds else ""
        return f"{self._names[reference]} is {value:g}; expected a finite number{range_}."
