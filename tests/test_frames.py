"""Kinematics against scipy's Rotation and against numerical differentiation."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rov_cosim.components import frames

RANDOM = np.random.default_rng(0)
ATTITUDES = RANDOM.uniform([-np.pi, -1.5, -np.pi], [np.pi, 1.5, np.pi], (50, 3))


@pytest.mark.parametrize("angles", ATTITUDES)
def test_rotation_is_scipys_zyx(angles):
    assert frames.rotation(angles) == pytest.approx(Rotation.from_euler("ZYX", angles[::-1]).as_matrix(), abs=1e-14)


@pytest.mark.parametrize("angles", ATTITUDES)
def test_euler_angles_invert_the_rotation(angles):
    assert frames.euler_angles(frames.rotation(angles)) == pytest.approx(angles, abs=1e-12)


@pytest.mark.parametrize("angles", ATTITUDES[:20])
def test_jacobian_maps_body_rates_to_pose_rates(angles):
    eta = np.concatenate([RANDOM.normal(size=3), angles])
    nu = RANDOM.normal(size=6)
    h = 1e-6
    ends = []
    for s in (-h, h):  # move along nu for a moment by scipy's exponential map, then read pose and angles
        attitude = Rotation.from_matrix(frames.rotation(angles)) * Rotation.from_rotvec(s * nu[3:])
        position = eta[:3] + s * frames.rotation(angles) @ nu[:3]
        ends.append(np.concatenate([position, attitude.as_euler("ZYX")[::-1]]))
    # Near theta = pi/2 the second derivative of the angles grows, and the difference quotient with it.
    assert frames.jacobian(eta) @ nu == pytest.approx(
        frames.pose_difference(ends[1], ends[0]) / (2 * h), rel=1e-5, abs=1e-6
    )
    assert frames.jacobian_inverse(eta) @ frames.jacobian(eta) == pytest.approx(np.eye(6), abs=1e-12)


def test_skew_is_the_cross_product():
    a, b = RANDOM.normal(size=(2, 3))
    assert frames.skew(a) @ b == pytest.approx(np.cross(a, b))


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [(0, 0), (np.pi, np.pi), (-np.pi, np.pi), (3 * np.pi, np.pi), (3.5, 3.5 - 2 * np.pi), (-50.0, 0.2654824574)],
)
def test_wrap_keeps_pi_and_turns_minus_pi(angle, wrapped):
    assert frames.wrap(angle) == pytest.approx(wrapped)
    assert -np.pi < frames.wrap(angle) <= np.pi


def test_pose_difference_takes_the_short_way_round():
    a, b = np.zeros(6), np.zeros(6)
    a[5], b[5] = 3.1, -3.1
    assert frames.pose_difference(a, b)[5] == pytest.approx(6.2 - 2 * np.pi)


def test_singular_attitudes_are_told():
    for theta, regular in ((0.0, True), (1.5, True), (1.57, False), (-1.57, False)):
        assert bool(frames.is_regular(np.array([0, 0, 0, 0, theta, 0]))) is regular
