"""Troubles, scores and the matrix of both: what each trouble brings about, the rules of the verdicts, parallel runs."""

import csv
import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from rov_cosim.systems import matrix_tables
from rov_cosim.systems.command import main
from rov_cosim.systems.fleet import CONTROLLERS, STOP_TIME, VEHICLES
from rov_cosim.systems.master import simulate
from rov_cosim.systems.matrix import Cell, MatrixError, run_all, score_of, wired
from rov_cosim.systems.scores import HOLD, LOST, OFFSET, SWAY, Score, score
from rov_cosim.systems.session import project_root
from rov_cosim.systems.ship import DoesNotApplyError
from rov_cosim.systems.troubles import ONSET, TROUBLES

VEHICLE = "bluerov2"


@pytest.fixture(scope="module")
def loops(fmus):
    with wired(project_root(), [VEHICLE], ["adaptive_pd", "pid", "pd"]) as loops:
        yield loops


@pytest.fixture(scope="module")
def loop(loops):
    return loops[VEHICLE, "adaptive_pd"]


# --- Scores ---------------------------------------------------------------------------------------------------------


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
    wave = np.sqrt(2) * np.sin(2 * np.pi * t / 5.0)  # of root mean square 1
    assert score(still, loop).verdict == "held"
    for factor, bound in ((0.9, "held"), (1.1, "offset")):
        assert score(moved(still, axis, factor * OFFSET[axis]), loop).verdict == bound
    for factor, bound in ((0.9, "held"), (1.1, "oscillates")):
        assert score(moved(still, axis, factor * SWAY[axis] * wave), loop).verdict == bound
    for factor, bound in ((0.9, "oscillates"), (1.1, "lost")):
        once = np.where(t > t[-1] - 5.0, factor * LOST[axis], 0.0)
        assert score(moved(still, axis, once), loop).verdict == bound
    before = np.where(t < t[-1] - HOLD - 1.0, 2 * LOST[axis], 0.0)
    assert score(moved(still, axis, before), loop).verdict == "held"  # what was before the hold does not count


def test_a_vehicle_whose_measurement_is_gone_is_lost(still, loop):
    gone = still.copy()
    gone["passive_arm.eta_m_valid"][-200:] = False
    assert score(gone, loop).verdict == "lost"
    gone["passive_arm.eta_m_valid"][-1] = True  # a lost sample now and then is no loss of the vehicle
    assert score(gone, loop).verdict == "held"


def test_a_score_has_the_figures_of_the_hold(still, loop):
    t = still["time"]
    swaying = moved(moved(still, "x", 0.003 + 0.004 * np.sin(2 * np.pi * t)), "psi", 0.01)
    for i in range(1, 9):
        swaying[f"controller.u[{i}]"] = 2.0
    swaying["controller.saturated"] = t > t[-1] - HOLD / 4
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


def test_pd_estimates_nothing(loops):
    assert score_of(loops[VEHICLE, "pd"], "still_water").wrong_force is None


def test_the_estimate_of_the_others_comes_to_the_disturbance(loops):
    for controller in ("adaptive_pd", "pid"):
        found = score_of(loops[VEHICLE, controller], "still_water")
        assert found.wrong_force < 0.1  # of 2 to 4 N
        assert found.wrong_moment < 0.01


# --- Troubles -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name in TROUBLES if name != "still_water"])
def test_each_trouble_changes_the_run_and_repeats(loop, name):
    stop = ONSET + 5.0
    troubled = TROUBLES[name].applied(loop)
    runs = [simulate(wiring, stop_time=stop) for wiring in (loop, troubled, troubled)]
    assert np.array_equal(runs[1], runs[2])
    assert any(not np.array_equal(runs[0][field], runs[1][field]) for field in runs[0].dtype.names)


def test_the_limits_of_saturation_are_about_what_holding_takes(loop):
    at_rest = simulate(loop)[-2000:]
    needed = max(abs(at_rest[f"controller.u[{i}]"].mean()) for i in range(1, 9))
    for name, share in (("saturation", 1.25), ("overload", 0.8)):
        limit = TROUBLES[name].applied(loop).value("rov_plant.thrust_max")
        # At rest the vehicle is tilted a little, which the limit leaves out.
        assert limit == pytest.approx(share * needed, rel=0.05)


