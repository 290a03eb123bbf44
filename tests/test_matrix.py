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

import matplotlib.pyplot as plt
import numpy as np
import pytest
from click.testing import CliRunner
from pythonfmu.builder import FmuBuilder

from rov_cosim.systems import matrix_tables, swap_map
from rov_cosim.systems.command import main
from rov_cosim.systems.fleet import CONTROLLERS, STOP_TIME, VEHICLES
from rov_cosim.systems.master import simulate
from rov_cosim.systems.matrix import Cell, MatrixError, run_all, score_of, wired
from rov_cosim.systems.scores import LOST, OFFSET, SWAY, VERDICTS, score
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


@pytest.fixture(scope="module")
def papers(fmus):
    with wired(project_root(), ["hoang_kreuzer"], ["adaptive_pd"]) as loops:
        yield loops["hoang_kreuzer", "adaptive_pd"]


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
    for since, verdict in ((61.0, "held"), (59.0, "lost")):  # what was before the last 60 s does not count
        before = np.where(t < t[-1] - since, 2 * LOST[axis], 0.0)
        assert score(moved(still, axis, before), loop).verdict == verdict


def test_a_vehicle_that_lies_on_its_side_is_lost(still, loop):
    for angle, verdict in ((0.7, "held"), (-0.8, "lost")):
        for axis in ("phi", "theta"):
            found = score(moved(still, axis, angle), loop)
            assert (found.verdict, found.tilt) == (verdict, pytest.approx(abs(angle)))
    assert found.reason == "tilted beyond 45 deg"


def test_settling_is_that_of_the_last_axis_and_none_if_it_lasts_into_the_hold(still, loop):
    t = still["time"]  # up to 90 s, so that the hold begins at 30 s
    both = moved(moved(still, "y", np.where(t < 10.0, 0.1, 0.0)), "psi", np.where(t < 20.0, 0.1, 0.0))
    assert score(both, loop).settling == pytest.approx(20.0, abs=0.031)
    assert score(moved(both, "z", np.where(t < 31.0, 0.021, 0.0)), loop).settling is None


def test_a_vehicle_whose_measurement_is_gone_is_lost(still, loop):
    gone = still.copy()
    gone["passive_arm.eta_m_valid"][-200:] = False
    assert (score(gone, loop).verdict, score(gone, loop).reason) == ("lost", "the arm does not measure at the end")
    gone["passive_arm.eta_m_valid"][-1] = True  # a lost sample now and then is no loss of the vehicle
    assert score(gone, loop).verdict == "held"


def test_a_score_has_the_figures_of_the_hold(still, loop):
    t = still["time"]
    swaying = moved(moved(still, "x", 0.003 + 0.004 * np.sin(2 * np.pi * t)), "psi", 0.01)
    for i in range(1, 9):
        swaying[f"controller.u[{i}]"] = 2.0
    swaying["controller.saturated"] = t > t[-1] - 15.0
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


def changed_by(name, wiring):
    """Return the start values that a trouble changes, with those that they had."""
    ends = [f"{e.name}.{name}" for e in wiring.elements for name, v in e.variables.items() if v.causality != "output"]
    troubled = TROUBLES[name].applied(wiring)
    values = {end: (wiring.value(end), troubled.value(end)) for end in ends}
    return {end: (old, new) for end, (old, new) in values.items() if old != new}


