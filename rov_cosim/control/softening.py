"""What a current takes from the stiffness in yaw.

A vehicle that yaws while it is held in place meets the current from another side: the drag turns with it, and the added
mass adds the Munk moment. Its loads pull from another side too. And where roll and pitch are free they follow, because
thrusters and loads have levers about them. All of that is the wrench that the thrusters need. What the law commands
turns with the vehicle as well, as it takes what it has learned for: the drag is no force that stands at a point of
attack, though it is learned as one. With what is left over, a yaw psi is driven further by

    K_s = d/dpsi [N_commanded(eta) - N_needed(eta)],    eta = (place, phi(psi), theta(psi), psi)

in N m/rad, without any error; roll and pitch are those at which nothing turns the vehicle about them. So the yaw is
held only if the law's stiffness is more than K_s, by what its integral needs (Hurwitz). A body's yaw follows slowly
enough for roll and pitch to be taken as at rest.

What is learned is reached from nothing: among all estimates that give the wrench needed, that which the law reaches by
an error. In the adaptive law it is Gamma W^T (W Gamma W^T)^-1 of it, for eq. 5 leads nowhere else (Hoang & Kreuzer
2007), in a PID controller it is the integral.
"""

from copy import copy
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..components.interface import Sampled
from ..components.rov_plant import COMPONENT as ROV_PLANT
from ..components.rov_plant import equations as vehicle
from ..components.vehicle import allocation_matrix, degrees_of_freedom, restoring

Vector = NDArray[np.float64]

HEADINGS = 8
"""Directions of the current that are tried; between them K_s is some hundredths of it more."""

_YAW, _TILT, _TURN, _ERROR = 5, slice(3, 5), 1e-4, 1e-4


def softening(law: Sampled, p_law: SimpleNamespace, p: SimpleNamespace, speed: float) -> float:
    """Return K_s in N m/rad in a current of a speed in m/s, of that of `HEADINGS` in which it is largest.

    Parameters
    ----------
    law : the controller; its parameters are p_law. What it learns is learned without thrusters' limits.
    p : parameters of the vehicle and its loads.

    inf if no rest of roll and pitch is found in a direction. What is found far from level may be one upside down.
    """
    unlimited = copy(p_law)
    unlimited.thrust_max = 0.0
    turns = np.arange(HEADINGS) * 2 * np.pi / HEADINGS
    held = (_Held(law, unlimited, p, speed * np.array([np.cos(turn), np.sin(turn), 0.0])) for turn in turns)
    return max(one.softening() for one in held)


class _Held:
    """A vehicle at the origin in a current, in m/s in the earth frame, that a law holds there."""

    def __init__(self, law: Sampled, p_law: SimpleNamespace, p: SimpleNamespace, current: Vector) -> None:
        self._law, self._p_law, self._p = law, p_law, p
        self._u = ROV_PLANT.u.unpack(ROV_PLANT.u.start.copy())
        self._u.current = current
        self._controlled = np.asarray(degrees_of_freedom(p_law.control_roll_pitch)) > 0
        B = np.asarray(allocation_matrix(p.thruster_r, p.thruster_d, p.thruster_enabled))
        self._allocated = B @ np.linalg.pinv(B[self._controlled])

    def softening(self) -> float:
        """Return K_s in N m/rad; inf if the vehicle has no rest."""
        rest = self._pose(0.0, np.zeros(2))
        if rest is None:
            return np.inf
        x = self._learned(rest)
        left_over = []
        for psi in (_TURN, -_TURN):
            eta = self._pose(psi, rest[_TILT])
            if eta is None:
                return np.inf
            left_over.append((self._commanded(x, eta) - self._needed(eta))[_YAW])
        return float(left_over[0] - left_over[1]) / (2 * _TURN)

    def _needed(self, eta: Vector) -> Vector:
        """Return the wrench, shape (6,), that holds the vehicle still."""
        p = self._p
        return np.asarray(restoring(eta, p.mass, p.g, p.r_G, p.r_B) - vehicle.disturbance(eta, self._u, p))

    def _pose(self, psi: float, tilt: Vector) -> Vector | None:
        """Return the pose at a yaw with roll and pitch at rest, sought from a tilt; None if there is none."""
        if self._p.lock_roll_pitch or self._controlled.all():
            return np.array([0.0, 0.0, 0.0, 0.0, 0.0, psi])
        from scipy.optimize import root  # takes long to load

        def unmet(tilt: Vector) -> Vector:
            needed = self._needed(np.array([0.0, 0.0, 0.0, *tilt, psi]))
            return (needed - self._allocated @ needed[self._controlled])[_TILT]

        found = root(unmet, tilt)
        return np.array([0.0, 0.0, 0.0, *found.x, psi]) if found.success else None

    def _learned(self, eta: Vector) -> Vector:
        """Return the law's state that commands at a pose, without an error, what is needed there."""
        x = np.asarray(self._law.x.pack(self._law.initial_state(self._p_law)), dtype=float)
        without, bare = self._sampled(x, eta)
        errors = _ERROR * np.eye(6)[self._controlled]
        ways = np.stack([self._sampled(x, eta, error)[0] - without for error in errors])
        by_way = np.stack([self._commanded(x + way, eta) - bare for way in ways], axis=1)[self._controlled]
        short = (self._needed(eta) - bare)[self._controlled]
        return x + np.linalg.lstsq(by_way, short, rcond=None)[0] @ ways

    def _commanded(self, x: Vector, eta: Vector) -> Vector:
        return self._sampled(x, eta)[1]

    def _sampled(self, x: Vector, eta: Vector, error: Any = 0.0) -> tuple[Vector, Vector]:
        """Return the state after a sample at a pose, and the wrench that is demanded."""
        u = self._law.u.unpack(self._law.u.start.copy())
        u.eta_m, u.eta_d, u.eta_m_valid = eta, eta - error, 1.0
        after, outputs = self._law.sample(self._law.x.unpack(x), u, self._p_law, np.zeros(self._law.draws))
        return np.asarray(self._law.x.pack(after), dtype=float), np.asarray(outputs["tau"], dtype=float)
