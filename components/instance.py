"""One running copy of a component: its values, its clock, its checks, save and restore. No FMI in here.

Values are doubles in one vector ordered [inputs, outputs, parameters]; a variable's index in it is its value reference.
"""

import struct
from collections.abc import Callable, Sequence
from enum import IntEnum
from hashlib import sha256

import numpy as np
from numpy.typing import NDArray

from .interface import Component, Continuous, Layout, Sampled
from .noise import standard_normal

TIME_TOLERANCE = 1e-9
"""Relative (at least absolute, in s) tolerance on the communication point; shorter steps change nothing."""

_HEADER = struct.Struct("<16s5d2q")


class Phase(IntEnum):
    """Where an instance is in its life."""

    INSTANTIATED = 0
    INITIALIZING = 1
    RUNNING = 2


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
        signals = [(s, s in component.parameters) for s in layout.signals]
        self._is_parameter = np.repeat([is_parameter for _, is_parameter in signals], [s.size for s, _ in signals])
        self._fixed = self._is_parameter & ~np.repeat([s.tunable for s, _ in signals], [s.size for s, _ in signals])
        self._values = layout.start
        n_u, n_y = component.u.size, component.y.size
        self._outputs = slice(n_u, n_u + n_y)
        self._u, self._y, self._p = self._values[:n_u], self._values[self._outputs], self._values[n_u + n_y :]
        self._x = np.zeros(component.x.size)
        self.phase = Phase.INSTANTIATED
        self.time = self._start_time = 0.0
        self._samples = 0
        self._stale = True
        self._unchecked = True
        # A saved state fits this interface alone: its names, in this order.
        self._fingerprint = sha256("\n".join((component.name, *layout.names, *component.x.names)).encode()).digest()[
            :16
        ]

    def set(self, references: Sequence[int], values: Sequence[float]) -> None:
        """Set inputs or parameters; all of them, or none if one is refused.

        Raises
        ------
        ComponentError : a value is not finite or out of its range, an output or a fixed parameter is set.
        """
        index, new = np.asarray(references, dtype=np.intp), np.asarray(values, dtype=float)
        bad = ~((new >= self._minimum[index]) & (new <= self._maximum[index]) & np.isfinite(new))
        if bad.any():
            raise ComponentError(self._range_message(int(index[bad][0]), float(new[bad][0])))
        is_output = (index >= self._outputs.start) & (index < self._outputs.stop)
        if is_output.any():
            raise ComponentError(
                f"{self._names[index[is_output][0]]} is an output: only inputs and parameters can be set."
            )
        if self.phase is Phase.RUNNING and self._fixed[index].any():
            name = self._names[index[self._fixed[index]][0]]
            raise ComponentError(f"{name} is a fixed parameter: set it before the initialization ends.")
        self._values[index] = new
        self._stale = True
        self._unchecked |= bool(self._is_parameter[index].any())

    def get(self, references: Sequence[int]) -> list[float]:
        """Return values; before the first step the outputs follow from the inputs and parameters set so far.

        Raises
        ------
        ComponentError : the parameters are inconsistent.
        """
        if self.phase is not Phase.RUNNING and self._stale:
            self._preview()
        values: list[float] = self._values[np.asarray(references, dtype=np.intp)].tolist()
        return values

    def enter_initialization(self, start_time: float = 0.0) -> None:
        """Begin the initialization of a run that starts at `start_time` in s."""
        if not np.isfinite(start_time):
            raise ComponentError(f"The start time is {start_time}; expected a finite number of seconds.")
        self.time = self._start_time = float(start_time)
        self.phase = Phase.INITIALIZING

    def exit_initialization(self) -> None:
        """Fix the initial state from the parameters and end the initialization."""
        self._preview()
        self._x = self._initial_state()
        self.phase = Phase.RUNNING
        self._samples = 0
        self._notify(np.full_like(self._y, np.nan))

    def do_step(self, time: float, step: float) -> None:
        """Advance from `time` to `time + step` in s with the inputs held.

        Raises
        ------
        ComponentError : the step is not positive, the time is not where the last step ended, the parameters are
            inconsistent, or the result leaves its range. The state is then that before the step.
        """
        if self.phase is not Phase.RUNNING:
            raise ComponentError(
                "A step was asked for before the initialization ended: exit Initialization Mode first."
            )
        tolerance = TIME_TOLERANCE * max(1.0, abs(self.time))
        if not abs(time - self.time) <= tolerance:
            raise ComponentError(f"Expected the communication point {self.time:.9g} s but was {time:.9g} s.")
        if not 0 < step < np.inf:
            raise ComponentError(f"The step size is {step:g} s; expected a positive number of seconds.")
        self._check_parameters()
        if step < TIME_TOLERANCE:
            return
        if isinstance(self.component, Sampled):
            x, y, samples = self._sampled(self.component, time + step - tolerance)
        else:
            x, y, samples = self._integrated(self.component, step)
        legal = np.isfinite(y) & (y >= self._minimum[self._outputs]) & (y <= self._maximum[self._outputs])
        if not legal.all() or not np.isfinite(x).all():
            i = int(np.argmin(legal))
            raise ComponentError(
                f"The step from {time:.9g} s failed: "
                + self._range_message(self._outputs.start + i, y[i])
                + " Check the inputs and parameters, or take a shorter step."
            )
        previous = self._y.copy()
        self._x, self._y[:], self._samples, self.time = x, y, samples, time + step
        self._notify(previous)

    def save(self) -> bytes:
        """Return all that the rest of the run depends on."""
        flags = (float(self.phase), float(self._stale), float(self._unchecked))
        header = _HEADER.pack(self._fingerprint, *flags, self.time, self._start_time, self._samples, self._x.size)
        return header + np.concatenate([self._x, self._values]).astype("<f8").tobytes()

    def restore(self, state: bytes) -> None:
        """Return to a state that `save` returned, of this or of another instance of the component.

        Raises
        ------
        ComponentError : the bytes are not such a state.
        """
        size = _HEADER.size + 8 * (self._x.size + self._values.size)
        if len(state) != size or state[:16] != self._fingerprint:
            raise ComponentError(
                f"The saved state of {len(state)} bytes is not one of this component; expected {size} bytes that this "
                f"version of {self.component.name} has saved."
            )
        _, phase, stale, unchecked, time, start, samples, _ = _HEADER.unpack(state[: _HEADER.size])
        vector = np.frombuffer(state[_HEADER.size :], dtype="<f8")
        if (
            phase not in tuple(Phase)
            or not np.isfinite([time, start]).all()
            or not np.isfinite(vector).all()
            or samples < 0
        ):
            raise ComponentError("The saved state is damaged: it holds values that this component never saves.")
        self.phase, self._stale, self._unchecked = Phase(int(phase)), bool(stale), bool(unchecked)
        self.time, self._start_time, self._samples = time, start, samples
        self._x, self._values[:] = vector[: self._x.size].copy(), vector[self._x.size :]

    def _preview(self) -> None:
        """Compute the outputs that the run would start with."""
        self._check_parameters()
        x = self._initial_state()
        if isinstance(self.component, Sampled):
            _, self._y[:] = self._sample_once(self.component, x, 0)
        else:
            self._y[:] = self._outputs_at(self.component, x)
        self._stale = False

    def _initial_state(self) -> NDArray[np.float64]:
        component = self.component
        return np.asarray(component.x.pack(component.initial_state(component.p.unpack(self._p))), dtype=float)

    def _sampled(self, component: Sampled, end: float) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
        """Take all samples due before `end`."""
        x, y, samples = self._x, self._y, self._samples
        period = float(getattr(component.p.unpack(self._p), component.period))
        while self._start_time + samples * period < end:
            x, y = self._sample_once(component, x, samples)
            samples += 1
        return x, y, samples

    def _sample_once(
        self, component: Sampled, x: NDArray[np.float64], index: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        p = component.p.unpack(self._p)
        seed = int(getattr(p, component.seed)) if component.seed else 0
        draws = standard_normal(seed, index, component.draws)
        state, outputs = component.sample(component.x.unpack(x), component.u.unpack(self._u), p, draws)
        return np.asarray(component.x.pack(state), dtype=float), np.asarray(component.y.pack(outputs), dtype=float)

    def _integrated(self, component: Component, step: float) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
        """Integrate over `step` in internal steps of the longest allowed length, the last one shortened."""
        assert isinstance(component, Continuous)
        u, p = component.u.unpack(self._u), component.p.unpack(self._p)
        longest = float(getattr(p, component.max_step))
        whole = int(np.ceil(step / longest * (1 - TIME_TOLERANCE))) - 1
        x = self._x
        with np.errstate(all="ignore"):  # a diverging state is caught by the caller, with a message
            for h in [longest] * whole + [step - whole * longest]:
                x = np.asarray(component.x.pack(component.advance(component.x.unpack(x), u, p, h)), dtype=float)
            y = self._outputs_at(component, x)
        return x, y, self._samples

    def _outputs_at(self, component: Component, x: NDArray[np.float64]) -> NDArray[np.float64]:
        assert isinstance(component, Continuous)
        outputs = component.outputs_of(component.x.unpack(x), component.u.unpack(self._u), component.p.unpack(self._p))
        return np.asarray(component.y.pack(outputs), dtype=float)

    def _check_parameters(self) -> None:
        if not self._unchecked:
            return
        p = self.component.p.unpack(self._p)
        unmet = [r.message for r in self.component.requirements if not r.margin(p) > 0]
        if unmet:
            raise ComponentError(" ".join(unmet))
        self._unchecked = False

    def _notify(self, previous: NDArray[np.float64]) -> None:
        for notice in self.component.notices:
            i = self.component.y.names.index(notice.key)
            if self._y[i] == notice.value and previous[i] != notice.value:
                self._warn(f"At {self.time:.9g} s: {notice.message}")

    def _range_message(self, reference: int, value: float) -> str:
        low, high = self._minimum[reference], self._maximum[reference]
        bounds = ("" if low == -np.inf else f" of at least {low:g}") + (
            "" if high == np.inf else f" and at most {high:g}"
        )
        bounds = bounds if low != -np.inf else bounds.replace(" and", " of")
        return f"{self._names[reference]} is {value:g}; expected a finite number{bounds}."