K_P = {"x": 80.0, "y": 80.0, "z": 100.0}  # of the paper's vehicle
AWAY = {axis: -gap / np.sqrt(0.2**2 + 0.5**2 + 0.4**2) for axis, gap in (("x", 0.2), ("y", 0.5), ("z", 0.4))}


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("still_water", {}),
        ("current", {"scenario.current_mean.x": 0.2, "scenario.current_mean.y": 0.1}),
        (
            "varying_current_2",
            {"scenario.current_mean.x": 0.1, "scenario.current_std.x": 0.1, "scenario.current_std.y": 0.1}
            | {"scenario.seed": 1002},
        ),
        ("arm_pull", {"passive_arm.stiffness": 0.3 * 80.0}),
        (
            "umbilical_steps",
            {f"scenario.pull[1].F.{a}": s * 0.1 * K_P[a] for a, s in (("x", 1), ("y", -1), ("z", 1))}
            | {f"scenario.pull[2].F.{a}": s * K_P[a] for a, s in (("x", -0.2), ("y", 0.1), ("z", -0.1))}
            | {"scenario.pull[1].begin": 60.0, "scenario.pull[2].begin": 90.0},
        ),
        ("thruster_lag", {"rov_plant.thruster_time_constant": 0.3}),
        ("thruster_lag_long", {"rov_plant.thruster_time_constant": 1.0}),
        # Holding takes 25 N of four vertical thrusters, 6.25 N each.
        ("saturation", {f"{element}.thrust_max": 1.25 * 6.25 for element in ("rov_plant", "controller")}),
        ("overload", {f"{element}.thrust_max": 0.8 * 6.25 for element in ("rov_plant", "controller")}),
        ("dead_band", {"rov_plant.thruster_dead_band": 0.5 * 6.25}),
        ("thruster_lost", {"rov_plant.thruster[1].enabled": False}),
        ("thruster_lost_known", {f"{element}.thruster[1].enabled": False for element in ("rov_plant", "controller")}),
        ("thruster_reversed", {"rov_plant.thruster[1].d.x": -np.sqrt(0.5), "rov_plant.thruster[1].d.y": np.sqrt(0.5)}),
        (
            "wrong_mass",
            {"rov_plant.mass": 120.0, "rov_plant.I.xx": 5.55, "rov_plant.I.yy": 9.45, "rov_plant.I.zz": 8.85},
        ),
        ("wrong_r_A", {"controller.r_A.x": -0.4}),
        ("short_r_A", {"controller.r_A.x": 0.1}),
        ("wrong_r_C", {"controller.r_C.x": 0.4}),
        ("noise_2", {"passive_arm.noise_std": 0.01}),
        ("noise_4", {"passive_arm.noise_std": 0.02}),
        ("coloured_noise", {"passive_arm.noise_correlation_time": 2.0}),
        ("bias", {"passive_arm.bias.x": 0.02}),
        ("dropout", {"passive_arm.dropout": 0.1}),
        ("dropout_half", {"passive_arm.dropout": 0.5}),
        *((f"delay_{samples}", {"passive_arm.delay": samples}) for samples in range(1, 11)),
        *(
            (
                name,
                {f"scenario.pull[1].F.{a}": 1.5 * K_P[a] * AWAY[a] for a in "xyz"}
                | {f"scenario.pull[2].F.{a}": -1.5 * K_P[a] * AWAY[a] for a in "xyz"}
                | {"scenario.pull[1].begin": 60.0, "scenario.pull[2].begin": 60.0 + duration}
                | {f"scenario.pull[{i}].duration": duration for i in (1, 2)},
            )
            for name, duration in (("out_of_reach", 3.0), ("far_out_of_reach", 6.0))
        ),
        (
            "set_point_step",
            {"scenario.step.x": 0.3, "scenario.step.y": -0.2, "scenario.step.z": 0.2}
            | {"scenario.step.psi": 1.5708, "scenario.step_begin": 60.0},
        ),
        ("set_point_motion", {"scenario.motion.x": 0.1, "scenario.motion.z": 0.1, "scenario.motion.psi": 0.35}),
    ],
)
def test_a_trouble_is_what_its_description_says(papers, name, expected):
    changed = {end: new for end, (_, new) in changed_by(name, papers).items()}
    assert changed == pytest.approx(expected)


def test_the_other_troubles_are_for_vehicles_that_differ_from_the_papers(papers, loop):
    tested = test_a_trouble_is_what_its_description_says.pytestmark[0].args[1]
    others = {"paper_gains", "six_dof", "wrong_r_B", "varying_current_1", "varying_current_3"}
    assert {name for name, _ in tested} | others == set(TROUBLES)
    gains = changed_by("paper_gains", loop)
    assert {end.split(".")[1] for end in gains} == {"K_P", "K_D", "Gamma"}
    assert gains["controller.K_P.z"][1] == 100.0
    assert changed_by("six_dof", loop) == {"controller.control_roll_pitch": (False, True)}
    assert changed_by("wrong_r_B", loop) == {"controller.r_B.x": (0.0, pytest.approx(0.1 * 0.147))}
    for name, why in (("paper_gains", "changes nothing"), ("six_dof", "locked"), ("wrong_r_B", "locked")):
        with pytest.raises(DoesNotApplyError, match=why):
            TROUBLES[name].applied(papers)


