"""How a run is scored: the rules of the verdicts, and the figures of the hold."""

import numpy as np
import pytest

from rov_cosim.master.simulation import simulate
from rov_cosim.ssp.declaration import wire
from rov_cosim.study.campaign.case import score_of
from rov_cosim.study.changes import Changes
from rov_cosim.study.runs import simulated
from rov_cosim.study.scores import LOST, OFFSET, SWAY, VERDICTS, outputs_scored, score
from rov_cosim.study.settings import Settings
from rov_cosim.systems.catalogue import SYSTEMS

VEHICLE = "bluerov2"


@pytest.fixture(scope="module")
def still(loop):
    """Return a run at rest, whose pose the tests replace."""
    results = simulate(loop, stop_time=90.0)
    for axis in ("x", "y", "z", "phi", "theta", "psi"):
        results[f"rov_plant.eta.{axis}"] = 0.0
    return results


def moved(results, axis, values):
    changed = results.copy()
    changed[f"rov_plant.eta.{axis}"] = values
    return changed


@pytest.mark.parametrize("axis", ["x", "z", "psi"])
def test_the_verdict_follows_the_stated_rules(still, loop, axis):
    t = still["time"]
    wave = np.sqrt(2) * np.sin(2 * np.pi * t / 3.0)  # of root mean square 1
    assert score(still, loop).verdict == "held"
    for factor, bound in ((0.9, "held"), (1.1, "offset")):
        assert score(moved(still, axis, factor * OFFSET[axis]), loop).verdict == bound
    for factor, bound in ((0.9, "held"), (1.1, "oscillates")):
        assert score(moved(still, axis, factor * SWAY[axis] * wave), loop).verdict == bound
    for factor, bound in ((0.9, "oscillates"), (1.1, "lost")):
        once = np.where(t > t[-1] - 5.0, factor * LOST[axis], 0.0)
        assert score(moved(still, axis, once), loop).verdict == bound
    for since, verdict in ((19.0, "held"), (17.0, "lost")):  # what was before the last fifth does not count
        before = np.where(t < t[-1] - since, 2 * LOST[axis], 0.0)
        assert score(moved(still, axis, before), loop).verdict == verdict


def test_a_vehicle_that_lies_on_its_side_is_lost(still, loop):
    for angle, verdict in ((0.7, "held"), (-0.8, "lost")):
        for axis in ("phi", "theta"):
            found = score(moved(still, axis, angle), loop)
            assert (found.verdict, found.tilt) == (verdict, pytest.approx(abs(angle)))
    assert found.reason == "tilted beyond 45 deg"


def test_settling_is_that_of_the_last_axis_and_none_if_it_lasts_into_the_hold(still, loop):
    t = still["time"]  # up to 90 s, so that the hold begins at 72 s
    both = moved(moved(still, "y", np.where(t < 10.0, 0.1, 0.0)), "psi", np.where(t < 20.0, 0.1, 0.0))
    assert score(both, loop).settling == pytest.approx(20.0, abs=0.031)
    assert score(moved(both, "z", np.where(t < 73.0, 0.021, 0.0)), loop).settling is None


def test_a_vehicle_whose_measurement_is_gone_is_lost(still, loop):
    gone = still.copy()
    gone["passive_arm.eta_m_valid"][-200:] = False
    assert str(score(gone, loop)) == "lost at 84.03 s: the pose is not measured at the end"
    away = gone.copy()
    away["passive_arm.attached"][-200:] = False
    assert str(score(away, loop)) == "lost at 84.03 s: out of the sensor's reach"
    gone["passive_arm.eta_m_valid"][-1] = True  # a lost sample now and then is no loss of the vehicle
    assert score(gone, loop).verdict == "held"


def test_a_loss_is_told_from_its_begin(still, loop):
    t = still["time"]
    far = np.where((t > 20.0) & (t < 30.0), 2.0, np.where(t > 60.0, 0.5 + (t - 60.0) / 10.0, 0.0))
    found = score(moved(still, "y", far), loop)
    assert (found.lost_at, found.reason) == (pytest.approx(65.0, abs=0.031), "y beyond 1 m or 90 deg")
    failed = score(still[:100], loop, "rov_plant: The step fails.")
    assert str(failed) == "lost at 2.97 s: rov_plant: The step fails."


@pytest.mark.parametrize("rows", [1, 2, 11])
def test_a_run_of_any_length_has_a_verdict(still, loop, rows):
    assert score(still[:rows], loop).verdict == "held"
    assert score(moved(still, "x", 0.02)[:rows], loop).verdict == "offset"


