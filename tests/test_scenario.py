"""The scenario: its current, pulls and set-point as functions of time."""

import numpy as np
import pytest

from rig import Rig
from rov_cosim.components.scenario import COMPONENT as SCENARIO

T = 0.03


def record(signal, values, n, set_point=(0.0,) * 6):
    """Return n samples of a signal, shape (n, elements)."""
    rig = Rig(SCENARIO, values)
    rig.put("set_point", set_point)
    rig.start()
    rows = []
    for _ in range(n):
        rig.step()
        rows.append(rig.get(signal))
    return np.array(rows)


def test_by_default_nothing_happens_and_the_set_point_is_handed_on():
    set_point = [0.1, -0.2, 0.3, 0.01, -0.02, 2.0]
    assert np.array_equal(record("eta_d", {}, 50, set_point), np.tile(set_point, (50, 1)))
    for signal in ("current", "F_umbilical", "thrust_loss", "eta_dot_d"):
        assert not record(signal, {}, 50).any()


def test_the_current_has_the_declared_mean_deviation_and_correlation_time():
    n, tau, sigma = 5000, 0.15, 0.1
    deviations = {"current_std.x": sigma, "current_std.z": 2 * sigma}
    c = record(
        "current", {**deviations, "current_mean.x": 0.3, "current_mean.y": -0.1, "current_correlation_time": tau}, n
    )
    effective = n * T / (2 * tau)
    assert c.mean(axis=0) == pytest.approx([0.3, -0.1, 0.0], abs=5 * 2 * sigma / np.sqrt(effective))
    assert c.std(axis=0) == pytest.approx([sigma, 0.0, 2 * sigma], rel=5 / np.sqrt(2 * effective))
    x = c[:, 0] - 0.3
    lag = round(tau / T)
    assert (x[lag:] * x[:-lag]).mean() / (x**2).mean() == pytest.approx(np.exp(-1), abs=5 / np.sqrt(3 * effective))
    first = [record("current", {**deviations, "seed": seed}, 1)[0, 0] for seed in range(200)]
    assert np.std(first) == pytest.approx(sigma, rel=5 / np.sqrt(400))  # stationary from the start


def test_the_current_repeats_with_the_seed_and_not_with_another():
    def run(seed):
        return record("current", {"current_std.x": 0.1, "seed": seed}, 20)

    assert np.array_equal(run(3), run(3))
    assert not np.array_equal(run(3), run(4))


def test_each_pull_acts_from_its_begin_for_its_duration():
    pulls = {
        "pull[1].F.x": 5.0,
        "pull[1].begin": 0.3,
        "pull[1].duration": 0.6,
        "pull[2].F.x": 2.0,
        "pull[2].begin": 0.6,
    }
    t = T * np.arange(50)
    expected = 5.0 * ((t > 0.299) & (t < 0.899)) + 2.0 * (t > 0.599)
    assert record("F_umbilical", pulls, 50)[:, 0] == pytest.approx(expected)


def test_a_pull_grows_to_its_force_in_the_time_that_it_is_given():
    pull = {"pull[1].F.y": -4.0, "pull[1].begin": 0.3, "pull[1].rise": 0.6}
    t = T * np.arange(60)
    assert record("F_umbilical", pull, 60)[:, 1] == pytest.approx(-4.0 * np.clip((t - 0.3) / 0.6, 0, 1))


def test_thrusters_fail_from_their_time_on():
    loss = record("thrust_loss", {"thruster[3].loss": 1.0, "thrust_loss_begin": 0.9}, 60)
    assert np.array_equal(loss[:, 2], (T * np.arange(60) > 0.899).astype(float))
    assert not loss[:, [0, 1, 3, 4, 5, 6, 7]].any()


def test_the_rate_of_the_set_point_is_that_of_its_sine():
    values = {"motion.x": 0.2, "motion.psi": -0.5, "motion_period": 4.0, "step.x": 1.0, "step_begin": 3.0}
    eta_d, rate = (record(signal, values, 300) for signal in ("eta_d", "eta_dot_d"))
    t = T * np.arange(300)
    smooth = eta_d - np.outer(t > 2.999, [1.0, 0, 0, 0, 0, 0])  # a step has no rate
    assert rate[1:-1] == pytest.approx((smooth[2:] - smooth[:-2]) / (2 * T), abs=1e-3)
    assert np.abs(rate[:, 5]).max() == pytest.approx(0.5 * np.pi / 2, rel=1e-3)


def test_the_set_point_steps_and_sways_about_the_input():
    values = {"step.psi": 1.5, "step_begin": 0.9, "motion.x": 0.2, "motion_period": 4.0}
    eta_d = record("eta_d", values, 300, [1.0, 0, 0, 0, 0, 0.5])
    t = T * np.arange(300)
    assert eta_d[:, 0] == pytest.approx(1.0 + 0.2 * np.sin(np.pi / 2 * t))
    assert eta_d[:, 5] == pytest.approx(0.5 + 1.5 * (t > 0.899))
