"""What becomes of the measured pose: gaps, jumps, the set-point's rate, and the way by which the estimate may adapt."""

import numpy as np
import pytest

from rig import Rig
from rov_cosim.components import frames
from rov_cosim.components.adaptive_pd import COMPONENT as ADAPTIVE
from rov_cosim.components.pid import COMPONENT as PID

T = 0.03
GAP = 0.3
BOTH = pytest.mark.parametrize("component", [ADAPTIVE, PID], ids=lambda component: component.name)


def controller(component=ADAPTIVE, **values: float) -> Rig:
    rig = Rig(component, values)
    rig.set({"eta_m_valid": 1})
    return rig.start()


def fed(rig, poses, arrives, signal):
    """Return a signal after each sample of poses, shape (n, 6), some of which are lost and read as nonsense."""
    rows = []
    for pose, there in zip(poses, arrives, strict=True):
        rig.put("eta_m", pose if there else 9.0 + pose)
        rig.set({"eta_m_valid": float(there)})
        rig.step()
        rows.append(rig.get(signal))
    return np.array(rows)


def along(velocity, n):
    return np.outer(T * np.arange(n), velocity)


@BOTH
def test_over_a_bridged_gap_the_rate_of_a_steady_motion_is_that_without_a_gap(component):
    poses, all_there = along([0.2, -0.1, 0.3, 0, 0, 2.5], 300), np.ones(300, bool)  # the yaw goes through pi twice
    poses[:, 5] = frames.wrap(poses[:, 5])
    some = np.random.default_rng(4).random(300) < 0.5
    some[0] = True
    assert np.diff(np.flatnonzero(some)).max() * T <= GAP
    whole = fed(controller(component), poses, all_there, "eta_dot")
    bridged = fed(controller(component, bridging=GAP), poses, some, "eta_dot")
    assert bridged[some] == pytest.approx(whole[some], abs=1e-12)
    assert np.abs(whole[-1]).min(where=[1, 1, 1, 0, 0, 1], initial=1.0) > 0.1


@BOTH
@pytest.mark.parametrize("gap", [1, 10])
def test_error_and_rate_hold_in_a_gap_for_as_long_as_it_is_bridged(component, gap):
    n = 40 + 12
    poses, arrives = along([0.2, 0, 0, 0, 0, 0.1], n), np.arange(n) < 40
    rig = controller(component, bridging=gap * T)
    eta_dot = fed(rig, poses, arrives, "eta_dot")
    assert np.array_equal(eta_dot[40 : 40 + gap], np.tile(eta_dot[39], (gap, 1)))
    assert not eta_dot[40 + gap :].any()
    rig = controller(component, bridging=gap * T)
    e = fed(rig, poses, arrives, "e")
    assert np.array_equal(e[40 : 40 + gap], np.tile(e[39], (gap, 1)))
    assert not e[40 + gap :].any()
    rig.put("eta_m", poses[-1])
    rig.set({"eta_m_valid": 1})
    rig.step()
    assert rig.get("e")[0] == pytest.approx(poses[-1, 0])
    assert not rig.get("eta_dot").any()  # a gap that is not bridged starts the filter anew


@BOTH
def test_a_disabled_controller_bridges_nothing(component):
    rig = controller(component, bridging=GAP)
    fed(rig, along([0.2, 0, 0, 0, 0, 0], 10), np.ones(10, bool), "e")
    rig.set({"disable": 1})
    rig.step()
    assert not rig.get("e").any()
    rig.set({"disable": 0, "eta_m.x": 0.4})
    rig.step()
    assert not rig.get("eta_dot").any()


@BOTH
@pytest.mark.parametrize("jump", [{"eta_m.y": 0.5}, {"eta_m.psi": 2.0}])
def test_a_jump_that_no_motion_leads_to_is_no_velocity(component, jump):
    rig = controller(component)
    poses = along([0.2, 0, 0, 0, 0, 0], 30)
    assert fed(rig, poses, np.ones(30, bool), "eta_dot")[-1, 0] > 0.1
    rig.set(jump)
    rig.step()
    assert not rig.get("eta_dot").any()
    assert np.abs(rig.get("e")).max() == pytest.approx(max(jump.values()))
    rig.set({"eta_m.x": poses[-1, 0] + 0.01})  # and from there it goes on
    rig.step()
    assert rig.get("eta_dot") == pytest.approx([0.01 / 0.1, 0, 0, 0, 0, 0])


def test_what_is_a_jump_is_judged_by_the_time_since_the_last_measurement():
    rig = controller(bridging=GAP, plausible_speed=1.0)
    arrives = np.array([1, 0, 0, 0, 1], bool)
    poses = np.zeros((5, 6))
    poses[4, 0] = 0.1  # 0.83 m/s over four samples, 3.3 m/s over one
    assert fed(rig, poses, arrives, "eta_dot")[-1, 0] > 0.5


