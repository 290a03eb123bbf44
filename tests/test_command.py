"""The command as a user types it: what it prints, what it writes, how it fails."""

import csv
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import click
import pytest

from rov_cosim.benchmark import report as benchmark_report
from rov_cosim.cli import outputs
from rov_cosim.exporters.build import components
from rov_cosim.study import runs
from rov_cosim.systems.catalogue import SYSTEMS
from typed import call, ok, one_line

ROOT = Path(__file__).parent.parent


def test_list_names_every_system():
    lines = ok("list").splitlines()
    assert [line.split()[0] for line in lines] == list(SYSTEMS)


def test_build_writes_once_and_then_touches_nothing(archives):
    assert all(archives[name] for name in ("station_keeping", "bluerov2_heavy"))
    lines = ok("build", "station_keeping", "bluerov2_heavy").splitlines()
    assert len(lines) == len(components()) + 2 * 2
    assert all(line.startswith("current") for line in lines)
    assert "bluerov2_heavy.ssp is an archive already" in one_line(call("build", "systems/bluerov2_heavy.ssp"))


def test_run_writes_csv_and_plot_and_prints_the_table(archives, tmp_path):
    output = ok("run", "paper_simulation_pd", "--coupling", "gauss-seidel", "--stop-time", "30", "--output", tmp_path)
    table = {line.split()[0]: line for line in output.splitlines() if line[:3].strip() in ("x", "y", "z", "psi")}
    assert "never" in table["x"]
    assert "120.00 mm" in table["x"]
    assert re.search(r"41\.6\d mm", table["z"])
    assert re.search(r"^Z +0\.000 +5\.000 +N$", output, re.M)  # PD estimates nothing of the 5 N
    with open(tmp_path / "paper_simulation_pd+gauss-seidel+30s.csv", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert rows[0][0] == "time"
    assert "rov_plant.eta.x" in rows[0]
    assert (float(rows[1][0]), float(rows[-1][0]), len(rows)) == (0.0, 30.0, 1002)
    assert (tmp_path / "paper_simulation_pd+gauss-seidel+30s.png").read_bytes().startswith(b"\x89PNG")


def test_run_takes_start_values_and_any_archive(archives, tmp_path):
    for what in ("station_keeping", archives["station_keeping"]):
        ok("run", what, "--stop-time", "0.3", "--set", "rov_plant.eta_0.x=0.25", "--output", tmp_path)
        with open(tmp_path / "station_keeping+rov_plant.eta_0.x=0.25+0.3s.csv", encoding="utf-8") as file:
            first = next(iter(csv.DictReader(file)))
        assert float(first["rov_plant.eta.x"]) == 0.25


def test_a_name_that_the_encoding_lacks_is_printed_all_the_same(archives, tmp_path):
    command = [Path(sys.executable).with_name("rov-cosim"), "run", "station_keeping", "--stop-time", "0.3", "--output"]
    environment = {**os.environ, "PYTHONIOENCODING": "latin-1"}
    printed = subprocess.run([*command, tmp_path / "≥"], env=environment, stdout=subprocess.PIPE, check=True).stdout
    assert b"/\\u2265/station_keeping+0.3s.csv\n" in printed


def test_compare_draws_several_systems_into_one_figure(archives, tmp_path):
    figure = tmp_path / "both.png"
    ok("compare", "paper_simulation", "paper_simulation_pd", "--stop-time", "0.3", "--output", figure)
    assert figure.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_benchmark_prints_every_table(archives, python_archives, monkeypatch):
    monkeypatch.setattr(benchmark_report, "TURNS", 3)
    monkeypatch.setattr(benchmark_report, "RUNS", 16)
    output = ok("benchmark")
    for heading in ("a communication step of 30 ms", "station_keeping, Jacobi", "command", "16 runs of 60 s", "ratio"):
        assert re.search(heading, output)
    ratios = {line.split("  ")[0]: float(line.split()[-1]) for line in output.splitlines() if " loop : " in line}
    assert len(ratios) == 5


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["run", "station_keping"], "there is no system station_keping. Did you mean station_keeping"),
        (["run", "none.ssp"], "none.ssp: There is no such archive"),
        (
            ["run", str(ROOT / "README.md")],
            "README.md is neither a system's archive (.ssp) nor a vehicle's parameters (.ssv).",
        ),
        (
            ["run", "station_keeping", "--set", "controller.K_P"],
            "expected ELEMENT.VARIABLE=VALUE, got 'controller.K_P'",
        ),
        (["run", "station_keeping", "--set", "controller.K_P.x=a"], "controller.K_P.x: expected a number, got 'a'"),
        (["run", "station_keeping", "--set", "controller.Kp=1"], "There is no variable controller.Kp"),
        (["run", "station_keeping", "--stop-time", "-1"], "from 0.0 s to -1.0 s; expected finite times"),
        (["run", "station_keeping", "--stop-time", "nan"], "to nan s; expected finite times, the stop after the start"),
        (
            ["run", "station_keeping", "--set", "rov_plant.mass=0"],
            "mass is 0; expected a finite number of at least 0.001",
        ),
        (["run", "station_keeping", "--output", "/proc/none"], "/proc/none"),
        (["build", "--export", "pythonfmu", "--all-platforms"], "--all-platforms is for the native export"),
    ],
)
def test_bad_input_ends_with_a_reason_and_a_failing_status(archives, arguments, reason):
    done = call(*arguments)
    assert done.exit_code != 0
    assert reason in done.output
    assert "Traceback" not in done.output
    assert done.exception is None or isinstance(done.exception, SystemExit)


