"""The arm: kinematics over the workspace, encoders, noise, reach and pull."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig import Rig, parameters
from rov_cosim.components import frames
from rov_cosim.components.passive_arm import COMPONENT as ARM
from rov_cosim.components.passive_arm import equations

RANDOM = np.random.default_rng(2)
IDEAL = {"noise_std": 0.0, "encoder_counts": 0}
LENGTHS = np.array([0.7, 0.7])


def poses_in_reach(n: int, margin: float = 0.0) -> list[np.ndarray]:
    """Return random vehicle poses from which the default attachment is in reach."""
    p = parameters(ARM)
    poses = []
    while len(poses) < n:
        eta = RANDOM.uniform([-1.2, -1.2, -1, -1, -1.2, -3.1], [2.0, 2.0, 1.8, 1, 1.2, 3.1])
        reach = np.linalg.norm(equations.end_effector_from(eta, p)[0])
        if 0.07 + margin < reach < 1.4 - margin:
            poses.append(eta)
    return poses


def chain(q: np.ndarray, L: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Forward kinematics joint by joint, by scipy's rotations."""
    upper = Rotation.from_euler("z", q[0]) * Rotation.from_euler("y", q[1])
    fore = upper * Rotation.from_euler("y", q[2])
    hand = fore * Rotation.from_euler("z", q[3]) * Rotation.from_euler("y", q[4]) * Rotation.from_euler("x", q[5])
    return upper.apply([L[0], 0, 0]) + fore.apply([L[1], 0, 0]), hand.as_matrix()


def test_forward_kinematics_is_the_chain_of_six_joints():
    for _ in range(50):
        q, L = RANDOM.uniform(-3, 3, 6), RANDOM.uniform(0.3, 1.0, 2)
        position, R = equations.forward_kinematics(q, L)
        expected_position, expected_R = chain(q, L)
        assert position == pytest.approx(expected_position, abs=1e-14)
        assert pytest.approx(expected_R, abs=1e-14) == R


def test_forward_after_inverse_kinematics_is_the_identity_over_the_workspace():
    for L in (LENGTHS, np.array([0.5, 0.9])):
        for _ in range(500):
            direction = RANDOM.normal(size=3)
            reach = RANDOM.uniform(abs(L[0] - L[1]), L.sum())
            position = reach * direction / np.linalg.norm(direction)
            R = Rotation.random(rng=RANDOM).as_matrix()
            q = equations.inverse_kinematics(position, R, L)
            back, R_back = equations.forward_kinematics(q, L)
            assert back == pytest.approx(position, abs=1e-12)
            assert R_back == pytest.approx(R, abs=1e-12)


@pytest.mark.parametrize("position", [(0, 0, 1.2), (0, 0, -1.2), (1.4, 0, 0), (-1.0, 0, 0)])
def test_inverse_kinematics_holds_at_its_special_places(position):
    q = equations.inverse_kinematics(np.array(position, dtype=float), np.eye(3), LENGTHS)
    assert equations.forward_kinematics(q, LENGTHS)[0] == pytest.approx(position, abs=1e-7)


@pytest.mark.parametrize("sign", [-1, 1])
def test_inverse_kinematics_holds_where_the_wrist_is_singular(sign):
    for _ in range(200):
        q = RANDOM.uniform(-1, 1, 6)
        q[2], q[4] = abs(q[2]), sign * np.pi / 2
        position, R = chain(q, LENGTHS)
        back, R_back = equations.forward_kinematics(equations.inverse_kinematics(position, R, LENGTHS), LENGTHS)
        assert back == pytest.approx(position, abs=1e-9)
        assert R_back == pytest.approx(R, abs=1e-7)


def test_an_ideal_arm_measures_the_true_pose():
    rig = Rig(ARM, IDEAL).start()
    for eta in poses_in_reach(40):
        rig.put("eta", eta)
        rig.step()
        assert rig.get("eta_m_valid") == 1
        assert frames.pose_difference(rig.get("eta_m"), eta) == pytest.approx(np.zeros(6), abs=1e-10)
    assert rig.warnings == []


