"""The vehicle: energy, steady states, an independent integration, thrusters and limits."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from rig import Rig, inputs, parameters
from rov_cosim.components.instance import ComponentError
from rov_cosim.components.rov_plant import COMPONENT as PLANT
from rov_cosim.components.rov_plant import equations

COARSE = {"max_step": 0.03}  # for steady states, which do not depend on it
FREE = {"lock_roll_pitch": 0}
UNDAMPED = {f"D_quadratic.{axis}": 0.0 for axis in "uvwpqr"}
OFF_CENTRE = {"r_G.x": 0.04, "r_G.y": -0.03, "r_G.z": -0.05}
TUMBLE = {"nu_0.u": 0.4, "nu_0.v": -0.3, "nu_0.w": 0.2, "nu_0.p": 0.5, "nu_0.q": -0.4, "nu_0.r": 0.6}


def energy(rig: Rig) -> float:
    p = rig.parameters()
    eta, nu = rig.get("eta"), rig.get("nu")
    R = Rotation.from_euler("ZYX", eta[:2:-1]).as_matrix()
    return 0.5 * nu @ equations.inertia(p) @ nu + p.mass * p.g * (R @ (p.r_G - p.r_B))[2]


def test_energy_is_conserved_without_damping():
    rig = Rig(PLANT, {**FREE, **UNDAMPED, **OFF_CENTRE, **TUMBLE}).start()
    before = energy(rig)
    rig.run(10.0)
    assert np.abs(rig.get("nu")).max() > 0.1
    assert energy(rig) == pytest.approx(before, rel=1e-6)


def test_energy_never_grows_without_input():
    rig = Rig(PLANT, {**FREE, **OFF_CENTRE, **TUMBLE}).start()
    energies = []
    for _ in range(300):
        energies.append(energy(rig))
        rig.step()
    assert np.diff(energies).max() < 1e-9
    assert energies[-1] < energies[0] - 5


def test_a_buoyant_vehicle_rises_at_its_terminal_speed():
    rig = Rig(PLANT, {"dB": 20.0, **COARSE}).start()
    rig.run(30.0)
    assert rig.get("nu")[2] == pytest.approx(np.sqrt(20.0 / 286.0), rel=1e-6)


def test_a_free_vehicle_drifts_with_the_current():
    rig = Rig(
        PLANT, {**FREE, **COARSE, "eta_0.psi": 0.7, "D_linear.u": 120, "D_linear.v": 120, "D_linear.w": 120}
    ).start()
    rig.put("current", [0.3, -0.2, 0.05])
    rig.run(20.0)
    R = Rotation.from_euler("ZYX", rig.get("eta")[:2:-1]).as_matrix()
    assert R @ rig.get("nu")[:3] == pytest.approx([0.3, -0.2, 0.05], abs=1e-6)


def test_a_turning_vehicle_feels_the_current_of_an_inertial_observer():
    # Seen from a frame that moves with the water the same motion has no current: both must agree.
    v_c = np.array([0.3, -0.2, 0.1])
    still = Rig(PLANT, {**FREE, **OFF_CENTRE, **TUMBLE}).start()
    nu_0 = [TUMBLE[f"nu_0.{axis}"] for axis in "uvw"] + v_c  # at eta_0 = 0 body and earth axes agree
    moving = Rig(
        PLANT, {**FREE, **OFF_CENTRE, **TUMBLE, **dict(zip(("nu_0.u", "nu_0.v", "nu_0.w"), nu_0, strict=True))}
    )
    moving.start().put("current", v_c)
    still.run(6.0)
    moving.run(6.0)
    drift = np.concatenate([6.0 * v_c, np.zeros(3)])
    assert moving.get("eta") - drift == pytest.approx(still.get("eta"), abs=1e-7)


@pytest.mark.parametrize(
    ("values", "force", "point"),
    [
        ({"dB": 20.0}, [0, 0, 20.0], "r_B"),
        ({"F_C.x": 5.0, "F_C.y": -7.0, "F_C.z": 3.0}, [5.0, -7.0, 3.0], "r_C"),
        ({"F_A.x": 5.0, "F_A.y": -7.0, "F_A.z": 3.0}, [5.0, -7.0, 3.0], "r_A"),
        ({"F_arm.x": 5.0, "F_arm.y": -7.0, "F_arm.z": 3.0}, [5.0, -7.0, 3.0], "r_A"),
        ({"F_umbilical.x": 5.0, "F_umbilical.y": -7.0, "F_umbilical.z": 3.0}, [5.0, -7.0, 3.0], "r_C"),
    ],
)
def test_each_force_accelerates_the_vehicle_at_its_point_in_the_earth_frame(values, force, point):
    attitude = [0.4, -0.5, 1.1]
    pose = dict(zip(("eta_0.phi", "eta_0.theta", "eta_0.psi"), attitude, strict=True))
    at_rest, pushed = (Rig(PLANT, {**FREE, **OFF_CENTRE, **pose, **v}).start() for v in ({}, values))
    h = 1e-4
    for rig in (at_rest, pushed):
        rig.step(h)  # the difference leaves out weight and buoyancy
    acceleration = (pushed.get("nu") - at_rest.get("nu")) / h
    body = Rotation.from_euler("ZYX", attitude[::-1]).inv().apply(force)
    expected = np.concatenate([body, np.cross(pushed.get(point), body)])
    assert equations.inertia(pushed.parameters()) @ acceleration == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize("lock", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_the_motion_is_that_of_an_adaptive_integrator(lock):
    values = {"lock_roll_pitch": lock, "thruster_time_constant": 0.2, "dB": 5.0, "F_C.x": 4.0, "F_A.y": 8.0}
    commands = np.array([10.0, -5.0, 8.0, 3.0, 6.0, -4.0, 5.0, 2.0])
    rig = Rig(PLANT, values).start()
    rig.put("u", commands)
    rig.put("F_arm", [1.0, 2.0, -1.0])
    rig.run(6.0)

    p = parameters(PLANT, lock_roll_pitch=lock, forces=[5, 4, 0, 0, 0, 8, 0])
    u = inputs(PLANT, F_arm=[1, 2, -1])
    M, B = equations.inertia(p), equations.thruster_wrenches(inputs(PLANT), p)

    def f(_, z):
        return np.concatenate([equations.rates(z[:6], z[6:12], B @ z[12:], M, u, p), (commands - z[12:]) / 0.2])

    reference = solve_ivp(f, (0, 6), np.zeros(20), method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    assert rig.get("eta") == pytest.approx(reference[:6], abs=2e-7)
    assert rig.get("nu") == pytest.approx(reference[6:12], abs=2e-7)
    assert rig.get("tau") == pytest.approx(B @ commands)


def test_locked_roll_and_pitch_stay_zero_under_a_rolling_moment():
    free, locked = Rig(PLANT, FREE).start(), Rig(PLANT).start()
    for rig in (free, locked):
        rig.put("u", [0, 0, 0, 0, 5.0, -5.0, 5.0, -5.0])
        rig.run(3.0)
    assert abs(free.get("eta")[3]) > 0.01
    assert np.array_equal(locked.get("eta"), np.zeros(6))


def test_roll_and_pitch_are_passively_stable():
    rig = Rig(
        PLANT, {**FREE, "eta_0.phi": 0.3, "eta_0.theta": -0.3, "D_linear.p": 20.0, "D_linear.q": 20.0, **COARSE}
    ).start()
    rig.run(20.0)
    assert rig.get("eta")[[3, 4]] == pytest.approx([0.0, 0.0], abs=1e-3)


@pytest.mark.parametrize("h", [0.03, 0.007, 0.1])
def test_thrusters_lag_exactly_whatever_the_step(h):
    rig = Rig(PLANT, {"thruster_time_constant": 0.25}).start()
    rig.put("u", np.full(8, 10.0))
    rig.run(2.1, h)
    expected = (
        equations.thruster_wrenches(inputs(PLANT), parameters(PLANT)) @ np.full(8, 10.0) * (1 - np.exp(-2.1 / 0.25))
    )
    assert rig.get("tau") == pytest.approx(expected, abs=1e-9)


def test_thrust_is_limited_and_a_disabled_thruster_gives_nothing():
    rig = Rig(PLANT, {"thrust_max": 15.0, "thruster[5].enabled": 0}).start()
    rig.put("u", [0, 0, 0, 0, 40.0, 40.0, -12.0, 10.0])
    rig.step()
    assert rig.get("tau")[2] == pytest.approx(15.0 - 12.0 + 10.0)
    rig.put("u", [0, 0, 0, 0, 0, 0, -40.0, 0])
    rig.step()
    assert rig.get("tau")[2] == pytest.approx(-15.0)


def test_thruster_wrench_is_known_before_the_first_step():
    rig = Rig(PLANT)
    rig.put("u", np.full(8, 1.0))
    rig.instance.enter_initialization()
    assert rig.get("tau")[2] == pytest.approx(4.0)


def test_a_pitch_of_half_pi_fails_the_step_and_keeps_the_state():
    rig = Rig(PLANT, {**FREE, "eta_0.theta": 1.5, "nu_0.q": 5.0, "r_B.z": 0.0}).start()
    before = rig.instance.save()
    with pytest.raises(
        ComponentError, match=r"The step from 0 s failed: eta\.theta is 1\.6\d*; expected .* at most 1\.57"
    ):
        rig.step()
    assert rig.instance.save() == before
    rig.step(0.001)  # short of the singularity it goes on


def test_the_disturbance_is_what_thrusters_balance_to_hold_the_vehicle_still():
    attitude = [0.1, -0.2, 0.8]
    pose = dict(zip(("eta_0.phi", "eta_0.theta", "eta_0.psi"), attitude, strict=True))
    values = {**FREE, **pose, "dB": 9.0, "F_C.x": 3.0, "F_A.z": -4.0, "r_B.z": 0.0, "D_linear.v": 20.0}
    rig = Rig(PLANT, values)
    rig.put("F_arm", [1.0, 2.0, -1.0])
    rig.put("F_umbilical", [-2.0, 1.0, 0.5])
    rig.put("current", [0.3, -0.2, 0.1])
    rig.start()
    B = equations.thruster_wrenches(inputs(PLANT), rig.parameters())
    rig.put("u", -np.linalg.pinv(B) @ rig.get("disturbance"))
    before = rig.get("eta")
    rig.step(1e-6)  # the thrusters follow from here on
    rig.run(0.3)
    assert np.abs(rig.get("disturbance")[:3]).min() > 1.0
    assert rig.get("eta") == pytest.approx(before, abs=1e-9)


def test_without_current_the_disturbance_is_the_sum_of_the_forces():
    rig = Rig(PLANT, {"dB": 9.0, "F_C.x": 3.0, "F_A.x": 2.0, "eta_0.psi": np.pi / 2}).start()
    # Headed to port: earth x is starboard. The umbilical pulls 0.275 m above the origin, the arm 0.4 m ahead of it.
    assert rig.get("disturbance") == pytest.approx([0, -5, 9, 0.275 * 3, 0, -0.4 * 2])


def test_a_command_within_the_dead_band_gives_no_force():
    rig = Rig(PLANT, {"thruster_dead_band": 2.0}).start()
    rig.put("u", [0, 0, 0, 0, 1.99, -1.99, 2.0, -5.0])
    rig.step()
    assert rig.get("tau")[2] == pytest.approx(2.0 - 5.0)


def test_a_thruster_gives_what_it_has_not_lost_and_a_reversed_one_pushes_back():
    forces = []
    for loss in (0.0, 0.25, 1.0, 2.0):
        rig = Rig(PLANT).start()
        rig.set({"u[5]": 8.0, "thrust_loss[5]": loss, "thrust_loss[6]": 1.0})
        rig.step()
        forces.append(rig.get("tau.Z"))
    assert forces == pytest.approx([8.0, 6.0, 0.0, -8.0])
