"""The controller: the paper's law, its filter, adaptation, allocation and what it does when things go wrong."""

from itertools import combinations

import numpy as np
import pytest
from scipy.signal import cont2discrete, dlsim

from rig import Rig, inputs, parameters
from rov_cosim.components import feedback, frames, vehicle
from rov_cosim.components.adaptive_pd import COMPONENT as CONTROLLER
from rov_cosim.components.adaptive_pd import equations
from rov_cosim.components.noise import standard_normal
from rov_cosim.components.rov_plant import COMPONENT as PLANT

RANDOM = np.random.default_rng(3)
T = 0.03
SIX = {"control_roll_pitch": 1}
LOADS = np.array([5.0, 4.0, -3.0, 2.0, 8.0, -6.0, 1.0, 0.5, -0.3, 2.0])


def controller(**values: float) -> Rig:
    rig = Rig(CONTROLLER, values)
    rig.set({"eta_m_valid": 1})
    return rig.start()


def load_map(eta, p):
    """Return W, shape (6, 10), of seven forces and a couple, point by point."""
    R = frames.rotation(eta[3:6])
    at = [(p.r_B, R.T[:, 2]), *((r, axis) for r in (p.r_C, p.r_A) for axis in R)]
    forces = [np.concatenate([force, np.cross(r, force)]) for r, force in at]
    return np.array([*forces, *(np.concatenate([np.zeros(3), axis]) for axis in R)]).T


def state(**values):
    x = CONTROLLER.x.unpack(np.zeros(CONTROLLER.x.size))
    for key, value in values.items():
        setattr(x, key, np.asarray(value, dtype=float))
    return x


def test_the_law_is_equation_4_and_the_adaptation_equation_5_in_the_papers_own_form():
    p = parameters(CONTROLLER, control_roll_pitch=1, use_measured_velocity=1, r_G=[0.02, 0.01, -0.03])
    p.Gamma = np.concatenate([p.Gamma[:7], [3.0, 4.0, 5.0]])
    K_P, K_D, Gamma = (np.diag(diagonal).copy() for diagonal in (p.K_P, p.K_D, p.Gamma))
    p.K_P_off, p.K_D_off, p.Gamma_off = (RANDOM.uniform(-3, 3, n) for n in (15, 15, 21))
    for matrix, off, n in ((K_P, p.K_P_off, 6), (K_D, p.K_D_off, 6), (Gamma, p.Gamma_off, 7)):
        for (i, j), value in zip(combinations(range(n), 2), off, strict=True):
            matrix[i, j] = matrix[j, i] = value
    for _ in range(20):
        eta = np.concatenate([RANDOM.normal(size=3), RANDOM.uniform(-0.9, 0.9, 3)])
        eta_d, eta_dot_d, nu = RANDOM.normal(size=6) * 0.3, RANDOM.normal(size=6) * 0.1, RANDOM.normal(size=6)
        x = state(theta_hat=LOADS)
        u = inputs(CONTROLLER, eta_m=eta, eta_m_valid=1, nu_m=nu, eta_d=eta_d, eta_dot_d=eta_dot_d)
        after, outputs = equations.sample(x, u, p, None)

        J = frames.jacobian(eta)
        Phi = -np.linalg.inv(J.T) @ load_map(eta, p)
        g = np.linalg.inv(J.T) @ vehicle.restoring(eta, p.mass, p.g, p.r_G, p.r_B)
        e, eta_dot = eta - eta_d, J @ nu
        tau = J.T @ (-K_P @ e - K_D @ (eta_dot - eta_dot_d) + g + Phi @ LOADS)
        epsilon = p.epsilon_0 / (1 + p.alpha * np.linalg.norm(e))
        rate = -Gamma @ (Phi.T @ (eta_dot - eta_dot_d + epsilon * e))
        assert outputs["tau"] == pytest.approx(tau)
        assert outputs["e"] == pytest.approx(e)
        assert outputs["eta_dot"] == pytest.approx(eta_dot)
        assert outputs["disturbance"] == pytest.approx(-J.T @ Phi @ LOADS)
        assert after["theta_hat"] - LOADS == pytest.approx(T * rate)
        B = vehicle.allocation_matrix(p.thruster_r, p.thruster_d, p.thruster_enabled)
        assert outputs["u"] == pytest.approx(B.T @ np.linalg.inv(B @ B.T) @ tau)


def test_the_four_dof_form_leaves_roll_and_pitch_out_everywhere():
    p = parameters(CONTROLLER, use_measured_velocity=1, K_P_off=np.full(15, 4.0), K_D_off=np.full(15, -3.0))
    eta = np.array([0.1, 0.2, 0.3, 0.05, -0.04, 0.6])
    u = inputs(CONTROLLER, eta_m=eta, eta_m_valid=1, nu_m=RANDOM.normal(size=6))
    _, outputs = equations.sample(state(theta_hat=LOADS), u, p, None)
    for key in ("tau", "e", "eta_dot"):
        assert np.array_equal(outputs[key][3:5], np.zeros(2))
    x = state(theta_hat=LOADS)
    turned = inputs(CONTROLLER, eta_m=eta, eta_m_valid=1, eta_d=[0, 0, 0, 0.4, -0.4, 0])
    still = inputs(CONTROLLER, eta_m=eta, eta_m_valid=1)
    for a, b in zip(equations.sample(x, turned, p, None), equations.sample(x, still, p, None), strict=True):
        assert all(np.array_equal(a[key], b[key]) for key in a)


