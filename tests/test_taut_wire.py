"""The taut wire: geometry against scipy, errors against their first order, the winch against closed forms, limits."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig import Rig, parameters
from rov_cosim.components.frames import pose_difference
from rov_cosim.components.passive_arm import COMPONENT as ARM
from rov_cosim.components.taut_wire import COMPONENT as WIRE
from rov_cosim.components.taut_wire import equations
from rov_cosim.components.taut_wire.cases import IDEAL

RANDOM = np.random.default_rng(4)
ATTACHMENT, FAIRLEAD = np.array([0.7, 0.5, 0.4]), np.array([0.4, 0.0, 0.0])
DEVIATION = {"length": 2e-3, "angle": 3e-3, "phi": 1e-3, "theta": 2e-3, "psi": 4e-3}
NOISY = {
    **IDEAL,
    **{f"{name}_noise_std": DEVIATION[name] for name in ("length", "angle")},
    **{f"attitude_noise_std.{axis}": DEVIATION[axis] for axis in ("phi", "theta", "psi")},
}


def turned(eta):
    return Rotation.from_euler("ZYX", eta[:2:-1])


def pose_of(length, azimuth, elevation, attitude):
    """Return the pose of a vehicle whose wire is so, by scipy's rotations of the gimbal one after the other."""
    gimbal = Rotation.from_euler("ZY", [azimuth, -elevation])
    R = Rotation.from_euler("ZYX", attitude[::-1])
    return np.concatenate([ATTACHMENT - R.apply(FAIRLEAD + gimbal.apply([length, 0, 0])), attitude])


def random_wire():
    return RANDOM.uniform([0.2, -3.1, -1.3], [2.9, 3.1, 1.3]), RANDOM.uniform([-1, -1.4, -3.1], [1, 1.4, 3.1])


def measure(values, n, eta=()):
    """Return n measurements of a vehicle at rest."""
    rig = Rig(WIRE, values).start()
    rig.put("eta", eta if len(eta) else np.zeros(6))
    rows = []
    for _ in range(n):
        rig.step()
        rows.append(rig.get("eta_m"))
    return np.array(rows)


def test_it_has_the_ports_of_the_arm_and_takes_its_place():
    assert WIRE.u.names == ARM.u.names
    own = {name for name in ARM.y.names if not name.startswith("q[")}
    assert own <= set(WIRE.y.names)
    for signal in ARM.outputs:
        (same,) = [s for s in WIRE.outputs if s.key == signal.key] or [signal]
        assert (same.units, same.type) == (signal.units, signal.type)


def test_ideal_instruments_read_the_gimbal_and_give_back_the_pose():
    rig = Rig(WIRE, {**IDEAL, "winch_rate": 1e6}).start()
    for _ in range(100):
        wire, attitude = random_wire()
        eta = pose_of(*wire, attitude)
        rig.put("eta", eta)
        rig.step()
        assert rig.get("eta_m_valid") == 1
        assert rig.get("wire") == pytest.approx(wire, abs=1e-12)
        assert rig.get("attitude") == pytest.approx(attitude, abs=1e-12)
        assert pose_difference(rig.get("eta_m"), eta) == pytest.approx(np.zeros(6), abs=1e-12)
        assert rig.get("reach") == pytest.approx(wire[0], abs=1e-12)
    assert rig.warnings == []


def first_order(wire, attitude):
    """Return the change of the measured place by each reading, shape (3, 6): minus the lever turned, and so on."""
    length, azimuth, elevation = wire
    eta = pose_of(*wire, attitude)
    R = turned(eta)
    along = R.apply(Rotation.from_euler("ZY", [azimuth, -elevation]).apply([1, 0, 0]))
    up, across = R.apply([0, 0, 1]), R.apply(Rotation.from_euler("Z", azimuth).apply([0, -1, 0]))
    lever = ATTACHMENT - eta[:3]
    heading = Rotation.from_euler("Z", attitude[2])
    axes = [R.apply([1, 0, 0]), heading.apply([0, 1, 0]), np.array([0, 0, 1])]
    columns = [along, length * np.cross(up, along), length * np.cross(across, along)]
    return -np.stack([*columns, *(np.cross(axis, lever) for axis in axes)], axis=1)


def test_noise_is_that_of_the_instruments_by_the_levers_of_the_geometry():
    wire, attitude, n = np.array([1.5, 0.7, 0.4]), np.array([0.1, -0.2, 0.9]), 1200
    rows = measure(NOISY, n, pose_of(*wire, attitude))[:, :3]
    by = first_order(wire, attitude) * [DEVIATION[name] for name in ("length", "angle", "angle", "phi", "theta", "psi")]
    assert np.cov(rows.T) == pytest.approx(by @ by.T, abs=6 * np.trace(by @ by.T) / np.sqrt(n))
    assert rows.std(axis=0) == pytest.approx(np.linalg.norm(by, axis=1), rel=5 / np.sqrt(2 * n))