def test_a_reversed_thruster_runs_away_where_more_than_half_of_a_direction_is_its_own(fmus):
    # With the share h of the direction of its own thrust, reversed, the loop's gain in it is 1 - 2 h.
    with wired(project_root(), list(VEHICLES), ["pid"]) as loops:
        scores = run_all(loops, ["thruster_reversed"], jobs=2).scores
        for (vehicle, _), wiring in loops.items():
            r, d = (
                np.array([[wiring.value(f"rov_plant.thruster[{i}].{g}.{a}") for a in "xyz"] for i in range(1, 9)])
                for g in "rd"
            )
            on = np.array([wiring.value(f"rov_plant.thruster[{i}].enabled") for i in range(1, 9)])
            B = (np.hstack([d, np.cross(r, d)])[on] * [1, 1, 1, 0, 0, 1]).T
            h = (np.linalg.pinv(B) @ B)[0, 0]
            lost = scores[Cell(vehicle, "pid", "thruster_reversed")].verdict == "lost"
            assert lost == (1 - 2 * h < 0)


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
    with pytest.raises(DoesNotApplyError, match=r"no controller\.r_A\.x, which the trouble is about"):
        TROUBLES["wrong_r_A"].applied(loops[VEHICLE, "pid"])


# --- The matrix -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def small(loops):
    """Return the part of the matrix that a quick run shows."""
    return run_all(loops, ["still_water", "delay_5", "wrong_r_A", "overload"], jobs=2)


def test_the_matrix_is_the_runs_one_by_one(loops, small):
    assert list(small.left_out) == [Cell(VEHICLE, "pid", "wrong_r_A")]
    assert list(small.scores) == [
        Cell(VEHICLE, controller, trouble)
        for controller in ("adaptive_pd", "pid", "pd")
        for trouble in ("still_water", "delay_5", "wrong_r_A", "overload")
        if (controller, trouble) != ("pid", "wrong_r_A")
    ]
    for cell in (Cell(VEHICLE, "adaptive_pd", "delay_5"), Cell(VEHICLE, "pd", "overload")):
        assert small.scores[cell] == score_of(loops[cell.vehicle, cell.controller], cell.trouble)


def test_the_small_part_shows_what_the_whole_does(small):
    verdicts = {cell[1:]: score.verdict for cell, score in small.scores.items()}
    assert verdicts["adaptive_pd", "still_water"] == verdicts["adaptive_pd", "delay_5"] == "held"
    assert verdicts["pd", "still_water"] == "offset"
    assert {verdicts[controller, "overload"] for controller in ("adaptive_pd", "pid", "pd")} == {"lost"}


def test_a_controller_that_refuses_the_trouble_is_a_row_with_the_reason(fmus):
    with wired(project_root(), ["minerva"], ["adaptive_pd"]) as loops:
        scores = run_all(loops, ["thruster_lost_known"], jobs=1).scores
    (found,) = scores.values()
    assert found.verdict == "lost"
    assert "The enabled thrusters cannot produce every controlled wrench" in found.reason


def test_the_tables_hold_every_cell(small, tmp_path):
    matrix_tables.write_csv(small, tmp_path / "matrix.csv")
    with open(tmp_path / "matrix.csv") as file:
        rows = list(csv.DictReader(file))
    assert [(row["vehicle"], row["controller"], row["trouble"]) for row in rows] == [
        tuple(cell) for cell in small.scores
    ]
    for row, found in zip(rows, small.scores.values(), strict=True):
        assert row["verdict"] == found.verdict
        assert float(row["rms"]) == pytest.approx(found.rms, rel=1e-5)
    page = matrix_tables.markdown(small, "as a test")
    assert "as a test" in page
    found = small.scores[Cell(VEHICLE, "pd", "still_water")]
    cells = [cell.strip() for cell in re.search(r"^\| still_water \|(.*)\|$", page, re.M).group(1).split("|")]
    assert cells[2] == f"offset, {1e3 * found.rms:.0f} mm, {np.degrees(found.rms_yaw):.1f} deg"
    settling = small.scores[Cell(VEHICLE, "pid", "still_water")].settling
    assert re.fullmatch(rf"held, 1 mm, 0\.0 deg, {settling:.0f} s", cells[1])
    assert re.search(r"^\| wrong_r_A \| held|offset.* \|  \| offset.* \|$", page, re.M)
    assert f"| wrong_r_A | {VEHICLE} pid | There is no controller.r_A.x" in page