@pytest.mark.parametrize("six", [0, 1])
def test_allocation_delivers_the_controlled_wrench_with_least_effort(six):
    enabled = np.ones(8)
    enabled[2] = 0
    p = parameters(CONTROLLER, control_roll_pitch=six, thruster_enabled=enabled)
    B = feedback.thruster_wrenches(p)
    rows = [0, 1, 2, 3, 4, 5] if six else [0, 1, 2, 5]
    allocation = np.array([feedback.allocate(unit, p) for unit in np.eye(6)[rows]]).T
    assert B[rows] @ allocation == pytest.approx(np.eye(len(rows)), abs=1e-12)
    assert allocation == pytest.approx(np.linalg.pinv(B[rows]), abs=1e-12)
    assert np.array_equal(allocation[2], np.zeros(len(rows)))


def test_the_lead_filter_is_the_zero_order_hold_of_s_over_tf_s_plus_1():
    t = np.arange(200) * T
    x = 0.3 * np.sin(0.8 * t) + 0.05 * t
    rig = controller()
    measured = []
    for value in x:
        rig.set({"eta_m.x": value})
        rig.step()
        measured.append(rig.get("eta_dot")[0])
    num, den, _ = cont2discrete(([1, 0], [0.1, 1]), T)
    _, expected = dlsim((num.ravel(), den, T), x)
    assert measured == pytest.approx(expected.ravel(), abs=1e-12)  # x starts at 0, as the filter does


def test_the_filter_starts_without_velocity_and_restarts_after_a_gap():
    rig = controller()
    rig.set({"eta_m.x": 0.7})
    rig.step()
    assert rig.get("eta_dot")[0] == 0
    rig.set({"eta_m.x": 0.71})
    rig.step()
    assert rig.get("eta_dot")[0] == pytest.approx(0.1)
    for interruption in ("eta_m_valid", "disable"):
        rig.set({interruption: 1 - rig.get(interruption)})
        rig.step()
        rig.set({interruption: 1 - rig.get(interruption), "eta_m.x": rig.get("eta_m")[0] + 0.5})
        rig.step()
        assert rig.get("eta_dot")[0] == 0


def test_a_jump_of_the_measured_yaw_across_pi_is_no_velocity():
    rig = controller()
    for psi in (3.13, 3.14, 3.15 - 2 * np.pi):
        rig.set({"eta_m.psi": psi})
        rig.step()
    assert 0 < rig.get("eta_dot")[5] < 0.5


def test_yaw_error_takes_the_short_way():
    rig = controller()
    rig.set({"eta_m.psi": 3.0, "eta_d.psi": -3.0})
    rig.step()
    assert rig.get("e")[5] == pytest.approx(6.0 - 2 * np.pi)


def test_without_a_measurement_the_last_estimate_is_fed_forward():
    rig = controller(**{"theta_hat_0.dB": 10.0, "theta_hat_0.F_C.x": 4.0})
    rig.set({"eta_m.x": 0.5, "eta_m.psi": 0.6})
    rig.step()
    rig.step()
    estimate = rig.get("theta_hat")
    rig.set({"eta_m_valid": 0, "eta_m.x": 9.0, "eta_m.psi": 0.0})
    rig.step()
    rig.step()
    held = rig.get("theta_hat")
    W = load_map(np.array([0, 0, 0, 0, 0, 0.6]), rig.parameters())
    assert rig.get("tau") == pytest.approx(-(W @ held) * vehicle.FOUR_DOF)
    assert np.array_equal(rig.get("e"), np.zeros(6))
    assert np.abs(held - estimate).max() > 0  # the last valid sample still counts
    rig.run(1.0)
    assert np.array_equal(rig.get("theta_hat"), held)


def test_disabled_thrusters_rest_and_the_estimate_is_frozen():
    rig = controller(**{"theta_hat_0.dB": 10.0})
    rig.set({"disable": 1, "eta_m.x": 0.5})
    rig.run(1.0)
    assert np.array_equal(rig.get("u"), np.zeros(8))
    assert np.array_equal(rig.get("tau"), np.zeros(6))
    assert rig.get("theta_hat")[0] == 10.0
    rig.set({"disable": 0})
    rig.step()
    assert rig.get("tau")[2] == pytest.approx(-10.0)


def test_every_input_is_neutral_at_zero():
    rig = Rig(CONTROLLER).start()
    rig.run(1.0)
    assert np.array_equal(rig.get("u"), np.zeros(8))
    assert np.array_equal(rig.get("theta_hat"), np.zeros(10))


