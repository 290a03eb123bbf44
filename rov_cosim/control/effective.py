"""What a controller does near its set-point, asked of its own function: stiffness, damping, integral gains.

Every controller of the loop is there a PID, tau = -K e - K_D nu - K_I int e. Moved and pressed a little it tells each
of them; level and without yaw, where earth and body axes are the same.
"""

from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..components.vehicle import degrees_of_freedom
from .loop import IDEAL, Loop, Matrix

_SMALL = 1e-6
"""Error in m and rad, and speed in m/s and rad/s, in which a controller is linear."""

_SAMPLES = 4


class Gains(NamedTuple):
    """Gains of wrench by pose, each of shape (6, 6); row: wrench, column: pose.

    K_P and K_D act at once. What the estimate has learned of a motion stiffens by `adapted`, which is zero in a PID;
    K_I is what it learns of an error in a second.
    """

    K_P: Matrix
    K_D: Matrix
    adapted: Matrix
    K_I: Matrix

    @property
    def stiffness(self) -> Matrix:
        """K_P and what adaptation adds to it, shape (6, 6)."""
        return self.K_P + self.adapted


def gains(loop: Loop) -> Gains:
    """Return the gains of the controller in a loop."""
    none, unit = np.zeros(6), _SMALL * np.eye(6)
    rest = _told(loop, none, none)
    pressed = [_told(loop, error, none) for error in unit]
    moved = [_told(loop, none, speed) for speed in unit]

    def slope(told: list[SimpleNamespace], key: str) -> Matrix:
        columns = [getattr(one, key) - getattr(rest, key) for one in told]
        return -np.stack(columns, axis=1) / _SMALL

    return Gains(
        slope(pressed, "at_once"), slope(moved, "at_once"), -slope(moved, "learned"), -slope(pressed, "learned")
    )


def _told(loop: Loop, error: ArrayLike, speed: ArrayLike) -> SimpleNamespace:
    """Return the wrench without the estimate, and what the estimate learns in a second, of an error or a speed."""
    ideal = loop.with_keys(IDEAL)
    component, p = loop.law, ideal.p(loop.controller)
    dof = degrees_of_freedom(p.control_roll_pitch)
    p.use_measured_velocity = 1.0
    u = component.u.unpack(component.u.start.copy())
    u.eta_m_valid, u.nu_m = 1.0, np.asarray(speed)
    x = component.x.unpack(np.asarray(component.x.pack(component.initial_state(p)), dtype=float))
    estimates = []
    for k in range(_SAMPLES):
        u.eta_m = k * loop.step * np.asarray(speed)
        u.eta_d = u.eta_m - np.asarray(error)
        after, outputs = component.sample(x, u, p, np.zeros(component.draws))
        x = component.x.unpack(np.asarray(component.x.pack(after), dtype=float))
        estimates.append(dof * np.asarray(outputs["disturbance"]))
    at_once = np.asarray(outputs["tau"]) + estimates[-1]
    return SimpleNamespace(at_once=at_once, learned=(estimates[-1] - estimates[-2]) / loop.step)