def test_the_heat_map_shows_each_verdict_in_its_colour(small, tmp_path):
    matrix_tables.draw_heat_map(small, tmp_path / "matrix.png")
    pixels = (plt.imread(tmp_path / "matrix.png")[..., :3] * 255).round().astype(int).reshape(-1, 3)
    shown = {}
    for verdict, colour in zip(VERDICTS, matrix_tables.COLOURS, strict=True):
        rgb = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
        shown[verdict] = int((pixels == rgb).all(axis=1).sum())
    legend = shown["oscillates"]  # none of the cells
    cells = Counter(found.verdict for found in small.scores.values())
    assert cells["oscillates"] == 0 < legend
    size = {verdict: (shown[verdict] - legend) / cells[verdict] for verdict in ("held", "offset", "lost")}
    assert size["held"] == pytest.approx(size["offset"], rel=0.15)
    assert size["lost"] == pytest.approx(size["offset"], rel=0.3)  # no figures stand in it


def test_an_interrupted_matrix_keeps_its_scores(loops):
    def interrupted(runs, total):
        for n, run in enumerate(runs):
            if n == 2:
                raise KeyboardInterrupt
            yield run

    with pytest.raises(MatrixError, match="Interrupted after 2 of 6 runs") as error:
        run_all(loops, ["still_water", "delay_5"], jobs=1, progress=interrupted)
    assert len(error.value.matrix.scores) == 2


def test_an_fmu_that_crashes_its_process_is_told(fmus, tmp_path):
    crashing = FmuBuilder.build_FMU(Path(__file__).parent / "fmus" / "crashing.py", tmp_path)
    maps = {"scenario": swap_map.SwapMap(without=("set_point",))}
    with (
        wired(project_root(), [VEHICLE], ["pd"], {"scenario": crashing}, maps) as crash,
        pytest.raises(MatrixError, match="A process died, of an FMU that crashed it, after 0 of 2 runs"),
    ):
        run_all(crash, ["still_water", "delay_5"], jobs=2)


@pytest.mark.slow
def test_the_page_has_the_verdicts_of_the_matrix_and_each_failure_is_explained(fmus):
    with wired(project_root(), list(VEHICLES), CONTROLLERS) as loops:
        matrix = run_all(loops, list(TROUBLES), jobs=os.cpu_count())

    def verdicts(text):
        # The digits of a vehicle that swings are those of its last rounding; the verdicts are not.
        return re.sub(r", [\d., a-z]*(?= \|)", "", text)

    page = (project_root() / "systems" / "MATRIX.md").read_text()
    assert verdicts(matrix_tables.markdown(matrix)) == verdicts(page)
    told = (project_root() / "systems" / "FLEET.md").read_text().partition("## Why each trouble fails")[2]
    explained = {name for row in re.findall(r"^\| (`.*?) \|", told, re.M) for name in re.findall(r"`(\w+)`", row)}
    if {"delay_7", "delay_10"} <= explained:
        explained |= {"delay_8", "delay_9"}
    # PD has its offset everywhere: what is told of it is where it does worse.
    allowed = {"pd": ("held", "offset")}
    failed = {
        cell.trouble
        for cell, found in matrix.scores.items()
        if found.verdict not in allowed.get(cell.controller, ("held",))
    }
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
    assert {path.name for path in tmp_path.iterdir()} == {f"matrix_part.{end}" for end in ("csv", "md", "png")}
    assert "passive_arm.seed = 3" in (tmp_path / "matrix_part.md").read_text()


def test_a_cell_can_be_run_and_looked_at_alone(archives, small, tmp_path):
    done = call("run", f"{VEHICLE}_pid", "--trouble", "delay_5", "--output", tmp_path)
    assert done.exit_code == 0, done.output
    with open(tmp_path / f"{VEHICLE}_pid_delay_5.csv") as file:
        x = np.array([float(row["rov_plant.eta.x"]) for row in csv.DictReader(file)])
    found = small.scores[Cell(VEHICLE, "pid", "delay_5")]
    assert f"verdict over the last 60 s: {found.verdict}" in done.output
    assert len(x) == round(STOP_TIME / 0.03) + 1
    assert abs(x[-2000:].mean()) <= found.mean + 1e-6


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["run", "station_keeping", "--trouble", "delay_5"], None),
        (["run", "station_keeping", "--trouble", "current"], "There is no scenario.current_mean.x, which the trouble"),
        (["run", "bluerov2", "--trouble", "delay5"], "there is no trouble delay5. Did you mean delay_5"),
        (["matrix", "--vehicle", "titanic"], "there is no vehicle titanic. Known: hoang_kreuzer"),
        (
            ["matrix", "--controller", "pid", "--trouble", "wrong_r_A"],
            "No trouble applies: There is no controller.r_A.x",
        ),
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
    rows = (Path(tmp_path) / "matrix_part.csv").read_text().splitlines()
    assert len(rows) > 1
    assert not any("Interrupted" in row for row in rows)