@pytest.mark.parametrize("reading", range(6))
def test_a_constant_error_shifts_the_place_by_its_lever(reading):
    names = ["wire_bias.length", "wire_bias.azimuth", "wire_bias.elevation"]
    name = (names + [f"attitude_bias.{axis}" for axis in ("phi", "theta", "psi")])[reading]
    wire, attitude = random_wire()
    eta = pose_of(*wire, attitude)
    shift = pose_difference(measure({**IDEAL, name: 1e-5}, 1, eta)[0], eta)
    assert shift[:3] == pytest.approx(1e-5 * first_order(wire, attitude)[:, reading], abs=1e-9)
    assert shift[3:] == pytest.approx(1e-5 * np.eye(6)[reading, 3:], abs=1e-12)


def test_readings_are_whole_steps_and_within_half_a_step():
    values = {**IDEAL, "length_resolution": 0.004, "encoder_counts": 1000, "attitude_resolution": 0.003}
    rig, steps = Rig(WIRE, values).start(), np.array([0.004, *[np.pi / 500] * 2, *[0.003] * 3])
    worst = np.zeros(6)
    for _ in range(100):
        wire, attitude = random_wire()
        rig.put("eta", pose_of(*wire, attitude))
        rig.step()
        reading = np.concatenate([rig.get("wire"), rig.get("attitude")])
        assert reading / steps == pytest.approx(np.round(reading / steps), abs=1e-9)
        worst = np.maximum(worst, np.abs(reading - [*wire, *attitude]) / steps)
    assert np.all((worst > 0.4) & (worst < 0.5 + 1e-9))


def test_the_drift_is_slow_and_has_its_deviation_from_the_start():
    drift = {**IDEAL, "attitude_drift_std.psi": 0.01, "attitude_drift_time": 300.0}
    first = [measure({**drift, "seed": seed}, 1)[0, 5] for seed in range(150)]
    assert np.std(first) == pytest.approx(0.01, rel=5 / np.sqrt(300))
    within = measure(drift, 100)[:, 5]  # 3 s, a hundredth of the correlation time
    assert np.abs(within - within[0]).max() < 5 * 0.01 * np.sqrt(2 * 3 / 300)
    assert within.std() > 0
    fast = measure({**drift, "attitude_drift_time": 0.15}, 1500)[:, 5]
    assert (fast[5:] * fast[:-5]).mean() / (fast**2).mean() == pytest.approx(
        np.exp(-1), abs=5 * np.sqrt(0.15 / (1500 * 0.03))
    )


def test_noise_repeats_with_the_seed_and_not_with_another():
    assert np.array_equal(measure({"seed": 3}, 20), measure({"seed": 3}, 20))
    assert not np.array_equal(measure({"seed": 3}, 20), measure({"seed": 4}, 20))


def pulled(speed, duration, **values):
    """Return time and tension of a wire along x whose vehicle moves off at a speed, from 1 m."""
    rig = Rig(WIRE, {**IDEAL, "attachment.y": 0.0, "attachment.z": 0.0, "attachment.x": 1.4, **values}).start()
    t = np.arange(0.0, duration, 0.03)
    rows = []
    for time in t:
        rig.set({"eta.x": -speed * time})
        rig.step()
        rows.append([rig.get("tension"), rig.get("F_arm.x"), rig.get("taut"), rig.get("eta_m_valid")])
    return t, *np.array(rows).T


@pytest.mark.parametrize("speed", [-0.4, 0.0, 0.4])
def test_a_winch_that_is_quick_enough_keeps_the_tension(speed):
    _, tension, force, taut, _ = pulled(speed, 1.5, winch_tension=6.0)
    assert tension == pytest.approx(6.0)
    assert force == pytest.approx(6.0)
    assert taut.all()


def test_a_vehicle_that_leaves_faster_than_the_winch_is_pulled_by_its_stiffness():
    t, tension, _, taut, _ = pulled(0.5, 1.5, winch_tension=6.0, winch_stiffness=50.0, winch_rate=0.2)
    assert tension == pytest.approx(6.0 + 50.0 * 0.3 * t)
    assert taut.all()


def test_a_vehicle_that_comes_faster_than_the_winch_has_a_slack_wire_that_measures_nothing():
    t, tension, force, taut, valid = pulled(
        -0.5, 0.9, winch_tension=6.0, winch_stiffness=50.0, winch_rate=0.2, slack_tension=1.0
    )
    assert tension == pytest.approx(np.maximum(6.0 - 50.0 * 0.3 * t, 0.0))
    assert force == pytest.approx(tension)
    assert np.array_equal(taut, tension >= 1.0)
    assert np.array_equal(valid, taut)
    assert 0 < taut.sum() < len(t)


