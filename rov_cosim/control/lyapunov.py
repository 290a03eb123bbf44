"""V of the paper's proof, and V' by numbers: how fast it falls in a box of states, by the components' own functions.

For V' the controller is in continuous time, with the velocity that it would measure; forces, current, limits and lags
are off, since V' does not depend on the first and the theorem not on the others. Where the controller turns all six
axes it is the vehicle of six degrees of freedom, for which there is no theorem; else roll and pitch are locked.
"""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from ..components.frames import jacobian_inverse, pose_difference
from ..components.gain_matrices import symmetric
from ..components.interface import Continuous
from ..components.vehicle import COUPLE, FORCES, degrees_of_freedom, mass_matrix
from .effective import gains
from .loop import IDEAL, Loop, LoopError, Matrix

BOX = np.array([2.0, 2.0, 2.0, 0.5, 0.5, np.pi, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
"""Largest error in m and rad, then largest velocity in m/s and rad/s, either way."""

_SCALES = 3.0
"""Decades below the box that are searched too: near the set-point V' has its own worst."""

_AHEAD = 1e-6

_STILL = {
    **IDEAL,
    "forces": 0.0,
    "thruster_time_constant": 0.0,
    "use_measured_velocity": 1.0,
    "filter_time_constant": 1.0,
}


def terms(motion: SimpleNamespace, p: SimpleNamespace, p_law: SimpleNamespace) -> tuple[Any, Any]:
    """Return the two terms of V in J (Hoang & Kreuzer 2007, appendix A): `energy`, and that of the estimate.

    The latter is (theta_hat - theta)^T Gamma^-1 (theta_hat - theta) / 2, of the loads that are adapted.

    Parameters
    ----------
    motion : as the loop has them: eta, nu, eta_d, each of shape (6,), F_umbilical and F_arm, (3,), theta_hat, (10,).
    p, p_law : parameters of the vehicle and of the adaptive law.
    """
    e = degrees_of_freedom(p_law.control_roll_pitch) * pose_difference(motion.eta, motion.eta_d)
    M = mass_matrix(p.mass, p.I, p.r_G, p.added_mass)
    of_motion = energy(e, motion.eta, motion.nu, M, symmetric(p_law.K_P, p_law.K_P_off), p_law.epsilon_0, p_law.alpha)
    forces = p.forces + np.concatenate([np.zeros(1), motion.F_umbilical, motion.F_arm])
    wrong = motion.theta_hat - np.concatenate([forces, np.zeros(len(COUPLE))])
    wrong = np.where(np.logical_and(p_law.Gamma > 0, p_law.adaptation > 0), wrong, 0.0)
    Gamma = p_law.Gamma + np.where(p_law.Gamma > 0, 0.0, 1.0)  # of a load that is not adapted any will do
    n = len(FORCES)
    by_Gamma = np.linalg.solve(symmetric(Gamma[:n], p_law.Gamma_off), wrong[:n])
    return of_motion, (wrong[:n] @ by_Gamma + np.sum(wrong[n:] ** 2 / Gamma[n:])) / 2


def energy(e: Any, eta: Any, nu: Any, M: Any, K_P: Any, epsilon_0: Any, alpha: Any) -> Any:
    """Return V without the term of the estimate, in J, for error e, pose eta and velocity nu, each of shape (6,).

    M is the inertia in body axes, shape (6, 6), and so is K_P: eta'^T M(eta) eta' = nu^T M nu.
    """
    epsilon = epsilon_0 / (1 + alpha * np.sqrt(np.sum(e**2)))
    return nu @ M @ nu / 2 + e @ K_P @ e / 2 + epsilon * e @ jacobian_inverse(eta).T @ M @ nu


class Worst(NamedTuple):
    """The largest V' found, as a share of what damping and stiffness take, and where, and among how many states.

    share is negative if V falls everywhere that was looked at; -1 is what K_P and K_D alone would take.
    """

    share: float
    error: Matrix
    velocity: Matrix
    yaw: float
    states: int


@dataclass(frozen=True)
class Descent:
    """V' of a loop whose controller has epsilon_0 and alpha."""

    loop: Loop

    def __post_init__(self) -> None:
        keys = {signal.key for signal in self.loop.law.parameters}
        if not {"epsilon_0", "alpha", "Gamma"} <= keys:
            raise LoopError(
                f"The theorem is about the adaptive law; {self.loop.law.name} has no epsilon_0, alpha and Gamma."
            )

    def search(self, count: int, seed: int = 1) -> Worst:
        """Return the worst of about `count` states in the box, by differential evolution."""
        from scipy.optimize import differential_evolution  # takes long to load

        share = self._share()
        axes = self.axes
        n = 2 * len(axes) + 3

        def state(v: Matrix) -> tuple[Matrix, Matrix, float]:
            e, nu = np.zeros(6), np.zeros(6)
            e[axes] = 10 ** v[-3] * BOX[axes] * v[: len(axes)]
            nu[axes] = 10 ** v[-2] * BOX[6:][axes] * v[len(axes) : 2 * len(axes)]
            return e, nu, float(v[-1])

        bounds = [(-1, 1)] * (n - 3) + [(-_SCALES, 0)] * 2 + [(-np.pi, np.pi)]
        size = 4
        found = differential_evolution(
            lambda v: -share(*state(v)), bounds, popsize=size, maxiter=max(count // (size * n) - 1, 1), rng=seed, tol=0
        )
        return Worst(-float(found.fun), *state(found.x), int(found.nfev))

    @property
    def axes(self) -> list[int]:
        """The axes that may move, by index."""
        six = self.loop.p(self.loop.controller).control_roll_pitch > 0
        return list(range(6)) if six else [0, 1, 2, 5]

    def _share(self) -> Any:
        """Return V' / (epsilon e^T K_P e + eta'^T K_D eta') as a function of e, nu and the yaw of the set-point."""
        loop = self.loop.with_keys({**_STILL, "lock_roll_pitch": float(len(self.axes) == 4)})
        plant, law, name = loop.components[loop.plant], loop.law, loop.controller
        assert isinstance(plant, Continuous)
        p, p_law = loop.p(loop.plant), loop.p(name)
        u, u_law = plant.u.unpack(plant.u.start.copy()), law.u.unpack(law.u.start.copy())
        x, x_law = plant.x.unpack(plant.x.start.copy()), law.x.unpack(np.asarray(law.x.pack(law.initial_state(p_law))))
        u_law.eta_m_valid = 1.0
        x_law.theta_hat = np.zeros_like(x_law.theta_hat)
        M = np.asarray(mass_matrix(p.mass, p.I, p.r_G, p.added_mass))
        found = gains(self.loop)
        K_P, K_D = found.K_P, found.K_D
        epsilon_0, alpha = float(p_law.epsilon_0), float(p_law.alpha)
        constants = (M, K_P, epsilon_0, alpha)

        def share(e: Matrix, nu: Matrix, yaw: float) -> float:
            set_point = np.array([0, 0, 0, 0, 0, yaw])
            x.eta, x.nu = set_point + e, nu
            u_law.eta_m, u_law.nu_m, u_law.eta_d = x.eta, nu, set_point
            x_law.eta = x.eta
            u.u = x.thrust = law.sample(x_law, u_law, p_law, np.zeros(law.draws))[1]["u"]
            after = plant.advance(x, u, p, _AHEAD)
            rise = energy(after["eta"] - set_point, after["eta"], after["nu"], *constants) - energy(
                e, x.eta, nu, *constants
            )
            eta_dot = np.linalg.solve(jacobian_inverse(x.eta), nu)
            epsilon = epsilon_0 / (1 + alpha * np.linalg.norm(e))
            return float(rise / _AHEAD / (epsilon * e @ K_P @ e + eta_dot @ K_D @ eta_dot))

        return share
