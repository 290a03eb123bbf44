"""The matrix of vehicles, controllers and troubles: parallel runs, tables, the command."""

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

from rov_cosim.exporters.build import project_root
from rov_cosim.study import matrix_tables
from rov_cosim.study.campaign.case import score_of
from rov_cosim.study.changes import Changes
from rov_cosim.study.matrix import Cell, MatrixError, run_all, wired
from rov_cosim.study.score_table import write_scores
from rov_cosim.study.scores import VERDICTS
from rov_cosim.study.troubles import TROUBLES
from rov_cosim.systems.catalogue import SYSTEMS
from rov_cosim.systems.fleet import CONTROLLERS, STOP_TIME, VEHICLES, WIRED
from typed import call, one_line

VEHICLE = "bluerov2"


@pytest.fixture(scope="module")
def small(loops):
    """Return the part of the matrix that a quick run shows."""
    return run_all(loops, ["still_water", "delay_5", "wrong_r_A", "overload"], jobs=2)


def test_the_matrix_is_the_runs_one_by_one(loops, small):
    assert list(small.left_out) == [Cell(VEHICLE, "pid", "wrong_r_A")]
    assert list(small.scores) == [
        Cell(VEHICLE, controller, trouble)
        for controller in ("adaptive_pd", "extended", "pid", "pd")
        for trouble in ("still_water", "delay_5", "wrong_r_A", "overload")
        if (controller, trouble) != ("pid", "wrong_r_A")
    ]
    for cell in (Cell(VEHICLE, "adaptive_pd", "delay_5"), Cell(VEHICLE, "pd", "overload")):
        assert small.scores[cell] == score_of(loops[cell.vehicle, cell.controller], Changes(troubles=(cell.trouble,)))


@pytest.mark.slow
def test_of_several_seeds_a_cell_has_the_worst(loops):
    two = {key: loops[key] for key in ((VEHICLE, "adaptive_pd"), (VEHICLE, "pd"))}
    one_by_one = {
        seed: run_all(
            {
                key: loop.with_values({"passive_arm.seed": seed, "scenario.seed": 1000 + seed})
                for key, loop in two.items()
            },
            ["noise_4"],
            jobs=2,
        ).scores
        for seed in (1, 2)
    }
    worst = run_all(two, ["noise_4"], jobs=2, seeds=2).scores
    for cell, score in worst.items():
        found = [one_by_one[seed][cell] for seed in (1, 2)]
        assert found[0] != found[1]
        assert score == max(found, key=lambda one: (VERDICTS.index(one.verdict), one.rms))


def test_the_small_part_shows_what_the_whole_does(small):
    verdicts = {cell[1:]: score.verdict for cell, score in small.scores.items()}
    assert verdicts["adaptive_pd", "still_water"] == verdicts["adaptive_pd", "delay_5"] == "held"
    assert verdicts["pd", "still_water"] == "offset"
    assert {verdicts[controller, "overload"] for controller in ("adaptive_pd", "extended", "pid", "pd")} == {"lost"}


def test_a_controller_that_refuses_the_trouble_is_a_row_with_the_reason(fmus):
    scores = run_all(wired(["minerva"], ["adaptive_pd"]), ["thruster_lost_known"], jobs=1).scores
    (found,) = scores.values()
    assert found.verdict == "lost"
    assert "The enabled thrusters cannot produce every controlled wrench" in found.reason