def test_a_slack_wire_is_told_once_and_measures_again_when_it_is_hauled_in():
    rig = Rig(WIRE, {**IDEAL, "winch_rate": 0.2}).start()
    rig.step()
    held = rig.get("eta_m")
    rig.set({"eta.x": 0.25})
    rig.step()
    assert (rig.get("taut"), rig.get("eta_m_valid"), rig.get("attached")) == (0, 0, 1)
    assert np.array_equal(rig.get("eta_m"), held)
    assert rig.get("F_arm") == pytest.approx(np.zeros(3))
    rig.run(0.6)
    assert rig.get("eta_m")[0] == pytest.approx(0.25)
    assert len(rig.warnings) == 1
    assert "slack" in rig.warnings[0]


def test_at_the_end_of_the_wire_it_holds_the_vehicle_and_measures_no_more():
    _, tension, _, taut, valid = pulled(0.4, 1.5, winch_tension=6.0, winch_stiffness=50.0, length_max=1.3)
    length = 1.0 + 0.4 * np.arange(0.0, 1.5, 0.03)
    assert tension == pytest.approx(np.maximum(6.0, 50.0 * (length - 1.3)))
    assert tension[-1] > 10
    assert taut.all()
    assert np.array_equal(valid, length <= 1.3)


@pytest.mark.parametrize(
    ("wire", "name", "narrow", "wide"),
    [
        ((0.5, 0.0, 0.0), "length_min", 0.55, 0.45),
        ((0.5, 0.6, 0.0), "azimuth_max", 0.55, 0.65),
        ((0.5, -0.6, 0.0), "azimuth_max", 0.55, 0.65),
        ((0.5, 0.0, 0.6), "elevation_max", 0.55, 0.65),
        ((0.5, 0.0, -0.6), "elevation_max", 0.55, 0.65),
    ],
)
def test_beyond_a_limit_the_wire_pulls_on_but_does_not_measure(wire, name, narrow, wide):
    for limit, within in ((narrow, 0), (wide, 1)):
        rig = Rig(WIRE, {**IDEAL, name: limit})
        rig.put("eta", pose_of(*wire, np.array([0.1, 0.2, 1.0])))
        rig.start().step()
        assert (rig.get("attached"), rig.get("eta_m_valid")) == (within, within)
        assert np.linalg.norm(rig.get("F_arm")) == pytest.approx(8.0)
        assert len(rig.warnings) == 1 - within


def test_at_the_singular_pitch_it_does_not_measure():
    rig = Rig(WIRE, IDEAL).start()
    rig.put("eta", [0, 0, 0, 0, np.pi / 2, 0])
    rig.step()
    assert rig.get("eta_m_valid") == 0


def test_the_force_points_to_the_attachment():
    wire, attitude = random_wire()
    eta = pose_of(*wire, attitude)
    rig = Rig(WIRE, {"winch_tension": 5.0}).start()
    rig.put("eta", eta)
    rig.step()
    gap = ATTACHMENT - eta[:3] - turned(eta).apply(FAIRLEAD)
    assert rig.get("F_arm") == pytest.approx(5.0 * gap / np.linalg.norm(gap))


@pytest.mark.parametrize(
    ("values", "cure"),
    [
        ({"winch_tension": 1.0, "slack_tension": 2.0}, "raise winch_tension above slack_tension"),
        ({"length_max": 0.1, "length_min": 0.2}, "raise length_max above length_min"),
    ],
)
def test_a_wire_that_can_never_measure_is_refused(values, cure):
    with pytest.raises(ValueError, match=cure):
        Rig(WIRE, values).start()


def test_the_way_back_is_the_inverse_for_any_attachment():
    p = parameters(WIRE, attachment=[-0.3, 2.0, 0.1], r_A=[0.1, -0.2, 0.3])
    for _ in range(20):
        eta = RANDOM.uniform([-2, -2, -2, -1, -1.4, -3], [2, 2, 2, 1, 1.4, 3])
        reading = np.concatenate([equations.spherical(equations.wire_from(eta, p)), eta[3:]])
        assert equations.pose_from(reading, p) == pytest.approx(eta, abs=1e-12)


@pytest.mark.parametrize("delay", [1, 10])
def test_a_measurement_comes_so_many_samples_late(delay):
    rig = Rig(WIRE, {**IDEAL, "delay": delay}).start()
    for k in range(20):
        rig.set({"eta.x": 1e-3 * k})
        rig.step()
        assert rig.get("eta_m_valid") == (k >= delay)
        assert rig.get("eta_m.x") == pytest.approx(1e-3 * max(k - delay, 0), abs=1e-9)


def test_lost_samples_are_the_declared_share_and_no_slack():
    rig, n = Rig(WIRE, {"dropout": 0.3}).start(), 1000
    valid = []
    for _ in range(n):
        rig.step()
        valid.append(rig.get("eta_m_valid"))
        assert rig.get("taut") == 1
    assert 1 - np.mean(valid) == pytest.approx(0.3, abs=5 * np.sqrt(0.21 / n))
    assert rig.warnings == []
