"""Inertia, Coriolis forces, restoring forces, disturbances and allocation against first principles."""

import numpy as np
import pytest

from rig import inputs, parameters
from rov_cosim.components import frames, vehicle
from rov_cosim.components.rov_plant import COMPONENT as PLANT
from rov_cosim.components.rov_plant.equations import unknown_forces

RANDOM = np.random.default_rng(1)
MASS, R_G = 80.0, np.array([0.05, -0.02, -0.08])
INERTIA = np.array([4.5, 7.0, 6.5, 0.1, -0.2, 0.15])
ADDED = np.array([40.0, 48.0, 56.0, 5.5, 9.4, 8.8])
M = vehicle.mass_matrix(MASS, INERTIA, R_G, ADDED)


def attitude(scale: float = 1.0) -> np.ndarray:
    return np.concatenate([RANDOM.normal(size=3), RANDOM.uniform(-1, 1, 3) * scale])


def test_mass_matrix_is_symmetric_positive_definite():
    assert pytest.approx(M.T) == M
    assert np.linalg.eigvalsh(M).min() > 0


def test_mass_matrix_gives_the_kinetic_energy_of_a_cloud_of_points():
    points, masses = RANDOM.normal(size=(7, 3)), RANDOM.uniform(1, 3, 7)
    total = masses.sum()
    r_G = masses @ points / total
    x, y, z = points.T
    second = [masses @ q for q in (y**2 + z**2, x**2 + z**2, x**2 + y**2, x * y, x * z, y * z)]
    nu = RANDOM.normal(size=6)
    velocities = nu[:3] + np.cross(nu[3:], points)
    energy = 0.5 * masses @ (velocities**2).sum(axis=1)
    assert 0.5 * nu @ vehicle.mass_matrix(total, np.array(second), r_G, np.zeros(6)) @ nu == pytest.approx(energy)


def test_default_vehicle_has_the_papers_totals():
    p = parameters(PLANT)
    totals = np.diag(vehicle.mass_matrix(p.mass, p.I, p.r_G, p.added_mass))
    assert totals[[0, 1, 2, 5]] == pytest.approx([120.0, 128.0, 136.0, 14.7])


def test_coriolis_forces_are_those_of_kirchhoff():
    nu = RANDOM.normal(size=6)
    linear, angular = np.split(M @ nu, 2)  # momentum in body axes; its axes turn with the body
    expected = np.concatenate([np.cross(nu[3:], linear), np.cross(nu[3:], angular) + np.cross(nu[:3], linear)])
    assert vehicle.coriolis(M, nu) @ nu == pytest.approx(expected)


def test_rate_of_the_earth_frame_inertia_less_twice_coriolis_is_skew():
    # M(eta) = J^-T M J^-1 and C(eta, eta') = J^-T (C(nu) - M J^-1 J') J^-1 (Fossen 1994, chapter 2)
    eta, nu = attitude(), RANDOM.normal(size=6)
    eta_dot = frames.jacobian(eta) @ nu

    def inertia(at):
        return frames.jacobian_inverse(at).T @ M @ frames.jacobian_inverse(at)

    h = 1e-6
    M_dot = (inertia(eta + h * eta_dot) - inertia(eta - h * eta_dot)) / (2 * h)
    J_dot = (frames.jacobian(eta + h * eta_dot) - frames.jacobian(eta - h * eta_dot)) / (2 * h)
    J_inverse = frames.jacobian_inverse(eta)
    C = J_inverse.T @ (vehicle.coriolis(M, nu) - M @ J_inverse @ J_dot) @ J_inverse
    S = M_dot - 2 * C
    assert pytest.approx(-S.T, abs=1e-5) == S
    assert np.abs(M_dot).max() > 1  # the identity is not trivial here


def test_restoring_force_is_the_gradient_of_the_potential_energy():
    eta, r_B, g = attitude(), np.array([0.01, 0.02, 0.05]), 9.81

    def potential(at):
        R = frames.rotation(at[3:6])
        return MASS * g * ((at[:3] + R @ R_G)[2] - (at[:3] + R @ r_B)[2])

    h = 1e-6
    gradient = [(potential(eta + h * axis) - potential(eta - h * axis)) / (2 * h) for axis in np.eye(6)]
    # Power: nu . g_V = eta' . dP/deta for every nu, so g_V = J^T dP/deta.
    assert vehicle.restoring(eta, MASS, g, R_G, r_B) == pytest.approx(frames.jacobian(eta).T @ gradient, abs=1e-5)


def test_disturbance_wrench_is_the_sum_of_forces_at_their_points():
    eta, unknown = attitude(), RANDOM.normal(size=7)
    points = RANDOM.normal(size=(3, 3))
    R = frames.rotation(eta[3:6])
    forces = [R.T @ f for f in (np.array([0, 0, unknown[0]]), unknown[1:4], unknown[4:7])]
    expected = np.concatenate([sum(forces), sum(np.cross(r, f) for r, f in zip(points, forces, strict=True))])
    assert vehicle.disturbance_map(eta, *points) @ unknown == pytest.approx(expected)
    named = dict(zip(("r_B", "r_C", "r_A"), points, strict=True))
    assert unknown_forces(eta, inputs(PLANT), parameters(PLANT, forces=unknown, **named)) == pytest.approx(expected)


def test_allocation_matrix_columns_are_thruster_wrenches():
    r, d = RANDOM.normal(size=(2, 8, 3))
    enabled = np.array([1, 1, 0, 1, 1, 1, 1, 1])
    B = vehicle.allocation_matrix(r, d, enabled)
    expected = np.hstack([d, np.cross(r, d)]).T * enabled
    assert pytest.approx(expected) == B


def test_default_thrusters_span_all_degrees_of_freedom():
    p = parameters(PLANT)
    B = vehicle.allocation_matrix(p.thruster_r, p.thruster_d, p.thruster_enabled)
    assert np.linalg.matrix_rank(B) == 6
    assert vehicle.direction_error(p.thruster_d) < 1e-15
