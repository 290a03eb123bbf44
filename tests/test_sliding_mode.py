"""The sliding-mode controller: reaching, the boundary layer and its offset, the integral, chattering."""

import numpy as np
import pytest

from closed_loop import last, run
from rig import Rig, inputs, parameters
from rov_cosim.components import frames, vehicle
from rov_cosim.components.interface import POSE
from rov_cosim.components.rov_plant import COMPONENT as PLANT
from rov_cosim.components.rov_plant import equations as plant_equations
from rov_cosim.components.sliding_mode import COMPONENT as CONTROLLER
from rov_cosim.components.sliding_mode import equations

RANDOM = np.random.default_rng(8)
T = 0.03
LAYER = CONTROLLER.p.unpack(CONTROLLER.p.start).boundary_layer
M = np.diag(vehicle.mass_matrix(80.0, parameters(PLANT).I, np.zeros(3), parameters(PLANT).added_mass))
SWITCHING = dict.fromkeys((f"boundary_layer.{axis}" for axis in POSE), 0.0)


def controller(**values: float) -> Rig:
    rig = Rig(CONTROLLER, values)
    rig.set({"eta_m_valid": 1})
    return rig.start()


@pytest.mark.parametrize("integration", [0, 1])
def test_it_reaches_the_sliding_surface_whatever_the_state(integration):
    """V = s_b^T M s_b / 2, s_b = J^-1 s, falls by damping and switching gain, less what unknown forces add.

    Its rate is taken from the vehicle's own equations by central differences.
    """
    known = {"D_linear": np.arange(10.0, 16.0), "r_G": [0.0, 0.0, -0.02]}
    p = parameters(CONTROLLER, control_roll_pitch=1, use_measured_velocity=1, integration=integration, **known)
    p.boundary_layer = np.zeros(6)
    plant = parameters(PLANT, lock_roll_pitch=0, forces=RANDOM.normal(size=7) * 5.0, **known)
    inertia, load = plant_equations.inertia(plant), inputs(PLANT)
    for _ in range(20):
        # Roll and pitch at rest: what their rates add to J' is left to the switching gain.
        eta = np.concatenate([RANDOM.normal(size=3), [0.0, 0.0], RANDOM.uniform(-3, 3, 1)])
        nu = RANDOM.normal(size=6) * [0.5, 0.5, 0.5, 0.0, 0.0, 0.5]
        z = RANDOM.normal(size=6) * 0.1
        rest = {"filter_difference": np.zeros(6), "samples": 0.0, "eta": eta}
        x = CONTROLLER.x.unpack(CONTROLLER.x.pack({"z": z, **rest}))
        out = equations.sample(x, inputs(CONTROLLER, eta_m=eta, eta_m_valid=1, nu_m=nu), p, None)[1]

        def sliding(eta, nu, z):
            slope = 2 * p.Lambda * eta + p.Lambda**2 * z if integration else p.Lambda * eta
            return frames.jacobian(eta) @ nu + slope

        def V(state):
            s_b = frames.jacobian_inverse(state[:6]) @ sliding(state[:6], state[6:12], state[12:])
            return s_b @ inertia @ s_b / 2

        rate = plant_equations.rates(eta, nu, out["tau"], inertia, load, plant)
        state, rate = np.concatenate([eta, nu, z]), np.concatenate([rate, eta])
        h = 1e-6
        found = (V(state + h * rate) - V(state - h * rate)) / (2 * h)

        s = sliding(eta, nu, z)
        assert out["s"] == pytest.approx(s)
        s_b = frames.jacobian_inverse(eta) @ s
        d = plant_equations.unknown_forces(eta, load, plant)
        damping = (plant.D_linear + plant.D_quadratic * np.abs(nu)) * s_b @ s_b
        assert found == pytest.approx(-damping - p.K_S @ np.abs(s) + s_b @ d, rel=1e-5)
        assert found < 0  # for the switching gain is more than the forces


def test_it_reaches_within_the_time_that_the_switching_gain_has_to_spare(fmus):
    F, x, h = 20.0, 0.5, 0.005
    values = {"use_measured_velocity": True, "integration": False, **SWITCHING}
    results = run("sliding_mode", 4.0, values, {"eta_0.x": x, "F_C.x": F}, h)
    latest = M[0] * 0.7 * x / (60.0 - F)
    e = results["rov_plant.eta.x"][round(latest / h) :]
    # From then on the error decays by itself: what the force pushes does not show.
    assert e == pytest.approx(e[0] * np.exp(-0.7 * h * np.arange(len(e))), abs=2e-3)
    assert e[0] > 0.2