def test_a_score_has_the_figures_of_the_hold(still, loop):
    t = still["time"]
    swaying = moved(moved(still, "x", 0.003 + 0.004 * np.sin(2 * np.pi * t)), "psi", 0.01)
    for i in range(1, 9):
        swaying[f"controller.u[{i}]"] = 2.0
    swaying["controller.saturated"] = t > t[-1] - 4.5
    for axis in "XYZN":
        swaying[f"controller.disturbance.{axis}"] = 3.0
        swaying[f"rov_plant.disturbance.{axis}"] = 1.0
    found = score(swaying, loop)
    assert found.mean == pytest.approx(0.003, abs=1e-5)
    assert found.rms == pytest.approx(np.hypot(0.003, 0.004 / np.sqrt(2)), rel=1e-3)
    assert found.worst == pytest.approx(0.007, rel=1e-2)
    assert found.mean_yaw == found.worst_yaw == pytest.approx(0.01)
    assert found.effort == pytest.approx(2.0 * np.sqrt(8))
    assert found.saturated == pytest.approx(0.25, abs=0.01)
    assert (found.wrong_force, found.wrong_moment) == pytest.approx((2 * np.sqrt(3), 2.0))
    assert found.settling == 0.0


def test_chattering_is_the_variation_of_the_thrust_that_moves_most(still, loop):
    switching = still.copy()
    for i in range(1, 9):
        switching[f"controller.u[{i}]"] = 10.0  # a constant thrust is no chattering
    switching["controller.u[3]"] = 4.0 * (-1.0) ** np.arange(len(still))
    switching["controller.u[4]"] = np.sin(2 * np.pi * still["time"] / 9.0)
    assert score(switching, loop).chattering == pytest.approx(8.0 / 0.03)
    switching["controller.u[3]"] = 10.0
    assert score(switching, loop).chattering == pytest.approx(4.0 / 9.0, rel=0.01)
    assert score(switching[:1], loop).chattering == 0.0


def test_the_outputs_that_are_scored_give_the_score_of_all(loops):
    found = set()
    for trouble in ("still_water", "varying_current_1", "arm_pull", "overload", "far_out_of_reach"):
        for controller in ("adaptive_pd", "extended", "pd"):
            wiring = Changes(troubles=(trouble,)).applied(loops[VEHICLE, controller])
            every, some = simulate(wiring), simulate(wiring, recorded=outputs_scored(wiring))
            assert len(some.dtype.names) < len(every.dtype.names) / 2
            whole = score(every, wiring)
            assert score(some, wiring) == score_of(wiring, Changes()) == whole
            found.add(whole.verdict)
    assert found == set(VERDICTS)


@pytest.mark.parametrize("apart", [False, True])
def test_a_set_point_that_is_fed_is_what_the_vehicle_is_held_to(fmus, tmp_path, apart):
    table = tmp_path / "given.csv"
    table.write_text("time,controller.eta_d.x\n0,0\n20,0.1\n", encoding="utf-8")
    wiring = wire(SYSTEMS["station_keeping"], fmus)
    done = simulated(wiring, Settings(input=table, isolate=apart))
    assert done.score.verdict == "held"
    assert done.results["controller.eta_d.x"][[0, -1]].tolist() == [0.0, 0.1]
    assert done.results["controller.eta_d.x"][100] == pytest.approx(0.015)
    assert score(simulate(wiring), wiring).mean == pytest.approx(done.score.mean, abs=2e-3)


def test_pd_estimates_nothing(loops):
    assert score_of(loops[VEHICLE, "pd"], Changes(troubles=("still_water",))).wrong_force is None


def test_the_estimate_of_the_others_comes_to_the_disturbance(loops):
    for controller in ("adaptive_pd", "pid"):
        found = score_of(loops[VEHICLE, controller], Changes(troubles=("still_water",)))
        assert found.wrong_force < 0.1  # of 2 to 4 N
        assert found.wrong_moment < 0.01


@pytest.mark.parametrize("name", ["rov_plant.eta.phi", "rov_plant.eta.x", "controller.u[3]"])
def test_what_is_not_finite_is_no_hold(still, loop, name):
    broken = still.copy()
    broken[name][-1] = np.nan
    found = score(broken, loop)
    assert (found.verdict, found.lost_at) == ("lost", still["time"][-1])
    assert "not finite" in found.reason
    assert found.settling is None or name != "rov_plant.eta.x"


def test_a_measurement_that_is_gone_for_less_than_three_seconds_is_no_loss(still, loop):
    gone = still.copy()
    gone["passive_arm.eta_m_valid"][-90:] = False
    assert score(gone, loop).verdict == "held"
    gone["passive_arm.eta_m_valid"][-101:] = False
    assert score(gone, loop).verdict == "lost"


def test_the_hold_is_a_share_of_the_run_whatever_its_start(still, loop):
    late = still.copy()
    late["time"] += 1000.0
    moved_early = moved(late, "x", np.where(still["time"] < 60.0, 2 * LOST["x"], 0.0))
    assert score(moved_early, loop).verdict == "held"