def test_without_adaptation_the_estimate_stays():
    rig = controller(adaptation=0)
    rig.set({"eta_m.x": 0.5})
    rig.run(1.0)
    assert np.array_equal(rig.get("theta_hat"), np.zeros(10))
    assert rig.get("tau")[0] == pytest.approx(-80.0 * 0.5)


def test_a_gain_of_zero_leaves_its_force_alone():
    rig = controller(**{"Gamma.F_A.x": 0.0})
    rig.set({"eta_m.x": 0.5})
    rig.run(1.0)
    assert rig.get("theta_hat.F_A.x") == 0
    assert rig.get("theta_hat.F_C.x") > 0.1


def test_saturation_does_not_wind_the_estimate_up():
    free, limited = controller(use_measured_velocity=1), controller(use_measured_velocity=1, thrust_max=5.0)
    for rig in (free, limited):
        rig.set({"eta_m.x": 2.0})  # out of reach of the thrusters for long
        rig.run(20.0)
    assert limited.get("saturated") == 1
    assert free.get("saturated") == 0
    assert np.abs(limited.get("u")).max() == pytest.approx(5.0)
    # Umbilical and arm each adapt with Gamma (epsilon_0 e / (1 + alpha e)) N/s.
    assert free.get("disturbance")[0] == pytest.approx(2 * 10.0 * 0.3 * 2.0 / 5.0 * 20.0, rel=0.01)
    assert abs(limited.get("disturbance")[0]) < 1e-9
    limited.set({"eta_m.x": -0.05})  # what is delivered again is adapted again
    limited.run(1.0)
    assert limited.get("saturated") == 0
    assert limited.get("disturbance")[0] < -0.01


def test_a_saturated_transient_leaves_no_wound_up_estimate():
    # No disturbance: whatever the estimate gathers on the way is wound up.
    def largest(thrust_max):
        plant = Rig(PLANT, {"eta_0.y": 1.5, "max_step": 0.03}).start()
        rig = controller(thrust_max=thrust_max, use_measured_velocity=1)
        estimates = []
        for _ in range(round(14 / T)):
            rig.put("eta_m", plant.get("eta"))
            rig.put("nu_m", plant.get("nu"))
            rig.step()
            plant.put("u", rig.get("u"))
            plant.step()
            estimates.append(abs(rig.get("disturbance")[1]))
        return max(estimates), rig

    limited, rig = largest(3.0)
    assert limited < 4.5
    assert rig.get("saturated") == 0


def test_saturation_in_one_axis_lets_the_others_adapt():
    rig = controller(thrust_max=5.0)
    rig.set({"eta_m.x": 2.0, "eta_m.z": 0.1})
    rig.run(3.0)
    assert rig.get("saturated") == 1
    assert rig.get("disturbance")[2] > 0.5


def test_noise_that_saturates_leaves_no_offset():
    # Heave needs 25 N of 36 N, so the noise of the damping term clips the thrusters every so often, on one side.
    true = {"dB": 17.0, "F_A.z": 8.0}
    plant = Rig(PLANT, {**true, "max_step": 0.03}).start()
    rig = controller(thrust_max=9.0, **{f"theta_hat_0.{force}": value for force, value in true.items()})
    z, saturated = [], []
    for k in range(round(30 / T)):
        rig.put("eta_m", plant.get("eta") + 0.005 * standard_normal(1, k, 6) * [1, 1, 1, 0, 0, 0])
        rig.step()
        plant.put("u", rig.get("u"))
        plant.step()
        z.append(plant.get("eta.z"))
        saturated.append(rig.get("saturated"))
    assert 0.05 < np.mean(saturated) < 0.3
    assert abs(np.mean(z[len(z) // 2 :])) < 3e-3


def test_a_singular_attitude_counts_as_no_measurement():
    rig = controller(**{"theta_hat_0.dB": 10.0})
    rig.set({"eta_m.x": 1.0, "eta_m.theta": np.pi / 2})
    rig.run(1.0)
    assert rig.get("tau") == pytest.approx([0, 0, -10.0, 0, 0, 0])
    assert rig.get("theta_hat.dB") == 10.0


@pytest.mark.parametrize("period", [0.01, 0.03, 0.1])
def test_the_adaptation_does_not_depend_on_the_sample_time(period):
    rig = controller(use_measured_velocity=1, sample_time=period)
    rig.set({"eta_m.x": 0.5})
    rig.run(3.0 + period, period)
    assert rig.get("theta_hat.F_C.x") == pytest.approx(10.0 * 0.3 * 0.5 / 2.0 * 3.0)


def test_outputs_before_the_first_step_are_those_of_the_first_sample():
    rig = Rig(CONTROLLER)
    rig.set({"eta_m_valid": 1, "eta_m.x": 0.5})
    rig.instance.enter_initialization()
    preview = rig.get("u")
    rig.instance.exit_initialization()
    rig.step()
    assert np.array_equal(rig.get("u"), preview)
    assert np.abs(preview).max() > 1