def test_the_tables_hold_every_cell(small, tmp_path):
    write_scores(small.scores, Cell._fields, tmp_path / "matrix.csv")
    with open(tmp_path / "matrix.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["vehicle"], row["controller"], row["trouble"]) for row in rows] == [
        tuple(cell) for cell in small.scores
    ]
    for row, found in zip(rows, small.scores.values(), strict=True):
        assert row["verdict"] == found.verdict
        assert float(row["rms"]) == pytest.approx(found.rms, rel=1e-5)
    page = matrix_tables.markdown(small, "rov-cosim matrix", "matrix.svg", "as a test")
    assert "as a test" in page
    found = small.scores[Cell(VEHICLE, "pd", "still_water")]
    cells = [cell.strip() for cell in re.search(r"^\| still_water \|(.*)\|$", page, re.M).group(1).split("|")]
    assert cells[3] == f"offset, {1e3 * found.rms:.0f} mm, {np.degrees(found.rms_yaw):.1f} deg"
    told = re.search(rf"^\| {VEHICLE} \| ([\d |]*) \|$", page, re.M).group(1).split(" | ")
    calm = [
        small.scores[Cell(VEHICLE, controller, "still_water")]
        for controller in ("adaptive_pd", "extended", "pid", "pd")
    ]
    assert told == [f"{found.chattering:.0f}" for found in calm]
    settling = small.scores[Cell(VEHICLE, "pid", "still_water")].settling
    assert re.fullmatch(rf"held, 1 mm, 0\.1 deg, {settling:.0f} s", cells[2])
    assert re.search(r"^\| wrong_r_A \| (held|offset)[^|]* \| held[^|]* \|  \| offset[^|]* \|$", page, re.M)
    assert f"| wrong_r_A | {VEHICLE} pid | There is no controller.r_A.x" in page


def test_the_heat_map_shows_each_verdict_in_its_colour(small, tmp_path):
    matrix_tables.draw_heat_map(small, [tmp_path / "matrix.png"])
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


def test_a_swapped_controller_is_one_column_called_by_its_own_name(fmus, tmp_path):
    swapped = Changes(swaps={"controller": fmus["sun_cheah"]})
    loops = wired([VEHICLE], ("adaptive_pd", "pid", "pd"), swapped, systems=[SYSTEMS["station_keeping"]])
    assert list(loops) == [(VEHICLE, "sun_cheah"), ("station_keeping", "sun_cheah")]
    two = ("--controller", "pid", "--controller", "pd", "--swap", f"controller={fmus['sun_cheah']}")
    assert "one controller into all loops: name one --controller" in one_line(
        call("matrix", *two, "--output", tmp_path)
    )


def test_an_interrupted_matrix_keeps_its_scores(loops):
    def interrupted(runs, total):
        for n, run in enumerate(runs):
            if n == 2:
                raise KeyboardInterrupt
            yield run

    with pytest.raises(MatrixError, match="Interrupted after 2 of 8 runs") as error:
        run_all(loops, ["still_water", "delay_5"], jobs=1, progress=interrupted)
    assert len(error.value.matrix.scores) == 2


@pytest.mark.slow
def test_a_temporary_folder_may_be_too_long_for_a_socket(fmus, tmp_path):
    temporary = tmp_path / ("a" * 100)
    temporary.mkdir()
    some = ["--vehicle", VEHICLE, "--controller", "pd", "--trouble", "still_water", "--jobs", "2", "--output", tmp_path]
    command = [sys.executable, "-m", "rov_cosim.cli.main", "matrix", *map(str, some)]
    done = subprocess.run(
        command, env={**os.environ, "TMPDIR": str(temporary)}, capture_output=True, text=True, check=False
    )
    assert (done.returncode, "1 offset" in done.stdout) == (0, True), done.stderr
    assert not list(temporary.iterdir())


@pytest.mark.slow
def test_the_page_has_the_verdicts_of_the_matrix_and_each_failure_is_explained(fmus):
    matrix = run_all(wired([*VEHICLES, *WIRED], CONTROLLERS), list(TROUBLES), jobs=os.cpu_count())

    def verdicts(text):
        # The digits of a vehicle that swings are those of its last rounding; the verdicts are not.
        return re.sub(r", [\d., a-z]*(?= \|)", "", text)

    page = (project_root() / "systems" / "MATRIX.md").read_text()
    assert verdicts(matrix_tables.markdown(matrix, "rov-cosim matrix", "matrix.svg")) == verdicts(page)
    told = (project_root() / "systems" / "FLEET.md").read_text().partition("## Why each trouble fails")[2]
    explained = {name for row in re.findall(r"^- (`.*?`):", told, re.M) for name in re.findall(r"`([\w+]+)`", row)}
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
    never = told.partition("What all vehicles withstand")[2]
    assert set(TROUBLES) - failed - {"still_water"} <= {
        *re.findall(r"`([\w+]+)`", never),
        *(f"delay_{samples}" for samples in range(1, 7)),
    }


