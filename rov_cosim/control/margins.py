"""What a sampled loop has to spare: modes, gain, phase and delay margins, and what noise does to its thrusters.

All by the eigenvalues of the linearised loop; a loop is stable while they are inside the unit circle. It is opened at
the measured pose as the controller receives it: in one axis with the others closed, or in all axes at once. What the
loop cannot move, a locked axis or an estimate that nothing teaches, has its eigenvalue at one and is left out.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..components.interface import POSE
from ..components.vehicle import degrees_of_freedom, mass_matrix
from .loop import FIXED, Loop, Matrix

SLOWEST = 1e-6
"""Share by which a mode decays in a sample below which it counts as standing still: hours at 30 ms."""

UNSTABLE = 1e-7
"""Excess of an eigenvalue over one that is not rounding."""

MOST_GAIN, MOST_DELAY = 100.0, 128
"""Where the search ends: as a factor, and in samples."""

_RESOLUTION = 2e-3
_FREQUENCIES = 1500
_DOUBLINGS = 24


class Mode(NamedTuple):
    """A mode: eigenvalue z, its frequency in rad/s and damping ratio, time constant in s, and where it shows most."""

    eigenvalue: complex
    frequency: float
    damping: float
    time_constant: float
    axis: str


class Margin(NamedTuple):
    """Factors of the loop's gain, phase in rad at a crossover in rad/s, and further delay in s up to instability.

    gain_up is inf and gain_down 0 where the search ends first, phase and crossover NaN if they have none.
    """

    gain_down: float
    gain_up: float
    delay: float
    phase: float = np.nan
    crossover: float = np.nan


@dataclass(frozen=True)
class Linear:
    """A linearised loop, opened at the measured pose: dz' = A dz + B dw, closed by w = C z.

    Parameters
    ----------
    A, B, C : shapes (n, n), (n, 6), (6, n).
    pose, thrust : how pose and thruster commands follow from z, shapes (6, n) and (8, n).
    step : sample time in s.
    controlled : axes that the controller controls, by index.
    weights : of the axes to compare a mode's motion in them, shape (6,).
    """

    A: Matrix
    B: Matrix
    C: Matrix
    pose: Matrix
    thrust: Matrix
    step: float
    controlled: tuple[int, ...]
    weights: Matrix

    @property
    def closed(self) -> Matrix:
        """A of the closed loop."""
        return self.A + self.B @ self.C

    @property
    def radius(self) -> float:
        """The largest eigenvalue of the closed loop, less what stands still."""
        return radius(self.closed)

    @property
    def is_stable(self) -> bool:
        """Tell whether the loop is stable in the small."""
        return self.radius < 1 + UNSTABLE

    def modes(self) -> list[Mode]:
        """Return the modes, slowest or least stable first; of a pair one, without what stands still."""
        values, vectors = np.linalg.eig(self.closed)
        found = []
        for value, vector in zip(values, vectors.T, strict=True):
            if value.imag < 0 or abs(value - 1) < SLOWEST or abs(value) < 1e-3:
                continue
            rate = np.log(value) / self.step
            shown = np.abs(self.pose @ vector) * self.weights
            damping = -rate.real / abs(rate)
            constant = np.inf if rate.real == 0 else -1 / rate.real
            found.append(Mode(complex(value), abs(rate), damping, constant, POSE[int(np.argmax(shown))]))
        return sorted(found, key=lambda mode: -abs(mode.eigenvalue))

    def margin(self, axis: int) -> Margin:
        """Return the margins of one axis while the others are closed, by its frequency response; of a stable loop."""
        omega = np.geomspace(1e-4, np.pi, _FREQUENCIES) / self.step
        L = self.response(axis, omega)
        size, turned = np.abs(L), np.angle(L)
        gains = [1 / at for at in _where_zero(turned, size)]
        crossovers = list(
            zip(_where_zero(np.log(size), omega), _where_zero(np.log(size), np.unwrap(turned)), strict=True)
        )
        phases = [(left % (2 * np.pi), at) for at, left in crossovers]
        phase, crossover = min(phases, key=lambda pair: pair[0] / pair[1], default=(np.nan, np.nan))
        return Margin(
            max((gain for gain in gains if gain < 1), default=0.0),
            min((gain for gain in gains if gain > 1), default=np.inf),
            phase / crossover if phases else np.inf,
            phase,
            crossover,
        )

    def response(self, axis: int, omega: Matrix) -> NDArray[np.complex128]:
        """Return the response of the loop opened in one axis, at frequencies in rad/s; it is at its limit at one."""
        others = [i for i in range(6) if i != axis]
        A = self.A + self.B[:, others] @ self.C[others]
        z = np.exp(1j * omega * self.step)[:, None, None]
        states = np.linalg.solve(z * np.eye(len(A)) - A, self.B[:, [axis]].astype(complex))
        response: NDArray[np.complex128] = (self.C[axis] @ states)[:, 0]
        return response

    def common_margin(self) -> Margin:
        """Return the margins in all axes at once, by the eigenvalues; of a stable loop."""
        gains, samples = np.geomspace(1, MOST_GAIN, 24), np.array([0.0, *np.geomspace(0.5, MOST_DELAY, 17)])
        up = _last_stable(lambda gain: radius(self.A + gain * self.B @ self.C), gains)
        down = _last_stable(lambda gain: radius(self.A + gain * self.B @ self.C), 1 / gains)
        delay = _last_stable(lambda n: radius(self.delayed(n)), samples)
        return Margin(
            0.0 if down <= 1 / MOST_GAIN else down,
            np.inf if up >= MOST_GAIN else up,
            np.inf if delay >= MOST_DELAY else delay * self.step,
        )

    def delayed(self, samples: float) -> Matrix:
        """Return A of the closed loop with the measured pose later by so many samples, interpolated between them."""
        whole, share = int(samples), samples % 1
        n, line = len(self.A), 6 * (whole + 1)
        A = np.zeros((n + line, n + line))
        A[:n, :n], A[n : n + 6, :n] = self.A, self.C
        A[n + 6 :, n : n + line - 6] = np.eye(line - 6)
        for past, weight in ((whole, 1 - share), (whole + 1, share)):
            if past:
                A[:n, n + 6 * (past - 1) : n + 6 * past] += weight * self.B
            else:
                A[:n, :n] += weight * self.B @ self.C
        return A

    def thrust_noise(self, deviation: Matrix, correlation: float = 0.0) -> Matrix:
        """Return the standard deviation of the thruster commands in N, shape (8,), under noise of the measured pose.

        deviation, shape (6,), is that of the noise; correlation its correlation time in s, 0 for white noise.
        """
        a = np.exp(-self.step / correlation) if correlation > 0 else 0.0
        n = len(self.A)
        A = np.block([[self.closed, self.B], [np.zeros((6, n)), a * np.eye(6)]])
        covariance = np.zeros_like(A)
        covariance[n:, n:] = (1 - a**2) * np.diag(np.square(deviation))
        for _ in range(_DOUBLINGS):  # the sum of A^k Q A^kT, with twice as many terms each time
            covariance, A = covariance + A @ covariance @ A.T, A @ A
        return np.sqrt(np.diag(self.thrust @ covariance[:n, :n] @ self.thrust.T))


def linear(loop: Loop, z: Matrix) -> Linear:
    """Return a loop linearised around an equilibrium, without what stands still or tells nothing."""
    A, B, C = loop.linearised(z)
    pose = _selected(loop, loop.plant, "x", "eta", len(z))
    thrust = _selected(loop, loop.controller, "y", "u", len(z))
    keep = _kept(A, B, np.concatenate([C, pose, thrust]))
    p = loop.p(loop.plant)
    six = degrees_of_freedom(loop.p(loop.controller).control_roll_pitch)
    return Linear(
        A[np.ix_(keep, keep)],
        B[keep],
        C[:, keep],
        pose[:, keep],
        thrust[:, keep],
        loop.step,
        tuple(np.flatnonzero(six).tolist()),
        np.sqrt(np.diag(mass_matrix(p.mass, p.I, p.r_G, p.added_mass))),
    )


def radius(A: Matrix) -> float:
    """Return the largest eigenvalue of A by size, less those that stand still."""
    values = np.linalg.eigvals(A)
    return float(np.abs(values[np.abs(values - 1) > SLOWEST]).max(initial=0.0))


def _selected(loop: Loop, element: str, part: str, key: str, n: int) -> Matrix:
    places = loop.places()[element, part].start + loop.ports(element, part, key)
    chosen: Matrix = np.eye(n)[places]
    return chosen


def _kept(A: Matrix, B: Matrix, C: Matrix) -> NDArray[np.intp]:
    """Return the states that move and that what C tells depends on."""
    keep = np.arange(len(A))
    while True:
        part = A[np.ix_(keep, keep)]
        own = np.eye(len(keep), dtype=bool)
        moves = np.any(np.abs(part - own) > FIXED, axis=1) | np.any(np.abs(B[keep]) > FIXED, axis=1)
        tells = np.any((part != 0) & ~own, axis=0) | np.any(C[:, keep] != 0, axis=0)
        if np.all(moves & tells):
            return keep
        keep = keep[moves & tells]


def _where_zero(y: Matrix, x: Matrix) -> list[float]:
    """Return x, interpolated, where y passes zero, but for where an angle y jumps by a turn."""
    at = np.flatnonzero((np.diff(np.sign(y)) != 0) & (np.abs(np.diff(y)) < np.pi))
    share = y[at] / (y[at] - y[at + 1])
    crossed: list[float] = (x[at] + share * (x[at + 1] - x[at])).tolist()
    return crossed


def _last_stable(radius_of: Callable[[float], float], grid: Matrix) -> float:
    """Return the value up to which a loop stays stable on the way along a grid from its first value, or the last."""
    stable = grid[0]
    for value in grid[1:]:
        if radius_of(value) > 1 + UNSTABLE:
            while abs(value - stable) > _RESOLUTION * max(abs(value), _RESOLUTION):
                middle = (stable + value) / 2
                stable, value = (middle, value) if radius_of(middle) <= 1 + UNSTABLE else (stable, middle)
            return float(stable)
        stable = value
    return float(stable)
