"""A loop of components, stepped and linearised by their own functions: no FMU, and no second copy of a law.

The loop is the master's by Jacobi: all outputs are handed on, then all components advance by a step. Its state is the
states and outputs of all components, the delay line of the sensor among them.

Left out is what has no slope: noise, drift, lost samples, steps of what is read, dead band and limits of the thrusters
(`IDEAL`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..components import stepping
from ..components.interface import Component, Sampled
from ..errors import UserError

Matrix = NDArray[np.float64]

IDEAL = {
    "noise_std": 0.0,
    "noise_std_angle": 0.0,
    "length_noise_std": 0.0,
    "angle_noise_std": 0.0,
    "attitude_noise_std": 0.0,
    "attitude_drift_std": 0.0,
    "attitude_drift_time": 1e-3,
    "length_resolution": 0.0,
    "attitude_resolution": 0.0,
    "encoder_counts": 0.0,
    "dropout": 0.0,
    "current_std": 0.0,
    "thruster_dead_band": 0.0,
    "thrust_max": 0.0,
}
"""Values by the key of a parameter, in every component that has it."""

DIFFERENCE = 1e-6
"""Half of the central difference, in the unit of each state and input."""

FIXED = 1e-9
"""Change in a step, in the unit of a state, below which it stands still."""

WARM_UP = 15
"""Steps that fill the arm's delay line and start the filters, while the vehicle is kept in place."""

_PSEUDO_STEPS, _CHORD = (1e2, 1e3, 1e5, 1e8, 1e8), 12
"""How far each linearisation goes on the way to the equilibrium, in steps of the loop by implicit Euler, and how often.

Newton's method alone would take a vehicle that is free to tilt too far at once.
"""


class LoopError(UserError):
    """The loop cannot be linearised; the message says why."""


class Port(NamedTuple):
    """A scalar output or input: element and place in its flat vector."""

    element: str
    place: int