def test_the_command_writes_tables_and_picture(loops, tmp_path):
    some = ["--vehicle", VEHICLE, "--controller", "adaptive_pd", "--trouble", "still_water", "--trouble", "bias"]
    done = call("matrix", *some, "--jobs", 1, "--set", "passive_arm.seed=3", "--output", tmp_path)
    assert done.exit_code == 0, done.output
    assert "adaptive_pd  1 held, 1 offset, 0 oscillates, 0 lost" in done.output
    stem = f"matrix+{VEHICLE}+adaptive_pd+passive_arm.seed=3+still_water+bias"
    assert {path.name for path in tmp_path.iterdir()} == {f"{stem}.{end}" for end in ("csv", "md", "png", "svg")}
    assert "passive_arm.seed = 3" in (tmp_path / f"{stem}.md").read_text()


@pytest.mark.slow
def test_a_cell_can_be_run_and_looked_at_alone(archives, small, tmp_path):
    done = call("run", f"{VEHICLE}_pid", "--trouble", "delay_5", "--output", tmp_path)
    assert done.exit_code == 0, done.output
    with open(tmp_path / f"{VEHICLE}_pid+delay_5.csv", encoding="utf-8") as file:
        x = np.array([float(row["rov_plant.eta.x"]) for row in csv.DictReader(file)])
    found = small.scores[Cell(VEHICLE, "pid", "delay_5")]
    assert f"verdict: {found.verdict}" in done.output
    assert len(x) == round(STOP_TIME / 0.03) + 1
    assert abs(x[-2000:].mean()) <= found.mean + 1e-6


def test_systems_are_columns_of_their_own_and_gate_the_command(archives, tmp_path):
    some = ("--system", "station_keeping_pd", "--system", "station_keeping", "--trouble", "still_water")
    done = call("matrix", *some, "--output", tmp_path)
    assert done.exit_code == 0, done.output
    assert "station_keeping_pd, pd, still_water: offset" in done.output
    assert "station_keeping, adaptive_pd, still_water: held" in done.output
    assert call("matrix", *some, "--fail-on", "lost", "--output", tmp_path).exit_code == 0
    failed = call("matrix", *some, "--fail-on", "offset", "--output", tmp_path)
    assert failed.exit_code == 1
    assert failed.output.endswith("Error: station_keeping_pd, pd, still_water: offset\n")


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


def is_gone(group):
    """Tell whether a process group comes to an end, which is so when init has cleared up after the last of it."""
    for _ in range(100):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "sign", "after"),
    [(signal.SIGINT, "**/*.fmu", 6.0), (signal.SIGTERM, "**/*.fmu", 6.0), (signal.SIGINT, "*", 0.2)],
)
def test_an_order_to_end_keeps_the_scores_so_far_and_leaves_no_process(fmus, tmp_path, number, sign, after):
    """It comes some time after a sign in the temporary folder: of workers that begin to run, or of their start."""
    command = [sys.executable, "-m", "rov_cosim.cli.main", "matrix", "--jobs", "2", "--output", str(tmp_path)]
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    process = subprocess.Popen(
        command,
        env={**os.environ, "TMPDIR": str(temporary)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while not list(temporary.glob(sign)):
        assert process.poll() is None, process.communicate()
        time.sleep(0.05)
    time.sleep(after)
    if number == signal.SIGINT:
        os.killpg(process.pid, number)  # as a terminal does: to the parent and to its processes
    else:
        process.terminate()
    _, told = process.communicate(timeout=60)
    assert not list(temporary.iterdir())
    assert is_gone(process.pid)
    assert process.returncode == 1
    assert "Traceback" not in told
    if after < 1.0:  # no run has come to an end
        return
    assert "The results so far are in" in told
    rows = (Path(tmp_path) / "matrix-until-interrupted.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) > 1
    assert not any("Interrupted" in row for row in rows)