def test_the_error_of_the_encoders_is_bounded_by_half_a_count_at_each_joint():
    # To first order the vehicle's origin moves by half a count times its distance from each joint's axis.
    rig = Rig(ARM, {"noise_std": 0.0}).start()
    half_count = np.pi / 4096
    worst = 0.0
    for eta in poses_in_reach(300, margin=0.05):
        rig.put("eta", eta)
        rig.step()
        error = np.linalg.norm(rig.get("eta_m")[:3] - eta[:3])
        wrist = np.linalg.norm(eta[:3] - [0.7, 0.5, 0.4])
        bound = half_count * (2 * 0.4 + (0.7 + 0.4) + 3 * wrist)  # shoulder twice, elbow, wrist three times
        assert error < bound * 1.01
        turned = Rotation.from_euler("ZYX", rig.get("eta_m")[:2:-1]) * Rotation.from_euler("ZYX", eta[:2:-1]).inv()
        assert turned.magnitude() < 6 * half_count * 1.01
        worst = max(worst, error)
    assert worst > 0.5e-3  # the encoders do limit the measurement


def test_joint_angles_are_whole_counts():
    rig = Rig(ARM).start()
    rig.step()
    counts = rig.get("q") * 4096 / (2 * np.pi)
    assert counts == pytest.approx(np.round(counts), abs=1e-9)
    assert np.abs(counts).max() > 1


def measure(values: dict[str, float], n: int) -> np.ndarray:
    """Return n measurements of the vehicle at rest at the origin."""
    rig = Rig(ARM, values).start()
    rows = []
    for _ in range(n):
        rig.step()
        rows.append(rig.get("eta_m"))
    return np.array(rows)


def test_noise_has_the_declared_deviation_and_bias():
    n = 3000
    rows = measure({"noise_std": 0.01, "noise_std_angle": 0.002, "encoder_counts": 0, "bias.y": 0.05}, n)
    deviation = np.array([0.01] * 3 + [0.002] * 3)
    assert rows.std(axis=0) == pytest.approx(deviation, rel=5 / np.sqrt(2 * n))
    assert np.abs(np.corrcoef(rows.T) - np.eye(6)).max() < 5 / np.sqrt(n)
    assert np.abs(rows.mean(axis=0) - [0, 0.05, 0, 0, 0, 0]) == pytest.approx(0, abs=5 * 0.01 / np.sqrt(n))


@pytest.mark.slow
def test_coloured_noise_has_the_declared_deviation_and_correlation_time():
    n, tau = 4000, 0.15
    x = measure({"noise_std": 0.01, "encoder_counts": 0, "noise_correlation_time": tau}, n)[:, :3]
    effective = n * 0.03 / (2 * tau)
    assert x.std(axis=0) == pytest.approx(0.01, rel=5 / np.sqrt(2 * effective))
    lag = round(tau / 0.03)
    correlation = (x[lag:] * x[:-lag]).mean() / (x**2).mean()
    assert correlation == pytest.approx(np.exp(-1), abs=5 / np.sqrt(3 * effective))
    assert np.std([measure({"noise_correlation_time": 9.0, "seed": s}, 1)[0, 0] for s in range(300)]) > 0.004


def test_noise_repeats_with_the_seed_and_not_with_another():
    assert np.array_equal(measure({"seed": 3}, 20), measure({"seed": 3}, 20))
    assert not np.array_equal(measure({"seed": 3}, 20), measure({"seed": 4}, 20))


def test_the_arm_detaches_out_of_reach_and_reattaches():
    rig = Rig(ARM, {**IDEAL, "stiffness": 5.0}).start()
    rig.step()
    held, angles = rig.get("eta_m"), rig.get("q")
    for x in (-3.0, -4.0):
        rig.set({"eta.x": x})
        rig.step()
        assert rig.get("eta_m_valid") == 0
        assert np.array_equal(rig.get("eta_m"), held)
        assert np.array_equal(rig.get("q"), angles)
        assert np.array_equal(rig.get("F_arm"), np.zeros(3))
        assert rig.get("reach") == pytest.approx(np.linalg.norm([0.3 - x, 0.5, 0.4]))
    assert len(rig.warnings) == 1
    assert "out of reach" in rig.warnings[0]
    rig.set({"eta.x": 0.1})
    rig.step()
    assert rig.get("eta_m_valid") == 1
    assert rig.get("eta_m")[0] == pytest.approx(0.1)
    rig.set({"eta.x": -3.0})
    rig.step()
    assert len(rig.warnings) == 2