def test_pulls_are_worth_their_offset_of_a_pd_controller(loops):
    pd = TROUBLES["umbilical_steps"].applied(loops[VEHICLE, "pd"])
    results = simulate(pd, stop_time=ONSET + 30.0)
    time = results["time"]
    before, after = ((time > t - 5.0) & (time < t) for t in (ONSET, ONSET + 30.0))
    for axis, offset in (("x", 0.1), ("y", -0.1), ("z", 0.1)):
        eta = results[f"rov_plant.eta.{axis}"]
        assert eta[after].mean() - eta[before].mean() == pytest.approx(offset, abs=5e-3)


def test_the_arm_is_out_of_reach_for_a_while_and_comes_back(loop):
    results = simulate(TROUBLES["out_of_reach"].applied(loop), stop_time=100.0)
    away = results["time"][~results["passive_arm.attached"]]
    assert ONSET < away.min() < away.max() < 80.0


def test_a_trouble_of_what_a_loop_has_not_does_not_apply(loops):
    with pytest.raises(DoesNotApplyError, match=r"no controller\.r_A\.x, which the trouble needs"):
        TROUBLES["wrong_r_A"].applied(loops[VEHICLE, "pid"])
    assert score_of(loops[VEHICLE, "pid"], "wrong_r_A") is None


# --- The matrix -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def small(loops):
    """Return the part of the matrix that a quick run shows."""
    return run_all(loops, ["still_water", "delay_5", "wrong_r_A", "overload"], jobs=2)


def test_the_matrix_is_the_runs_one_by_one(loops, small):
    assert list(small) == [
        Cell(VEHICLE, controller, trouble)
        for controller in ("adaptive_pd", "pid", "pd")
        for trouble in ("still_water", "delay_5", "wrong_r_A", "overload")
        if (controller, trouble) != ("pid", "wrong_r_A")
    ]
    for cell in (Cell(VEHICLE, "adaptive_pd", "delay_5"), Cell(VEHICLE, "pd", "overload")):
        assert small[cell] == score_of(loops[cell.vehicle, cell.controller], cell.trouble)


def test_the_small_part_shows_what_the_whole_does(small):
    verdicts = {cell[1:]: score.verdict for cell, score in small.items()}
    assert verdicts["adaptive_pd", "still_water"] == verdicts["adaptive_pd", "delay_5"] == "held"
    assert verdicts["pd", "still_water"] == "offset"
    assert {verdicts[controller, "overload"] for controller in ("adaptive_pd", "pid", "pd")} == {"lost"}


def test_a_controller_that_refuses_the_trouble_is_a_row_with_the_reason(fmus):
    with wired(project_root(), ["minerva"], ["adaptive_pd"]) as loops:
        scores = run_all(loops, ["thruster_lost_known"], jobs=1)
    (found,) = scores.values()
    assert found.verdict == "lost"
    assert "The enabled thrusters cannot produce every controlled wrench" in found.reason


def test_the_tables_hold_every_cell(small, tmp_path):
    matrix_tables.write_csv(small, tmp_path / "matrix.csv")
    with open(tmp_path / "matrix.csv") as file:
        rows = list(csv.DictReader(file))
    assert [(row["vehicle"], row["controller"], row["trouble"]) for row in rows] == [tuple(cell) for cell in small]
    for row, found in zip(rows, small.values(), strict=True):
        assert row["verdict"] == found.verdict
        assert float(row["rms"]) == pytest.approx(found.rms, rel=1e-5)
    text = matrix_tables.markdown(small)
    held = Counter(found.verdict for found in small.values())["held"]
    assert text.count("held, ") == held
    matrix_tables.draw_heat_map(small, tmp_path / "matrix.png")
    assert (tmp_path / "matrix.png").read_bytes().startswith(b"\x89PNG")


def test_an_interrupted_matrix_keeps_its_scores(loops):
    def interrupted(runs, total):
        for n, run in enumerate(runs):
            if n == 2:
                raise KeyboardInterrupt
            yield run

    with pytest.raises(MatrixError, match="Interrupted after 2 of 6 runs") as error:
        run_all(loops, ["still_water", "delay_5"], jobs=1, progress=interrupted)
    assert len(error.value.scores) == 2
    assert all(isinstance(found, Score) for found in error.value.scores.values())