def test_a_run_that_fails_midway_keeps_its_results(archives, tmp_path):
    # Undamped and pushed hard at the nose: the free vehicle pitches over.
    values = {"lock_roll_pitch": "false", "r_B.z": "0", "F_A.z": "60", "eta_0.psi": "0"}
    sets = [part for name, value in values.items() for part in ("--set", f"rov_plant.{name}={value}")]
    done = call("run", "station_keeping", *sets, "--output", tmp_path)
    assert done.exit_code == 1
    assert re.search(r"rov_plant: At [\d.]+ s: The step from", done.output)
    assert "The results so far are in" in done.output
    (kept,) = tmp_path.glob("*.csv")
    assert len(kept.read_text().splitlines()) > 10
    assert re.search(r"^verdict: lost at [\d.]+ s: rov_plant: At [\d.]+ s: The step from", done.output, re.M)


def test_a_light_install_runs_the_pythonfmu_export_and_says_what_the_native_one_needs(tmp_path):
    script = """
import sys
import time
from pathlib import Path
from rov_cosim.exporters import build
sys.modules["casadi"] = None
build.project_root = Path  # nothing is built yet in the current folder
from rov_cosim.cli.main import main
main()
"""
    command = [sys.executable, "-c", script, "run", "station_keeping", "--stop-time", "0.3", "--output", tmp_path]
    cure = "Error: The native export needs casadi, which is not installed: pip install casadi ziglang"
    for line, said in (
        (command, f"{cure}, or take --export pythonfmu\n"),
        ([*command[:3], "tune", "bluerov2"], f"{cure}\n"),
        ([*command[:3], "build", "--fmi", "3"], f"{cure}\n"),
    ):
        done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (1, said)
    subprocess.run([*command, "--export", "pythonfmu"], cwd=tmp_path, check=True)
    assert (tmp_path / "station_keeping+0.3s+pythonfmu.csv").is_file()


def test_ctrl_c_keeps_the_results(archives, tmp_path, monkeypatch):
    def interrupted(steps):
        for n in steps:
            if n == 20:
                os.kill(os.getpid(), signal.SIGINT)
            yield n

    monkeypatch.setattr(runs, "_progress", interrupted)
    done = call("run", "station_keeping", "--output", tmp_path)
    assert done.exit_code == 1
    told = re.search(r"Interrupted at ([\d.]+) s. The results so far are in", " ".join(done.output.split()))
    rows = (tmp_path / "station_keeping.csv").read_text(encoding="utf-8").splitlines()
    assert 0.6 <= float(told[1]) < 84.0
    assert len(rows) == 1 + 1 + round(float(told[1]) / 0.03)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in SYSTEMS if (ROOT / "systems" / f"{name}.py").is_file()])
def test_every_script_runs(name, tmp_path):
    done = subprocess.run(
        [sys.executable, ROOT / "systems" / f"{name}.py"], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "disturbance" in done.stdout


def test_an_order_to_terminate_keeps_the_results_and_leaves_nothing_behind(archives, tmp_path):
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    command = [sys.executable, "-m", "rov_cosim.cli.main", "run", "station_keeping", "--stop-time", "20000"]
    process = subprocess.Popen(
        [*command, "--name", "long", "--output", tmp_path],
        env={**os.environ, "TMPDIR": str(temporary)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
    )
    while not list(temporary.glob("*/*/binaries")):
        time.sleep(0.05)
    time.sleep(0.5)
    process.terminate()
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "Interrupted at" in errors
    assert len((tmp_path / "long.csv").read_text(encoding="utf-8").splitlines()) > 10
    assert not list(temporary.iterdir())


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("rov-cosim compa", ["compare"]),
        ("rov-cosim run paper_simulation", ["paper_simulation", "paper_simulation_pd"]),
        ("rov-cosim run bluerov2 --trouble delay_1", ["delay_1", "delay_10"]),
    ],
)
def test_the_shell_completes_commands_systems_and_troubles(typed, offered):
    words = typed.split()
    environment = {"_MAIN_COMPLETE": "bash_complete", "COMP_WORDS": typed, "COMP_CWORD": str(len(words) - 1)}
    done = call(env=environment, prog_name="main")
    assert [line.partition(",")[2] for line in done.output.splitlines()] == offered


@pytest.mark.parametrize(
    "arguments",
    [
        ("tune", "bluerov2", "-o", "FILE/g.ssv"),
        ("tune", "bluerov2", "--alone", "FILE/g.ssv"),
        ("tune", "bluerov2", "--plot", "FILE/g.svg"),
        ("run", "bluerov2", "--output", "FILE/x"),
        ("run", "bluerov2", "--archive", "FILE/g.ssp"),
        ("certify", "bluerov2", "--table", "FILE/g.md"),
        ("gate", "quick", "--output", "FILE/x"),
    ],
)
def test_a_place_that_cannot_be_written_is_told_before_the_work(tmp_path, monkeypatch, arguments):
    (tmp_path / "FILE").write_text("", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    said = one_line(call(*arguments))
    assert re.search(rf"{arguments[-1]} cannot be written \(.*\): name one where you may write\.$", said)


def test_missing_folders_are_made_and_completion_makes_none(tmp_path):
    assert (
        outputs.Place(".ssv").convert(str(tmp_path / "a" / "b" / "g.ssv"), None, None) == tmp_path / "a" / "b" / "g.ssv"
    )
    assert [*(tmp_path / "a").rglob("*")] == [tmp_path / "a" / "b"]
    outputs.FOLDER.convert(str(tmp_path / "c"), None, click.Context(click.Command("x"), resilient_parsing=True))
    assert not (tmp_path / "c").exists()
