"""What Newton's laws make of a plant's declared parameters, term by term: the judge of a plant's signs.

Written by momenta and cross products (Kirchhoff 1869; Lamb, *Hydrodynamics*, 1932, art. 124), not by the matrices of
Fossen that our plant has, and sharing no function with it, so that a sign that is turned there is not turned here too.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...components.interface import VELOCITY, XYZ, count
from ...components.vehicle import FORCES, N_THRUSTERS

Array = NDArray[np.float64]
POINTS = {"dB": "r_B", "F_C": "r_C", "F_A": "r_A", "F_umbilical": "r_C", "F_arm": "r_A"}
"""Where each load attacks."""
THRUSTERS = tuple(f"thruster[{i}]" for i in count(N_THRUSTERS))
INERTIA = ("xx", "yy", "zz", "xy", "xz", "yz")
NAMES = (
    *("mass", "g"),
    *(f"{group}.{axis}" for group in ("r_G", "r_B", "r_C", "r_A") for axis in XYZ),
    *(f"I.{axis}" for axis in INERTIA),
    *(f"{group}.{axis}" for group in ("added_mass", "D_linear", "D_quadratic") for axis in VELOCITY),
    *FORCES,
    *(f"{thruster}.{part}.{axis}" for thruster in THRUSTERS for part in "rd" for axis in XYZ),
    *(f"{thruster}.enabled" for thruster in THRUSTERS),
)
"""The parameters of which a plant's terms are known."""


def cross(a: Array, b: Array) -> Array:
    """Return a x b, shape (3,); NumPy's, which takes stacks of any shape, takes ten times as long."""
    (a_x, a_y, a_z), (b_x, b_y, b_z) = a.tolist(), b.tolist()
    return np.array([a_y * b_z - a_z * b_y, a_z * b_x - a_x * b_z, a_x * b_y - a_y * b_x])


def turned(angles: Array) -> Array:
    """Return the axes of the body, as columns in earth coordinates, shape (3, 3), for zyx Euler angles in rad.

    The body is turned about the earth's z, then about its own y, then about its own x.
    """
    axes = np.eye(3)
    for axis, angle in ((2, angles[2]), (1, angles[1]), (0, angles[0])):
        about = axes[:, axis]
        sideways = np.stack([cross(about, axis) for axis in axes.T], axis=1)
        axes = np.outer(about, np.eye(3)[axis]) + np.cos(angle) * (axes - np.outer(about, np.eye(3)[axis]))
        axes += np.sin(angle) * sideways
    return axes


class Newton:
    """The laws for a vehicle; `value` returns its parameters by `NAMES`. Wrenches have shape (6,), body frame."""

    def __init__(self, value: Callable[[str], float]) -> None:
        def vector(group: str, axes: tuple[str, ...] = XYZ) -> Array:
            return np.array([value(f"{group}.{axis}") for axis in axes])

        self.mass, self.g = value("mass"), value("g")
        self.at = {name: vector(name) for name in ("r_G", "r_B", "r_C", "r_A")}
        xx, yy, zz, xy, xz, yz = vector("I", INERTIA)
        self.I = np.array([[xx, -xy, -xz], [-xy, yy, -yz], [-xz, -yz, zz]])
        self.added, self.linear, self.quadratic = (
            vector(group, VELOCITY) for group in ("added_mass", "D_linear", "D_quadratic")
        )
        self.thrusters = [(vector(f"{one}.r"), vector(f"{one}.d") * value(f"{one}.enabled")) for one in THRUSTERS]

    def momenta(self, nu: Array) -> Array:
        """Return linear and angular momentum about the body origin of vehicle and water at a velocity, shape (6,)."""
        v, omega = nu[:3], nu[3:]
        linear = self.mass * (v + cross(omega, self.at["r_G"]))
        angular = self.I @ omega + self.mass * cross(self.at["r_G"], v)
        return np.concatenate([linear, angular]) + self.added * nu

    def inertia(self) -> Array:
        """Return what the acceleration is multiplied by, shape (6, 6)."""
        return np.stack([self.momenta(direction) for direction in np.eye(6)], axis=1)

    def gyroscopic(self, nu: Array) -> Array:
        """Return the wrench by which momenta that turn with the body keep their direction in space."""
        v, omega = nu[:3], nu[3:]
        momenta = self.momenta(nu)
        linear, angular = momenta[:3], momenta[3:]
        return -np.concatenate([cross(omega, linear), cross(omega, angular) + cross(v, linear)])

    def in_current(self, eta: Array, nu: Array, current: Array) -> Array:
        """Return the wrench that a uniform current adds; what is at rest in the water feels none."""
        c = turned(eta[3:]).T @ current
        through = nu - np.concatenate([c, np.zeros(3)])
        turning = self.momenta(np.concatenate([-cross(nu[3:], c), np.zeros(3)]))  # the current, seen from the body
        return self.gyroscopic(through) + self.damping(through) + turning - self.gyroscopic(nu) - self.damping(nu)

    def damping(self, nu: Array) -> Array:
        """Return the wrench of the water on a body that moves in it."""
        return -(self.linear + self.quadratic * np.abs(nu)) * nu

    def righting(self, eta: Array) -> Array:
        """Return the wrench of the weight and of a buoyancy that carries it."""
        up = turned(eta[3:]).T[:, 2]
        weight = self.mass * self.g
        return self.acting(self.at["r_B"], weight * up) + self.acting(self.at["r_G"], -weight * up)

    def load(self, name: str, eta: Array, force: Array) -> Array:
        """Return the wrench of a load of `POINTS` by a force in earth coordinates."""
        return self.acting(self.at[POINTS[name]], turned(eta[3:]).T @ force)

    def thrust(self, i: int) -> Array:
        """Return the wrench of 1 N of a thruster, counted from 0."""
        r, d = self.thrusters[i]
        return self.acting(r, d)

    @staticmethod
    def acting(r: Array, force: Array) -> Array:
        """Return the wrench of a force at a point, both in the body frame."""
        return np.concatenate([force, cross(r, force)])


def displacement(eta: Array, start: Array) -> Array:
    """Return way and turn since the start, shape (6,), in the body's axes at the start; the turn as a vector in rad."""
    axes = turned(start[3:])
    turn = axes.T @ turned(eta[3:])
    sine = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    size = float(np.linalg.norm(sine))
    scale = np.arctan2(size, (np.trace(turn) - 1) / 2) / size if size > 0 else 1.0
    return np.concatenate([axes.T @ (eta[:3] - start[:3]), scale * sine])