@dataclass(frozen=True)
class Loop:
    """Components in a loop.

    Parameters
    ----------
    components : by element.
    parameters, inputs : flat vectors by element; of the inputs those that nothing feeds count.
    links : from an output to an input, with a factor.
    step : communication step in s.
    """

    components: Mapping[str, Component]
    parameters: Mapping[str, Matrix]
    inputs: Mapping[str, Matrix]
    links: tuple[tuple[Port, Port, float], ...]
    step: float

    def p(self, element: str) -> SimpleNamespace:
        """Return the parameters of an element as its equations see them."""
        return self.components[element].p.unpack(self.parameters[element])

    def with_keys(self, values: Mapping[str, Any]) -> "Loop":
        """Return the loop with other values, by key, in all components that have such a parameter."""
        return replace(self, parameters={name: self._changed(name, values) for name in self.components})

    def sampled_every(self, period: float) -> "Loop":
        """Return the loop with another sample time of all that is sampled, and of the coupling."""
        periods = {c.period: period for c in self.components.values() if isinstance(c, Sampled)}
        return replace(self.with_keys(periods), step=period)

    def element_with(self, key: str) -> str:
        """Return the element that has an input of a key; LoopError if there is none."""
        for name, component in self.components.items():
            if key in {signal.key for signal in component.inputs}:
                return name
        raise LoopError(f"No element has an input {key}: this is not a loop of a vehicle, a controller and an arm.")

    @property
    def controller(self) -> str:
        """The element that receives the measured pose."""
        return self.element_with("eta_m")

    @property
    def law(self) -> Sampled:
        """The component that the controller is."""
        component = self.components[self.controller]
        assert isinstance(component, Sampled)
        return component

    @property
    def plant(self) -> str:
        """The element that receives the thruster commands."""
        return self.element_with("u")

    def ports(self, element: str, layout: str, key: str) -> NDArray[np.intp]:
        """Return the places of a signal in the flat vector "x", "u", "y" or "p" of an element."""
        of = getattr(self.components[element], layout)
        marked = of.unpack(np.arange(of.size))
        return np.ravel(getattr(marked, key)).astype(np.intp)

    @cached_property
    def moving(self) -> tuple[str, ...]:
        """The elements that something feeds; a source, as a scenario is, stands as it starts."""
        fed = {target.element for _, target, _ in self.links}
        return tuple(name for name in self.components if name in fed)

    def places(self) -> dict[tuple[str, str], slice]:
        """Return where the state holds the states, "x", and outputs, "y", of each element."""
        found, size = {}, 0
        for name, component in self.components.items():
            for part, n in (("x", component.x.size), ("y", component.y.size)):
                found[name, part] = slice(size, size + n)
                size += n
        return found

    def start(self, pose: Matrix | None = None) -> Matrix:
        """Return the state before the first step, of a vehicle at a pose; at its own if left out."""
        loop = self if pose is None else self.with_keys({"eta_0": pose, "nu_0": np.zeros(6)})
        x = {n: stepping.initial(c, loop.inputs[n], loop.parameters[n])[0] for n, c in loop.components.items()}
        y = {n: np.zeros(c.y.size) for n, c in loop.components.items()}
        for _ in loop.components:  # outputs depend on inputs along the links, at most once around
            u = loop._fed(y)
            y = {n: stepping.initial(c, u[n], loop.parameters[n])[1] for n, c in loop.components.items()}
        return np.concatenate([part for n in loop.components for part in (x[n], y[n])])

    def stepped(self, z: Matrix, held: tuple[str, ...] = ()) -> Matrix:
        """Return the state after a communication step in which some elements are held."""
        at, after = self.places(), z.copy()
        u = self._fed({name: z[at[name, "y"]] for name in self.components})
        for name in (name for name in self.moving if name not in held):
            after[at[name, "x"]], after[at[name, "y"]] = self._advance(name, z[at[name, "x"]], u[name])
        return after

    def equilibrium(self) -> Matrix:
        """Return a state in which the ideal loop stands still, near the set-point.

        Raises
        ------
        LoopError : there is none within reach.
        """
        loop = self._ideal
        z = loop.start(loop._set_point())
        for _ in range(WARM_UP):
            z = loop.stepped(z, held=(self.plant,))
        with np.errstate(all="ignore"):  # what diverges is told below
            for pseudo_steps in _PSEUDO_STEPS:
                A, B, C = loop.linearised(z)
                if not np.isfinite(A).all():
                    break
                eye = np.eye(len(z))
                # The pseudo-inverse; `pinv` is far slower where numbers are as small as some of these.
                towards = np.linalg.lstsq(A + B @ C - (1 + 1 / pseudo_steps) * eye, eye, rcond=1e-12)[0]
                for _ in range(_CHORD):
                    rest = loop.stepped(z) - z
                    if not np.isfinite(rest).all():
                        break
                    if np.abs(rest).max() < FIXED:
                        return z
                    z = z - towards @ rest
        raise LoopError("No equilibrium was found near the set-point: the loop cannot be linearised there.")

    def linearised(self, z: Matrix) -> tuple[Matrix, Matrix, Matrix]:
        """Return A, B, C of the open ideal loop around a state z, by central differences.

        dz' = A dz + B dw, where w, shape (6,), is the measured pose as the controller receives it, and C dz what it
        would receive: with w = C z the loop is closed.
        """
        loop, at = self._ideal, self.places()
        controller, n = self.controller, len(z)
        received = self.ports(controller, "u", "eta_m")
        A, B, C = np.eye(n), np.zeros((n, 6)), np.zeros((6, n))
        u = loop._fed({name: z[at[name, "y"]] for name in self.components})
        for name in self.moving:
            rows = np.r_[at[name, "x"], at[name, "y"]]
            by_x, by_u = loop._slopes(name, z[at[name, "x"]], u[name])
            A[rows] = 0.0
            A[np.ix_(rows, np.r_[at[name, "x"]])] = by_x
            if name == controller:
                B[rows] = by_u[:, received]
            for source, target, factor in self.links:
                column = at[source.element, "y"].start + source.place
                if target.element == controller and target.place in received:
                    C[np.flatnonzero(received == target.place)[0], column] = factor
                elif target.element == name:
                    A[rows, column] += factor * by_u[:, target.place]
        return A, B, C

    @property
    def _ideal(self) -> "Loop":
        # One internal step of the vehicle: nothing in it is so quick that the linear motion would differ.
        return self.with_keys({**IDEAL, "max_step": self.step})

    def _set_point(self) -> Matrix:
        """Return the pose that the controller is to hold at the start."""
        y = {n: self.start()[self.places()[n, "y"]] for n in self.components}
        pose: Matrix = self._fed(y)[self.controller][self.ports(self.controller, "u", "eta_d")]
        return pose

    def _fed(self, y: Mapping[str, Matrix]) -> dict[str, Matrix]:
        u = {name: inputs.copy() for name, inputs in self.inputs.items()}
        for source, target, factor in self.links:
            u[target.element][target.place] = factor * y[source.element][source.place]
        return u

    def _advance(self, name: str, x: Matrix, u: Matrix) -> tuple[Matrix, Matrix]:
        component, p = self.components[name], self.parameters[name]
        before = stepping.Result(x, np.zeros(component.y.size), 0)
        after = stepping.advance(component, before, u, p, 0.0, 0.0, self.step)
        return after.x, after.y

    def _slopes(self, name: str, x: Matrix, u: Matrix) -> tuple[Matrix, Matrix]:
        """Return how states and outputs after a step follow from the states, and from the inputs, before it.

        Of the inputs only those count that something moving feeds.
        """

        def slope(of: str, i: int) -> Matrix:
            ends = []
            for sign in (1, -1):
                at = {"x": x.copy(), "u": u.copy()}
                at[of][i] += sign * DIFFERENCE
                ends.append(np.concatenate(self._advance(name, at["x"], at["u"])))
            return (ends[0] - ends[1]) / (2 * DIFFERENCE)

        rows = len(x) + self.components[name].y.size
        fed = {
            target.place for source, target, _ in self.links if target.element == name and source.element in self.moving
        }
        none = np.zeros(rows)
        by_x = [slope("x", i) for i in range(len(x))]
        by_u = [slope("u", i) if i in fed else none for i in range(len(u))]
        return np.reshape(by_x, (len(x), rows)).T, np.reshape(by_u, (len(u), rows)).T

    def _changed(self, name: str, values: Mapping[str, Any]) -> Matrix:
        flat = self.parameters[name].copy()
        keys = {signal.key for signal in self.components[name].parameters}
        for key in keys & values.keys():
            flat[self.ports(name, "p", key)] = values[key]
        return flat