@pytest.mark.parametrize("values", [{"eta.theta": np.pi / 2}, {"eta.x": 0.3, "eta.y": 0.5, "eta.z": 0.38}])
def test_the_arm_detaches_at_singular_pitch_and_when_folded(values):
    rig = Rig(ARM, IDEAL).start()
    rig.set(values)
    rig.step()
    assert rig.get("eta_m_valid") == 0


def test_unequal_links_reach_no_closer_than_their_difference():
    rig = Rig(ARM, {**IDEAL, "L[1]": 1.0, "L[2]": 0.4}).start()
    for distance, valid in ((0.55, 0), (0.65, 1), (1.35, 1), (1.45, 0)):
        rig.put("eta", [0.7 - 0.4 - distance, 0.5, 0.4, 0, 0, 0])
        rig.step()
        assert rig.get("eta_m_valid") == valid, distance


def test_measured_angles_stay_within_half_a_turn():
    rig = Rig(ARM, {"noise_std_angle": 0.05, "attachment.x": -0.9, "attachment.y": 0.0}).start()
    rig.set({"eta.psi": np.pi})
    angles = []
    for _ in range(50):
        rig.step()
        angles.append(rig.get("eta_m.psi"))
    assert np.abs(angles).max() <= np.pi
    assert min(angles) < -3 < 3 < max(angles)


def test_the_pull_is_preload_and_spring_towards_the_attachment():
    rig = Rig(ARM, {**IDEAL, "stiffness": 4.0, "preload.z": 3.0}).start()
    eta = np.array([0.1, 0.2, -0.1, 0.2, -0.1, 0.8])
    rig.put("eta", eta)
    rig.step()
    shoulder = eta[:3] + Rotation.from_euler("ZYX", eta[:2:-1]).apply([0.4, 0, 0])
    assert rig.get("F_arm") == pytest.approx([0, 0, 3.0] + 4.0 * (np.array([0.7, 0.5, 0.4]) - shoulder))


def moved(values: dict[str, float], n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return eta_m.x and eta_m_valid of n samples of a vehicle whose x is the number of the sample in mm."""
    rig = Rig(ARM, {**IDEAL, **values}).start()
    x, valid = [], []
    for k in range(n):
        rig.set({"eta.x": 1e-3 * k})
        rig.step()
        x.append(1e3 * rig.get("eta_m.x"))
        valid.append(rig.get("eta_m_valid"))
    return np.array(x), np.array(valid)


@pytest.mark.parametrize("delay", [0, 1, 7, 10])
def test_a_measurement_comes_so_many_samples_late(delay):
    x, valid = moved({"delay": delay}, 30)
    assert np.array_equal(valid, np.arange(30) >= delay)
    assert x[delay:] == pytest.approx(np.arange(30 - delay), abs=1e-9)
    assert np.array_equal(x[:delay], np.zeros(delay))


def test_lost_samples_hold_the_last_measurement_and_are_the_declared_share():
    n, share = 2000, 0.3
    x, valid = moved({"dropout": share, "L[1]": 2.0, "L[2]": 2.0}, n)
    assert 1 - valid.mean() == pytest.approx(share, abs=5 * np.sqrt(share * (1 - share) / n))
    last = np.maximum.accumulate(np.where(valid, np.arange(n), 0))
    assert x == pytest.approx(last, abs=1e-6)
    runs = np.diff(np.flatnonzero(np.diff(valid) != 0))
    assert runs.max() > 3  # not in a regular pattern
    assert moved({"dropout": 1.0}, 20)[1].max() == 0


def test_a_lost_sample_is_no_loss_of_the_arm():
    rig = Rig(ARM, {"dropout": 1.0, "preload.x": 2.0}).start()
    rig.step()
    assert rig.get("attached") == 1
    assert rig.get("F_arm.x") == 2.0
    assert rig.warnings == []


def test_losing_samples_does_not_change_the_noise_of_the_others():
    whole, lossy = measure({}, 50), measure({"dropout": 0.5}, 50)
    kept = (whole == lossy).all(axis=1)
    assert 10 < kept.sum() < 40
