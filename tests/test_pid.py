"""The PID controller: its law, its integral part, and what it does when things go wrong."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rig import Rig, inputs, parameters, random_inputs
from rov_cosim.components import frames, vehicle
from rov_cosim.components.adaptive_pd import COMPONENT as ADAPTIVE
from rov_cosim.components.interface import POSE
from rov_cosim.components.pid import COMPONENT as CONTROLLER
from rov_cosim.components.pid import equations
from rov_cosim.components.rov_plant import COMPONENT as PLANT

RANDOM = np.random.default_rng(6)
T = 0.03
INTEGRAL = np.array([5.0, 4.0, -3.0, 2.0, 1.0, -6.0])


def controller(**values: float) -> Rig:
    rig = Rig(CONTROLLER, values)
    rig.set({"eta_m_valid": 1})
    return rig.start()


def state(**values):
    x = CONTROLLER.x.unpack(np.zeros(CONTROLLER.x.size))
    for key, value in values.items():
        setattr(x, key, np.asarray(value, dtype=float))
    return x


def closed_loop(rig: Rig, plant: Rig, duration: float):
    """Return the pose after each sample, shape (samples, 6)."""
    poses = []
    for _ in range(round(duration / T)):
        rig.put("eta_m", plant.get("eta"))
        rig.put("nu_m", plant.get("nu"))
        rig.step()
        plant.put("u", rig.get("u"))
        plant.step()
        poses.append(plant.get("eta"))
    return np.array(poses)


def test_the_law_is_pid_in_the_earth_frame():
    p = parameters(CONTROLLER, control_roll_pitch=1, use_measured_velocity=1, r_G=[0.02, 0.01, -0.03])
    for _ in range(20):
        eta = np.concatenate([RANDOM.normal(size=3), RANDOM.uniform(-0.9, 0.9, 3)])
        eta_d, nu = RANDOM.normal(size=6) * 0.3, RANDOM.normal(size=6)
        u = inputs(CONTROLLER, eta_m=eta, eta_m_valid=1, nu_m=nu, eta_d=eta_d)
        after, outputs = equations.sample(state(integral=INTEGRAL), u, p, None)
        J, e = frames.jacobian(eta), eta - eta_d
        g_V = vehicle.restoring(eta, p.mass, p.g, p.r_G, p.r_B)
        tau = J.T @ (-p.K_P * e - p.K_D * (J @ nu) - INTEGRAL) + g_V
        assert outputs["tau"] == pytest.approx(tau)
        assert outputs["disturbance"] == pytest.approx(J.T @ INTEGRAL)
        assert after["integral"] - INTEGRAL == pytest.approx(T * p.K_I * e)
        B = vehicle.allocation_matrix(p.thruster_r, p.thruster_d, p.thruster_enabled)
        assert outputs["u"] == pytest.approx(np.linalg.pinv(B) @ tau)


def test_the_default_integral_gain_is_fossens_rule_for_the_papers_vehicle():
    p, plant = parameters(CONTROLLER), parameters(PLANT)
    M = vehicle.mass_matrix(plant.mass, plant.I, plant.r_G, plant.added_mass)
    rule = 0.1 * np.sqrt(p.K_P / np.diag(M)) * p.K_P
    assert np.array_equal(p.K_I, np.vectorize(lambda gain: float(f"{gain:.2g}"))(rule))


def test_the_loop_in_surge_is_that_of_an_independent_integration():
    M, D, F, K_P, K_D, K_I, T_f = 120.0, 130.0, 6.0, 80.0, 90.0, 6.5, 0.1
    plant = Rig(PLANT, {"F_C.x": F, "eta_0.x": 0.3, "max_step": 0.01}).start()
    rig = controller()
    poses = closed_loop(rig, plant, 15.0)

    x, v, integral, low_passed, expected = 0.3, 0.0, 0.0, 0.3, []
    for _ in poses:
        force = -K_P * x - K_D * (x - low_passed) / T_f - K_I * integral
        integral += T * x
        low_passed = x + (low_passed - x) * np.exp(-T / T_f)
        motion = solve_ivp(lambda t, s, f=force: [s[1], (f + F - D * abs(s[1]) * s[1]) / M], (0, T), [x, v], rtol=1e-9)
        x, v = motion.y[:, -1]
        expected.append(x)
    assert poses[:, 0] == pytest.approx(expected, abs=1e-6)


def test_no_offset_remains_and_the_integral_part_is_the_disturbance():
    true = {"dB": 5.0, "F_C.x": 4.0, "F_A.y": 8.0, "F_A.z": -2.0, "eta_0.psi": 0.8, "max_step": 0.03}
    plant, rig = Rig(PLANT, true).start(), controller(**{"K_I.x": 15.0, "K_I.y": 15.0, "K_I.z": 20.0})
    rig.set({"eta_d.psi": 0.5})
    poses = closed_loop(rig, plant, 40.0)
    assert poses[-1] == pytest.approx([0, 0, 0, 0, 0, 0.5], abs=1e-4)
    body = frames.rotation(poses[-1, 3:6]).T @ [4.0, 8.0, 3.0]
    yaw = 0.4 * (frames.rotation(poses[-1, 3:6]).T @ [0.0, 8.0, -2.0])[1]
    assert rig.get("disturbance")[[0, 1, 2, 5]] == pytest.approx([*body, yaw], abs=0.01)
    assert rig.get("integral")[[0, 1, 2, 5]] == pytest.approx([4.0, 8.0, 3.0, yaw], abs=0.01)


def test_without_integral_gain_it_is_the_pd_controller():
    ours, theirs = (
        Rig(component, {"control_roll_pitch": 1, "thrust_max": 12.0, "r_G.x": 0.01, **off})
        for component, off in ((CONTROLLER, {f"K_I.{axis}": 0 for axis in POSE}), (ADAPTIVE, {"adaptation": 0}))
    )
    for rig in (ours, theirs):
        rig.start()
    random = np.random.default_rng(7)
    for _ in range(300):
        values = random_inputs(CONTROLLER, random)
        for rig in (ours, theirs):
            rig.set(values)
            rig.step()
        for group in ("u", "tau", "disturbance", "eta_dot", "e", "saturated"):
            assert np.array_equal(ours.get(group), theirs.get(group)), group


def test_the_four_dof_form_leaves_roll_and_pitch_out():
    rig = controller(thrust_max=5.0)
    rig.put("eta_m", [0.0, 0.0, 0.02, 0.2, -0.3, 0.6])  # rolled and pitched, and too far turned for the thrusters
    rig.run(1.0)
    for group in ("tau", "e", "eta_dot", "integral"):
        assert np.array_equal(rig.get(group)[3:5], np.zeros(2)), group
    assert rig.get("saturated") == 1
    assert rig.get("integral")[2] > 0.1


def test_yaw_error_takes_the_short_way():
    rig = controller()
    rig.set({"eta_m.psi": 3.0, "eta_d.psi": -3.0})
    rig.run(2 * T)
    assert rig.get("e")[5] == pytest.approx(6.0 - 2 * np.pi)
    assert rig.get("integral")[5] == pytest.approx(T * 4.3 * (6.0 - 2 * np.pi))


def test_without_a_measurement_the_last_integral_part_is_fed_forward():
    rig = controller(**{"integral_0.x": 4.0, "integral_0.z": 10.0})
    rig.set({"eta_m.x": 0.5, "eta_m.psi": 0.6})
    rig.step()
    rig.set({"eta_m_valid": 0, "eta_m.x": 9.0, "eta_m.psi": 0.0})
    rig.step()
    held = rig.get("integral")
    rig.run(1.0)
    assert np.array_equal(rig.get("integral"), held)
    assert held[0] == pytest.approx(4.0 + T * 6.5 * 0.5)  # the last valid sample still counts
    force = frames.rotation(np.array([0, 0, 0.6])).T @ held[0:3]
    assert rig.get("tau") == pytest.approx([*-force, 0, 0, -held[5]])


@pytest.mark.parametrize("off", ["disable", "integration"])
def test_the_integral_part_is_frozen_while_off_and_then_goes_on(off):
    rig = controller(**{"integral_0.z": 10.0})
    on = rig.get(off)
    rig.set({off: 1 - on, "eta_m.x": 0.5})
    rig.run(1.0)
    assert np.array_equal(rig.get("integral"), [0, 0, 10.0, 0, 0, 0])
    assert np.abs(rig.get("u")).max() == 0 or off == "integration"
    rig.set({off: on})
    rig.run(1.0)
    assert rig.get("integral")[0] > 1.0


def test_saturated_thrusters_do_not_wind_the_integral_part_up():
    rig = controller(thrust_max=5.0, use_measured_velocity=1)
    rig.set({"eta_m.x": 2.0, "eta_m.z": 0.02, "eta_m.psi": 0.4})  # x and y out of reach of the thrusters for long
    rig.run(20.0)
    assert rig.get("saturated") == 1
    assert rig.get("integral")[0:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert rig.get("integral")[2] == pytest.approx(8.6 * 0.02 * 20.0, rel=0.01)  # heave is delivered
    rig.put("eta_m", [-0.05, 0, 0, 0, 0, 0])  # what is delivered again is integrated again
    rig.run(1.0)
    assert rig.get("integral")[0] < -0.2


def test_a_saturated_transient_overshoots_no_more_than_the_linear_loop():
    def overshoot(thrust_max):
        plant = Rig(PLANT, {"eta_0.y": 1.5, "max_step": 0.03}).start()
        rig = controller(thrust_max=thrust_max, use_measured_velocity=1)
        return -closed_loop(rig, plant, 14.0)[:, 1].min()

    assert 0.0 < overshoot(3.0) < overshoot(0.0)


def test_a_change_of_the_gain_does_not_jump_the_thrust():
    changed, unchanged = controller(**{"integral_0.x": 4.0}), controller(**{"integral_0.x": 4.0})
    changed.set({"K_I.x": 20.0})
    for rig in (changed, unchanged):
        rig.set({"eta_m.x": 0.1})
        rig.step()
    assert np.array_equal(changed.get("u"), unchanged.get("u"))