@BOTH
def test_a_vehicle_that_moves_with_its_set_point_is_not_braked(component):
    rig = controller(component, use_measured_velocity=1)
    rate = np.array([0.2, -0.1, 0.05, 0, 0, 0.0])
    rig.put("eta_dot_d", rate)
    rig.put("nu_m", rate)  # level, so the body's velocity is the pose's
    rig.run(30 * T)
    assert rig.get("tau") == pytest.approx(np.zeros(6), abs=1e-12)
    assert rig.get("eta_dot") == pytest.approx(rate)
    rig.put("nu_m", np.zeros(6))
    rig.step()
    assert rig.get("tau")[:3] == pytest.approx([90 * 0.2, -90 * 0.1, 120 * 0.05], rel=0.05)


def test_by_the_pose_the_estimate_grows_with_the_way_of_the_points_of_attack():
    # The integral of W^T J^-1 eta' is the way of each point of attack, and the turn about each axis; earth frame.
    rig = controller(adapt_by_pose=1, epsilon_0=0, control_roll_pitch=1, **{f"Gamma.M.{axis}": 2.0 for axis in "xyz"})
    p = rig.parameters()
    t = np.linspace(0, 1, 400)
    poses = np.outer(t, [0.3, -0.2, 0.1, 0.4, -0.3, 2.0])
    theta_hat = fed(rig, poses, np.ones(400, bool), "theta_hat")[-1]

    def at(pose, r):
        return pose[:3] + frames.rotation(pose[3:]) @ r

    ways = [
        at(poses[-2], r) - at(poses[0], r) for r in (p.r_B, p.r_C, p.r_A)
    ]  # the last sample counts from the next on
    assert theta_hat[:7] == pytest.approx(10.0 * np.concatenate([ways[0][2:], *ways[1:]]), abs=1e-4)
    assert theta_hat[9] == pytest.approx(2.0 * poses[-2, 5], rel=0.1)


def test_by_the_pose_a_gap_a_jump_and_noise_leave_nothing_that_the_way_has_not():
    rig = controller(adapt_by_pose=1, epsilon_0=0, bridging=GAP)
    poses = np.zeros((60, 6))
    poses[:, 0] = 0.01 * np.sin(np.arange(60))
    poses[40:, 0] += 0.5  # a jump
    poses[-2:] = 0.25
    poses[-2:, 3:] = 0.0
    arrives = np.ones(60, bool)
    arrives[10:14] = False
    theta_hat = fed(rig, poses, arrives, "theta_hat")[-1]
    before, after = poses[39, 0] - poses[0, 0], poses[-2, 0] - poses[40, 0]
    assert theta_hat[1] == pytest.approx(10.0 * (before + after))


def test_by_the_pose_a_moving_set_point_is_no_way_of_the_error():
    rig = controller(adapt_by_pose=1, epsilon_0=0)
    rate = np.array([0.2, 0, 0.1, 0, 0, 0.0])
    rig.put("eta_dot_d", rate)
    poses = along(rate, 100)
    assert np.abs(fed(rig, poses, np.ones(100, bool), "theta_hat")[-1]).max() < 1e-12


@BOTH
def test_projection_stops_the_estimate_at_what_the_thrusters_hold_and_lets_it_return_at_once(component):
    rig = controller(component, projection=1, thrust_max=5.0)
    rig.set({"eta_m.x": 0.5})
    rig.run(60.0)
    largest = 4 * 5.0 * np.sqrt(0.5)  # four thrusters at 45 deg
    assert rig.get("disturbance")[0] == pytest.approx(largest, rel=0.02)
    rig.set({"eta_m.x": -0.05})
    rig.run(2 * T)
    held = rig.get("disturbance")[0]
    rig.step()
    assert rig.get("disturbance")[0] < held


def test_with_projection_the_noise_of_the_error_does_not_stop_the_estimate():
    # Heave needs 34 N of 36 N: the noise of K_P e asks for more half the time.
    estimates = {}
    for projection in (0, 1):
        rig = controller(projection=projection, thrust_max=9.0, use_measured_velocity=1, **{"theta_hat_0.dB": 34.0})
        for sign in np.tile([1.0, -1.0], 200):
            rig.set({"eta_m.z": -0.01 + sign * 0.1})  # the estimate is too large: it has to fall
            rig.step()
        estimates[projection] = rig.get("disturbance")[2]
    assert estimates[1] == pytest.approx(34.0 - 3 * 10.0 * 0.3 * 0.01 * 12.0 / (1 + 2 * 0.1), rel=0.01)
    assert abs(estimates[0] - estimates[1]) > 0.5
