"""What can be said of a loop before it is run: everything that `rov-cosim certify` shows, as numbers."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import brentq

from ..components.frames import pose_difference
from ..components.interface import Sampled
from ..components.vehicle import mass_matrix
from . import theorem
from .effective import Gains, gains
from .loop import Loop, Matrix
from .lyapunov import Descent, Worst
from .margins import UNSTABLE, Linear, Margin, linear
from .softening import softening
from .theorem import AXES, Case, Condition
from .tuning import LOOP_STEPS, estimate_map

LEARNED = 1e-6
"""Singular value of W, over the largest, below which a direction is not learned."""

FASTEST = 1.0
"""Speed in m/s of a current up to which it is sought what the yaw withstands."""

_HALVINGS, _SPEEDS = 4, 11

_NOISE_ALONE = {
    **dict.fromkeys(("encoder_counts", "length_resolution", "attitude_resolution", "attitude_drift_std"), 0.0),
    **dict.fromkeys(("dropout", "delay"), 0.0),
}
"""Values by key that leave of a sensor's errors the noise."""


@dataclass(frozen=True)
class Certificate:
    """A loop and what follows from it; each property is computed when it is asked for.

    Parameters
    ----------
    name : of the system.
    loop : the loop, with its noise and limits.
    """

    name: str
    loop: Loop

    @cached_property
    def equilibrium(self) -> Matrix:
        """The state in which the loop stands still."""
        return self.loop.equilibrium()

    @cached_property
    def linear(self) -> Linear:
        """The loop around its equilibrium."""
        return linear(self.loop, self.equilibrium)

    @cached_property
    def level(self) -> Linear:
        """The same with roll and pitch locked if the controller leaves them alone: the paper's four axes."""
        return linear(self._level_loop, self._level_rest) if self.tilts else self.linear

    @property
    def tilts(self) -> bool:
        """Tell whether the vehicle is free in roll and pitch and the controller leaves them alone."""
        free = not self.loop.p(self.loop.plant).lock_roll_pitch
        return bool(free and not self.loop.p(self.loop.controller).control_roll_pitch)

    @property
    def _level_loop(self) -> Loop:
        return self.loop.with_keys({"lock_roll_pitch": 1.0}) if self.tilts else self.loop

    @cached_property
    def _level_rest(self) -> Matrix:
        return self._level_loop.equilibrium() if self.tilts else self.equilibrium

    @property
    def pose(self) -> Matrix:
        """Pose at rest, shape (6,)."""
        at = self.loop.places()[self.loop.plant, "x"].start + self.loop.ports(self.loop.plant, "x", "eta")
        pose: Matrix = self.equilibrium[at]
        return pose

    @property
    def thrust(self) -> float:
        """The largest thruster force at rest in N."""
        at = self.loop.places()[self.loop.controller, "y"].start
        return float(np.abs(self.equilibrium[at + self.loop.ports(self.loop.controller, "y", "u")]).max())

    @property
    def thrust_max(self) -> float:
        """The limit of a thruster in N, the lesser of what the vehicle has and the controller knows; inf without."""
        limits = [float(self.loop.p(name).thrust_max) for name in (self.loop.plant, self.loop.controller)]
        return min((limit for limit in limits if limit > 0), default=np.inf)

    @cached_property
    def gains(self) -> Gains:
        """What the controller does near the set-point."""
        return gains(self.loop)

    @cached_property
    def current_limit(self) -> float:
        """Speed in m/s of a current up to which the yaw is held; inf: beyond `FASTEST`, nan: not even at 0.

        Of the stiffness K a current leaves K - K_s (`softening`), of which K_D (K - K_s) > m_r K_I is needed (Hurwitz).
        From wherever it comes. To some 20 %: without lags, and of a vehicle that is held in place.
        """
        p, axis = self.loop.p(self.loop.plant), 5  # yaw
        damping = self.gains.K_D[axis, axis] + np.asarray(p.D_linear)[axis]
        integral = self.inertia[axis, axis] * self.gains.K_I[axis, axis] / damping if damping > 0 else 0.0
        stiffness = self.gains.stiffness[axis, axis] - integral

        def left(speed: float) -> float:
            return float(np.clip((stiffness - self.softening(speed)) / abs(stiffness), -1.0, 1.0))

        below, speeds = np.nan, np.linspace(0.0, FASTEST, _SPEEDS)
        for speed in speeds:
            if left(speed) <= 0:
                return float(brentq(left, below, speed, xtol=5e-4)) if speed else np.nan
            below = speed
        return np.inf

    def softening(self, speed: float) -> float:
        """Return K_s, what a current of a speed in m/s takes at most of the stiffness in yaw, in N m/rad."""
        return softening(self.loop.law, self.loop.p(self.loop.controller), self.loop.p(self.loop.plant), speed)

    @property
    def inertia(self) -> Matrix:
        """M about the body origin, shape (6, 6)."""
        p = self.loop.p(self.loop.plant)
        return np.asarray(mass_matrix(p.mass, p.I, p.r_G, p.added_mass))

    @cached_property
    def margins(self) -> dict[int, Margin]:
        """The margins by controlled axis, level; none of an unstable loop."""
        return {axis: self.level.margin(axis) for axis in self.level.controlled} if self.level.is_stable else {}

    @cached_property
    def common_margin(self) -> Margin | None:
        """The margins of all axes at once, level; None for an unstable loop."""
        return self.level.common_margin() if self.level.is_stable else None

    @cached_property
    def largest_sample_time(self) -> float:
        """The sample time in s of arm, controller and coupling up to which the loop is stable, to a few percent."""
        if self.common_margin is None:
            return np.nan
        stable, unstable = self.loop.step, self.loop.step + 2 * self.common_margin.delay / (LOOP_STEPS + 0.5)
        if not np.isfinite(unstable) or self._is_stable_every(unstable):
            return float(unstable)
        for _ in range(_HALVINGS):
            middle = (stable + unstable) / 2
            stable, unstable = (middle, unstable) if self._is_stable_every(middle) else (stable, middle)
        return float(stable)

    def _is_stable_every(self, period: float) -> bool:
        return linear(self._level_loop.sampled_every(period), self._level_rest).radius < 1 + UNSTABLE

    @cached_property
    def thrust_noise(self) -> float:
        """Standard deviation in N of the noisiest thruster's command by the sensor's noise; inf in an unstable loop."""
        if not self.level.is_stable:
            return np.inf
        sensor = next(e for e, c in self.loop.components.items() if "eta_m" in {s.key for s in c.outputs})
        correlation = float(self.loop.p(sensor).noise_correlation_time)
        return float(self.level.thrust_noise(self._pose_noise(sensor), correlation).max())

    def _pose_noise(self, sensor: str) -> Matrix:
        """Return the standard deviation of the measured pose, shape (6,), at rest, to first order in the noise."""
        loop, component = self.loop.with_keys(_NOISE_ALONE), self.loop.components[sensor]
        assert isinstance(component, Sampled)
        p, y = loop.p(sensor), self._level_rest[self.loop.places()[self.loop.plant, "y"]]
        x = component.x.unpack(component.x.pack(component.initial_state(p)))
        u = component.u.unpack(component.u.start.copy())
        u.eta = y[self.loop.ports(self.loop.plant, "y", "eta")]
        poses = [[component.sample(x, u, p, sign * w)[1]["eta_m"] for sign in (1, -1)] for w in np.eye(component.draws)]
        deviation: Matrix = np.linalg.norm([pose_difference(more, less) / 2 for more, less in poses], axis=0)
        return deviation

    @property
    def is_adaptive(self) -> bool:
        """Tell whether the controller is one that the theorem is about, and adapts."""
        keys = {signal.key for signal in self.loop.law.parameters}
        return {"epsilon_0", "alpha", "Gamma"} <= keys and bool(self.gains.adapted.any())

    @cached_property
    def learned(self) -> tuple[int, Matrix, Matrix]:
        """Number of estimated loads, singular values of W by falling size, and their directions of the wrench, (6, n).

        Of the loads whose Gamma is not 0, and of the controlled axes; a length of 1 m makes forces of moments.
        """
        law = self.loop.law
        p = dict(zip(law.p.names, self.loop.parameters[self.loop.controller].tolist(), strict=True))
        W, controlled = estimate_map(law, p)
        W = W[:, np.asarray(self.loop.p(self.loop.controller).Gamma) > 0]
        rows = np.flatnonzero(controlled)
        directions, sizes, _ = np.linalg.svd(W[rows])
        spread = np.zeros((6, len(rows)))
        spread[rows] = directions
        return W.shape[1], np.r_[sizes, np.zeros(len(rows) - len(sizes))], spread

    @cached_property
    def case(self) -> Case:
        """What the theorem takes."""
        p, p_law, axes = self.loop.p(self.loop.plant), self.loop.p(self.loop.controller), list(AXES)
        return Case(
            self.inertia[np.ix_(axes, axes)],
            self.gains.K_P[np.ix_(axes, axes)],
            self.gains.K_D[np.ix_(axes, axes)],
            float(p_law.epsilon_0),
            float(p_law.alpha),
            np.asarray(p.D_linear)[axes],
            np.asarray(p.D_quadratic)[axes],
        )

    @cached_property
    def conditions(self) -> tuple[list[Condition], list[Condition]]:
        """The theorem's conditions, without and with the vehicle's own damping."""
        return theorem.conditions(self.case.undamped), theorem.conditions(self.case)

    def descent(self, states: int) -> Worst:
        """Return the worst V' among about so many states."""
        return Descent(self.loop).search(states)
