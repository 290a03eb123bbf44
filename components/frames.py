"""Attitude kinematics: earth frame z up, body frame x forward, y to port, z up; zyx Euler angles.

eta = [x y z phi theta psi] is the pose of the body frame in the earth frame, nu = [u v w p q r] the velocity in the
body frame (Fossen 1994, chapter 2; the formulas hold in any right-handed pair of frames).
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

GIMBAL_MARGIN = 0.01
"""Distance in rad from |theta| = pi/2 within which an attitude counts as singular."""

SINGULAR = 1e-9
"""Cosine of theta below which phi and psi of a rotation cannot be told apart."""

# Row-major S(a) as a linear map of a; several times faster than stacking nine scalars.
_SKEW = np.zeros((9, 3))
_SKEW[[7, 2, 3], [0, 1, 2]] = 1.0
_SKEW[[5, 6, 1], [0, 1, 2]] = -1.0


def skew(a: Any) -> Any:
    """Return S(a), shape (3, 3), with S(a) b = a x b (Fossen 1994, chapter 2)."""
    return np.reshape(_SKEW @ a, (3, 3))


def array(scalars: Sequence[Any]) -> Any:
    """Return scalars as an array, shape (n,): np.stack, which traced ones need and numbers do ten times slower."""
    return np.array(scalars) if all(isinstance(scalar, float) for scalar in scalars) else np.stack(scalars)


def rotation(angles: Any) -> Any:
    """Return R, shape (3, 3), from body to earth coordinates for zyx Euler angles [phi theta psi] in rad."""
    c_phi, c_theta, c_psi = np.cos(angles)
    s_phi, s_theta, s_psi = np.sin(angles)
    rows = [
        c_psi * c_theta,
        c_psi * s_theta * s_phi - s_psi * c_phi,
        c_psi * s_theta * c_phi + s_psi * s_phi,
        s_psi * c_theta,
        s_psi * s_theta * s_phi + c_psi * c_phi,
        s_psi * s_theta * c_phi - c_psi * s_phi,
        -s_theta,
        c_theta * s_phi,
        c_theta * c_phi,
    ]
    return np.reshape(array(rows), (3, 3))


def euler_angles(R: Any) -> Any:
    """Return [phi theta psi] in rad, shape (3,), of a rotation R, shape (3, 3): the inverse of `rotation`.

    At |theta| = pi/2 only the sum or difference of phi and psi is defined; phi is then zero.
    """
    singular = R[0, 0] ** 2 + R[1, 0] ** 2 < SINGULAR**2
    phi = np.where(singular, 0.0, np.arctan2(R[2, 1], R[2, 2]))
    psi = np.arctan2(np.where(singular, -R[0, 1], R[1, 0]), np.where(singular, R[1, 1], R[0, 0]))
    return array([phi, -np.arcsin(np.clip(R[2, 0], -1.0, 1.0)), psi])


def jacobian(eta: Any) -> Any:
    """Return J(eta), shape (6, 6), with eta' = J nu; singular at |theta| = pi/2 (Fossen 1994, chapter 2)."""
    phi, theta = eta[3], eta[4]
    cos = np.cos(theta)
    tan = np.sin(theta) / cos  # both are there by the rotation
    T = [1.0, np.sin(phi) * tan, np.cos(phi) * tan, 0.0, np.cos(phi), -np.sin(phi)]
    T += [0.0, np.sin(phi) / cos, np.cos(phi) / cos]
    return _block_diagonal(rotation(eta[3:6]), np.reshape(array(T), (3, 3)))


def jacobian_inverse(eta: Any) -> Any:
    """Return J^-1(eta), shape (6, 6), with nu = J^-1 eta'; regular everywhere."""
    phi, theta = eta[3], eta[4]
    T_inverse = [1.0, 0.0, -np.sin(theta), 0.0, np.cos(phi), np.cos(theta) * np.sin(phi)]
    T_inverse += [0.0, -np.sin(phi), np.cos(theta) * np.cos(phi)]
    return _block_diagonal(rotation(eta[3:6]).T, np.reshape(array(T_inverse), (3, 3)))


def is_regular(eta: Any) -> Any:
    """Tell whether theta is at least `GIMBAL_MARGIN` away from the singular attitude."""
    return np.abs(eta[4]) < np.pi / 2 - GIMBAL_MARGIN


def wrap(angle: Any) -> Any:
    """Return the angle in (-pi, pi] rad that differs from `angle` by whole turns."""
    return angle - 2 * np.pi * np.ceil((angle - np.pi) / (2 * np.pi))


def pose_difference(eta: Any, reference: Any) -> Any:
    """Return eta - reference, shape (6,), its angles wrapped to (-pi, pi]."""
    return np.concatenate([eta[0:3] - reference[0:3], wrap(eta[3:6] - reference[3:6])])


def _block_diagonal(A: Any, B: Any) -> Any:
    zero = np.zeros((3, 3))
    return np.concatenate([np.concatenate([A, zero], axis=1), np.concatenate([zero, B], axis=1)], axis=0)