@pytest.mark.slow
def test_the_page_has_the_verdicts_of_the_matrix_and_each_failure_is_explained(fmus):
    with wired(project_root(), list(VEHICLES), CONTROLLERS) as loops:
        scores = run_all(loops, list(TROUBLES), jobs=os.cpu_count())

    def verdicts(text):
        # The digits of a vehicle that swings are those of its last rounding; the verdicts are not.
        return re.sub(r", [\d., a-z]*(?= \|)", "", text)

    page = (project_root() / "systems" / "MATRIX.md").read_text()
    assert verdicts(matrix_tables.markdown(scores)) == verdicts(page)
    told = (project_root() / "systems" / "FLEET.md").read_text().partition("## Why each trouble fails")[2]
    explained = {name for row in re.findall(r"^\| (`.*?) \|", told, re.M) for name in re.findall(r"`(\w+)`", row)}
    if {"delay_7", "delay_10"} <= explained:
        explained |= {"delay_8", "delay_9"}
    failed = {cell.trouble for cell, found in scores.items() if cell.controller != "pd" and found.verdict != "held"}
    assert failed == explained
    never = told.partition("PD has an offset")[2]
    assert set(TROUBLES) - failed - {"still_water"} <= {
        *re.findall(r"`(\w+)`", never),
        *(f"delay_{samples}" for samples in range(1, 7)),
    }


def call(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def test_the_command_writes_tables_and_picture(loops, tmp_path):
    some = ["--vehicle", VEHICLE, "--controller", "adaptive_pd", "--trouble", "still_water", "--trouble", "bias"]
    done = call("matrix", *some, "--jobs", 1, "--set", "passive_arm.seed=3", "--output", tmp_path)
    assert done.exit_code == 0, done.output
    assert "adaptive_pd  1 held, 1 offset, 0 oscillates, 0 lost" in done.output
    assert {path.name for path in tmp_path.iterdir()} == {"matrix.csv", "matrix.md", "matrix.png"}


def test_a_cell_can_be_run_and_looked_at_alone(archives, small, tmp_path):
    done = call("run", f"{VEHICLE}_pid", "--trouble", "delay_5", "--output", tmp_path)
    assert done.exit_code == 0, done.output
    with open(tmp_path / f"{VEHICLE}_pid_delay_5.csv") as file:
        x = np.array([float(row["rov_plant.eta.x"]) for row in csv.DictReader(file)])
    found = small[Cell(VEHICLE, "pid", "delay_5")]
    assert len(x) == round(STOP_TIME / 0.03) + 1
    assert abs(x[-2000:].mean()) <= found.mean + 1e-6


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["run", "station_keeping", "--trouble", "delay_5"], None),
        (["run", "station_keeping", "--trouble", "current"], "There is no scenario.current_mean.x, which the trouble"),
        (["run", "bluerov2", "--trouble", "delay"], "'delay' is not one of"),
        (["matrix", "--vehicle", "titanic"], "'titanic' is not one of"),
        (["matrix", "--vehicle", "bluerov2", "--set", "controller.Kp=1"], "There is no variable controller.Kp"),
        (["matrix", "--vehicle", "bluerov2", "--swap", "rov_plant=none.fmu"], "none.fmu"),
    ],
)
def test_bad_input_ends_with_a_reason(archives, tmp_path, arguments, reason):
    done = call(*arguments, "--output", tmp_path)
    assert (done.exit_code != 0) == (reason is not None)
    assert (reason or "") in done.output
    assert done.exception is None or isinstance(done.exception, SystemExit)


@pytest.mark.slow
def test_ctrl_c_ends_the_command_with_the_scores_so_far(fmus, tmp_path):
    command = [sys.executable, "-m", "rov_cosim.systems.command", "matrix", "--jobs", "2", "--output", str(tmp_path)]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    time.sleep(15.0)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to the parent and to its processes
    _, told = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "The results so far are in" in told
    assert "Traceback" not in told
    rows = (Path(tmp_path) / "matrix.csv").read_text().splitlines()
    assert len(rows) > 1
    assert not any("Interrupted" in row for row in rows)