@pytest.mark.parametrize("damping", [0.0, 80.0])
def test_in_the_boundary_layer_a_force_leaves_the_predicted_offset(fmus, damping):
    F, K, rate, layer = 25.0, 68.0, 1.5, 0.33
    known = {"D_linear.w": damping}
    values = {"integration": False, "Lambda.z": rate, "boundary_layer.z": layer, **known}
    results = run("sliding_mode", 30.0, values, {"F_C.z": F, **known})
    assert results["rov_plant.eta.z"][-1] == pytest.approx(F / (K * rate / layer + damping * rate), rel=1e-4)
    assert abs(results["controller.s.z"][-1]) < layer
    assert results["controller.disturbance.Z"][-1] == pytest.approx(F, rel=1e-4)


def test_with_the_integral_no_offset_remains_and_the_disturbance_is_the_true_one(fmus):
    known = {"D_linear.u": 20.0, "D_linear.v": 30.0, "D_linear.w": 40.0, "D_linear.r": 5.0}
    true = {"dB": 5.0, "F_C.x": 4.0, "F_A.y": 8.0, "F_A.z": -2.0, "eta_0.psi": 0.8}
    results = run("sliding_mode", 60.0, {"eta_d.psi": 0.5, **known}, {**true, **known})
    eta = last(results, "rov_plant.eta", POSE)
    assert eta == pytest.approx([0, 0, 0, 0, 0, 0.5], abs=1e-5)
    body = frames.rotation(np.array(eta[3:6])).T @ [4.0, 8.0, 3.0]
    moment = 0.4 * (frames.rotation(np.array(eta[3:6])).T @ [0.0, 8.0, -2.0])[1]
    assert last(results, "controller.disturbance", "XYZN") == pytest.approx([*body, moment], abs=1e-3)


def test_the_default_gains_are_the_stated_rules_for_the_papers_vehicle():
    p = parameters(CONTROLLER)
    acceleration = p.K_S / M
    assert acceleration == pytest.approx([0.5] * 3 + [0.8] * 3, rel=0.01)
    assert p.boundary_layer == pytest.approx(p.K_S / (M * p.Lambda), rel=0.05)


@pytest.mark.parametrize("integration", [False, True])
def test_a_layer_too_narrow_for_the_lag_of_the_loop_chatters_and_a_wide_one_does_not(fmus, integration):
    def variation(layer):
        values = {"boundary_layer.z": layer, "integration": integration}
        results = run("sliding_mode", 60.0, values, {"F_C.z": 25.0, "thruster_time_constant": 0.1})
        return np.abs(np.diff(results["controller.u[5]"][-1000:])).mean() / T

    assert variation(0.7) < 1e-3  # there is no noise: the thrust comes to rest
    assert min(variation(0.02), variation(0.0)) > 20.0


def test_the_integral_grows_inside_of_the_layer_alone():
    rig = controller()
    far = (LAYER[0] + 0.1) / (2 * 0.7)
    rig.set({"eta_m.x": far, "eta_m.y": 0.1})
    rig.run(1.0)
    held = rig.get("s")
    assert held[0] == pytest.approx(2 * 0.7 * far)
    assert held[1] == pytest.approx(2 * 0.7 * 0.1 + 0.7**2 * 0.1 * 32 * T)


def test_without_a_measurement_the_thrusters_go_on_against_what_was_learned():
    rig = controller()
    rig.set({"eta_m.z": 0.2})
    rig.run(2.0)
    rig.set({"eta_m_valid": 0})
    rig.run(1.0)
    learned = 0.7**2 * 0.2 * 67 * T  # Lambda^2 z
    assert rig.get("s")[2] == pytest.approx(learned)
    assert rig.get("disturbance")[2] == pytest.approx(68.0 * learned / 0.7)
    rig.set({"disable": 1})
    rig.step()
    assert not rig.get("u").any()
    plain = controller(integration=0)
    plain.set({"eta_m.x": 0.5})
    plain.step()
    plain.set({"eta_m_valid": 0})
    plain.step()
    assert not plain.get("u").any()  # it has learned nothing


def test_the_model_follows_the_rate_of_the_set_point():
    """On a path of constant speed the wrench is the drag at this speed: no error is needed."""
    p = parameters(CONTROLLER, use_measured_velocity=1, D_linear=[20.0] * 6)
    u = inputs(CONTROLLER, eta_m_valid=1, nu_m=[0.3, 0, 0, 0, 0, 0], eta_dot_d=[0.3, 0, 0, 0, 0, 0])
    x = CONTROLLER.x.unpack(np.zeros(CONTROLLER.x.size))
    assert equations.sample(x, u, p, None)[1]["tau"] == pytest.approx([20 * 0.3 + 130 * 0.09, 0, 0, 0, 0, 0])


def test_the_four_dof_form_leaves_roll_and_pitch_out():
    rig = controller()
    rig.put("eta_m", [0.1, 0.0, 0.02, 0.2, -0.3, 0.6])
    rig.run(1.0)
    for group in ("tau", "e", "s"):
        assert np.array_equal(rig.get(group)[3:5], np.zeros(2)), group
