"""What a component declares: its signals with names, units and limits, and the functions that make it run.

A component's equations are pure functions of arrays. They receive one namespace per group of signals: `x` states,
`u` inputs, `p` parameters, each attribute named by the signal's key and shaped as declared. Flat vectors of doubles,
which exporters store and save, are turned into such namespaces and back by `Layout`.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

XYZ = ("x", "y", "z")
POSE = ("x", "y", "z", "phi", "theta", "psi")
VELOCITY = ("u", "v", "w", "p", "q", "r")
WRENCH = ("X", "Y", "Z", "K", "M", "N")
POSE_UNITS = ("m", "m", "m", "rad", "rad", "rad")
VELOCITY_UNITS = ("m/s", "m/s", "m/s", "rad/s", "rad/s", "rad/s")
WRENCH_UNITS = ("N", "N", "N", "N.m", "N.m", "N.m")

Type = Literal["Real", "Integer", "Boolean"]

SAMPLE_TIME = 0.03
"""Sample time of Hoang & Kreuzer 2007 in s, and so the communication step of the systems."""


def count(n: int) -> tuple[str, ...]:
    """Return the labels 1..n of an array's elements."""
    return tuple(str(i) for i in range(1, n + 1))


@dataclass(frozen=True)
class Signal:
    """One quantity, scalar or array, and the scalar variables that it stands for.

    Parameters
    ----------
    key : name under which the equations know it, a Python identifier.
    description : what it is, with frame and sign.
    pattern : name of a scalar element, one ``{}`` per axis; the key if left out.
    axes : labels of the elements along each axis; none for a scalar.
    unit : one of `UNITS`, or one per label of the last axis; empty if dimensionless.
    start : start value, broadcast to the shape.
    minimum, maximum : the closed range of legal values, broadcast to the shape.
    type : FMI type of the elements.
    tunable : whether a parameter may change during a run.
    initially_from : keys of the inputs and parameters on which an output depends in Initialization Mode.
    """

    key: str
    description: str
    pattern: str = ""
    axes: tuple[tuple[str, ...], ...] = ()
    unit: str | tuple[str, ...] = ""
    start: ArrayLike = 0.0
    minimum: ArrayLike = -np.inf
    maximum: ArrayLike = np.inf
    type: Type = "Real"
    tunable: bool = False
    initially_from: tuple[str, ...] = ()

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array that the equations see."""
        return tuple(len(axis) for axis in self.axes)

    @property
    def size(self) -> int:
        """Number of scalar elements."""
        return int(np.prod(self.shape))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the scalar elements in row-major order."""
        return tuple((self.pattern or self.key).format(*labels) for labels in product(*self.axes))

    @property
    def name(self) -> str:
        """Name of the whole: that of its elements without their labels, or the key where nothing is left."""
        return re.sub(r"\[{}]|\.?{}", "", self.pattern) or self.key

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each scalar element."""
        units = np.broadcast_to(np.array(self.unit, dtype=object), self.shape).reshape(-1)
        return tuple(str(unit) for unit in units)

    def elements(self, values: ArrayLike) -> NDArray[np.float64]:
        """Return `values`, broadcast to the shape, as one number for each scalar element."""
        return np.broadcast_to(np.asarray(values, dtype=float), self.shape).reshape(-1)


def vector(key: str, labels: tuple[str, ...], description: str, **declared: Any) -> Signal:
    """Declare a vector with elements ``key.label``."""
    return Signal(key, description, pattern=key + ".{}", axes=(labels,), **declared)


def indexed(key: str, n: int, description: str, **declared: Any) -> Signal:
    """Declare a vector with elements ``key[1]`` to ``key[n]``."""
    return Signal(key, description, pattern=key + "[{}]", axes=(count(n),), **declared)


def switch(key: str, description: str, **declared: Any) -> Signal:
    """Declare a Boolean scalar; the equations see 0.0 or 1.0."""
    return Signal(key, description, type="Boolean", minimum=0, maximum=1, **declared)


class Layout:
    """Order of some signals in one flat vector of doubles."""

    def __init__(self, signals: tuple[Signal, ...]) -> None:
        self.signals = signals
        self.names = tuple(name for signal in signals for name in signal.names)
        self.start = np.concatenate([np.zeros(0), *(signal.elements(signal.start) for signal in signals)])
        self.minimum = np.concatenate([np.zeros(0), *(signal.elements(signal.minimum) for signal in signals)])
        self.maximum = np.concatenate([np.zeros(0), *(signal.elements(signal.maximum) for signal in signals)])
        self._slices: list[tuple[str, slice | int, tuple[int, ...] | None]] = []
        self.size = 0
        for signal in signals:
            where = slice(self.size, self.size + signal.size) if signal.axes else self.size
            self._slices.append((signal.key, where, signal.shape if len(signal.axes) > 1 else None))
            self.size += signal.size

    def unpack(self, flat: Any) -> SimpleNamespace:
        """Return the signals in `flat`, shape (size,), as attributes named by their keys."""
        return SimpleNamespace(
            **{
                key: flat[where] if shape is None else np.reshape(flat[where], shape)
                for key, where, shape in self._slices
            }
        )

    def pack(self, values: Mapping[str, Any]) -> Any:
        """Return the flat vector, shape (size,), of `values` given by key; every signal is needed."""
        if not self.signals:
            return np.zeros(0)
        return np.concatenate([np.reshape(values[signal.key], (-1,)) for signal in self.signals])


@dataclass(frozen=True)
class Requirement:
    """A condition between parameters: it holds where `margin(p)` is positive; the message names the cure."""

    margin: Callable[[SimpleNamespace], Any]
    message: str


@dataclass(frozen=True)
class Notice:
    """A warning, logged once each time the output `key` comes to equal `value`."""

    key: str
    value: float
    message: str


@dataclass(frozen=True, kw_only=True)
class Component:
    """Interface and behaviour of a component.

    Parameters
    ----------
    name : identifier of the component, its folder and its FMU.
    title, description : what it is, in a few words and in a sentence.
    inputs, outputs, parameters, states : its signals; states start at what `initial_state` returns.
    initial_state : ``p -> {state key: value}``.
    requirements : conditions that the parameters must meet together.
    notices : warnings about outputs.
    symbol : two or three letters for its icon.
    """

    name: str
    title: str
    description: str
    symbol: str
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    parameters: tuple[Signal, ...]
    states: tuple[Signal, ...]
    initial_state: Callable[[SimpleNamespace], Mapping[str, Any]]
    requirements: tuple[Requirement, ...] = ()
    notices: tuple[Notice, ...] = ()

    @cached_property
    def u(self) -> Layout:
        """Layout of the inputs."""
        return Layout(self.inputs)

    @cached_property
    def y(self) -> Layout:
        """Layout of the outputs."""
        return Layout(self.outputs)

    @cached_property
    def p(self) -> Layout:
        """Layout of the parameters."""
        return Layout(self.parameters)

    @cached_property
    def x(self) -> Layout:
        """Layout of the states."""
        return Layout(self.states)

    def unmet(self, p: SimpleNamespace) -> list[str]:
        """Return the message of each requirement that the parameters do not meet."""
        with np.errstate(all="ignore"):
            return [one.message for one in self.requirements if not one.margin(p) > 0]


@dataclass(frozen=True, kw_only=True)
class Continuous(Component):
    """A component that is integrated over each communication step, with its inputs held.

    Parameters
    ----------
    advance : ``(x, u, p, h) -> {state key: value}`` after one internal step of length h.
    outputs_of : ``(x, u, p) -> {output key: value}``.
    max_step : key of the parameter with the longest internal step in s.
    """

    advance: Callable[[SimpleNamespace, SimpleNamespace, SimpleNamespace, Any], Mapping[str, Any]]
    outputs_of: Callable[[SimpleNamespace, SimpleNamespace, SimpleNamespace], Mapping[str, Any]]
    max_step: str = "max_step"


@dataclass(frozen=True, kw_only=True)
class Sampled(Component):
    """A component that reads its inputs at k * period and holds its outputs until the next sample.

    Parameters
    ----------
    sample : ``(x, u, p, w) -> ({state key: value}, {output key: value})``, w standard normal draws of shape (draws,).
    period : key of the parameter with the time between samples in s.
    draws : number of standard normal draws a sample.
    seed : key of the Integer parameter, at least 0, that selects the draws; empty without draws.
    """

    sample: Callable[
        [SimpleNamespace, SimpleNamespace, SimpleNamespace, Any], tuple[Mapping[str, Any], Mapping[str, Any]]
    ]
    period: str = "sample_time"
    draws: int = 0
    seed: str = ""
