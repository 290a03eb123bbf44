"""The gate: green where it should be, red with a line that says where, and nothing lost when something breaks."""

import csv
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from junitparser import Failure, JUnitXml, Skipped
from pythonfmu.builder import FmuBuilder
from test_campaign import written

from rov_cosim.components.interface import POSE
from rov_cosim.study.gate import declared, signs
from rov_cosim.study.settings import Settings
from rov_cosim.study.written import CHANGES, SETTINGS
from typed import call, ok

GATES = Path(__file__).parent.parent / "systems" / "gates"
GUIDE = (GATES / "README.md").read_text(encoding="utf-8")

LOADS = ("dB", "F_C.x", "F_C.y", "F_A.y", "F_A.z")
NO_LOADS = ", ".join(f'"rov_plant.{load}" = 0.0' for load in LOADS)
GATE = f"""\
troubles = ["still_water"]

[limits]
worst = 0.02

[systems.good]
system = "station_keeping"
troubles = ["still_water", "delay_5", "current"]
without = ["current"]

[systems.tight]
system = "station_keeping"
troubles = ["delay_5"]
limits = {{ worst = 0.001, settling = 1.0 }}

[systems.flipped]                 # their plant takes u for what pulls
system = "station_keeping"
swaps = {{ rov_plant = "PLANT" }}
map = "flipped.toml"

[systems.missing]
system = "station_keeping"
swaps = {{ rov_plant = "none.fmu" }}

[systems.at_rest]                 # begins at its set-point, and nothing acts
system = "station_keeping"
values = {{ {NO_LOADS}, "rov_plant.eta_0.y" = 0.0, "rov_plant.eta_0.psi" = 0.0 }}
"""
MORE = f"""\
troubles = ["still_water"]
timeout = 1.0

[systems.mirrored]
system = "station_keeping"
swaps = {{ passive_arm = "ARM" }}
map = "mirrored.toml"

[systems.one_sign]                # in their map, of one axis
system = "station_keeping"
swaps = {{ rov_plant = "their.fmu" }}
map = "one_sign.toml"

[systems.crashing]
system = "bluerov2"
swaps = {{ scenario = "crashing.fmu" }}
map = "scenario.toml"
values = {{ "scenario.fuse" = 0.3 }}

[systems.hanging]
system = "bluerov2"
swaps = {{ scenario = "hanging.fmu" }}
map = "scenario.toml"
values = {{ "scenario.fuse" = 0.3 }}

[systems.loadless]                # begins beside it
system = "station_keeping"
values = {{ {NO_LOADS} }}

[systems.no_scenario]
system = "station_keeping"
troubles = ["current"]

[systems.unmoved]                 # a controller that knows no r_A
system = "station_keeping_pd"
troubles = ["wrong_r_A"]
limits = {{ verdict = "offset", worst = 0.5 }}
"""
SCENARIO = '[scenario]\nwithout = ["set_point"]\n[scenario.constants]\nthrust_loss = 0.0\n'
FLIPPED = '[rov_plant.variables]\nu = { ours = "u", factor = -1 }\ndB = "dB"\nF_C = "F_C"\nF_A = "F_A"\n'
MIRRORED = '[passive_arm.variables]\neta_m = { ours = "eta_m", factor = -1 }\n'


@pytest.fixture(scope="module")
def shown(fmus, tmp_path_factory):
    """Return what the command printed of this gate, and the folder of what it wrote."""
    folder = tmp_path_factory.mktemp("gate")
    written(folder, FLIPPED, "flipped.toml")
    text = GATE.replace("PLANT", str(fmus["rov_plant"]))
    done = call("gate", written(folder, text, "mixed.toml"), "--output", folder / "out")
    assert done.exit_code == 1, done.output
    assert done.output.splitlines()[-1] == "Error: gate mixed: red, 4 of 6 cells failed"
    return done.output, folder / "out"


@pytest.mark.parametrize(
    ("system", "reason"),
    [
        ("tight, delay_5", r"worst [\d.]+ mm; at most 1 mm"),
        ("tight, delay_5", r"settling [\d.]+ s; at most 1 s"),
        ("flipped, still_water", r"verdict lost at [\d.]+ s: out of the sensor's reach; at worst held"),
        (
            "flipped",
            "rov_plant goes the other way when it is pushed along x, y, z, psi: a sign is wrong between contro",
        ),
        ("missing, still_water", r".*none.fmu is not a readable FMU: it does not exist"),
        ("at_rest, still_water", "vacuous: it passes without the controller too"),
    ],
)
def test_what_is_wrong_is_a_red_line_that_says_where(shown, system, reason):
    assert re.search(rf"^red    {system}: {reason}", shown[0], re.M), shown[0]


@pytest.mark.slow
def test_whatever_breaks_or_tests_nothing_is_a_red_line(fmus, tmp_path):
    source = (Path(__file__).parent / "fmus" / "crashing.py").read_text(encoding="utf-8")
    hanging = source.replace("ctypes.string_at(0)", "time.sleep(1e6)").replace("import ctypes", "import time")
    for name, text in (("crashing", source), ("hanging", hanging.replace("class Crashing", "class Hanging"))):
        FmuBuilder.build_FMU(written(tmp_path, text, f"{name}.py"), tmp_path).rename(tmp_path / f"{name}.fmu")
    FmuBuilder.build_FMU(Path(__file__).parent / "fmus" / "foreign_rov.py", tmp_path).rename(tmp_path / "their.fmu")
    text, right = (GATES.parent / "README.md").read_text(encoding="utf-8"), 'ours = "controller.tau.Y", z_down = true'
    (map_,) = re.findall(r"```toml\n(\[rov_plant\]\n.*?)```", text, re.S)
    assert right in map_
    written(tmp_path, map_.replace(right, 'ours = "controller.tau.Y"'), "one_sign.toml")
    written(tmp_path, SCENARIO, "scenario.toml")
    written(tmp_path, MIRRORED, "mirrored.toml")
    done = call("gate", written(tmp_path, MORE.replace("ARM", str(fmus["passive_arm"]))), "--output", tmp_path)
    assert done.output.splitlines()[-1] == "Error: gate some: red, 7 of 7 cells failed"
    for system, reason in (
        ("mirrored", "controller is told the other way when the vehicle moves along x, y, z, psi: a sign or a connec"),
        ("one_sign", "rov_plant goes the other way when it is pushed along y: a sign is wrong between controller.tau"),
        ("crashing, still_water", r"verdict lost at 0.3 s: scenario: At 0.3 s: the process died of SIGSEGV in fmi2DoS"),
        ("no_scenario, current", "does not apply: There is no scenario.current_mean.x, which the trouble is about"),
        ("unmoved, wrong_r_A", "vacuous: the trouble changes nothing, to the last digit"),
        (
            "hanging, still_water",
            r"verdict lost at 0.3 s: scenario: At 0.3 s: fmi2DoStep does not return within 1 s; a",
        ),
        (
            "loadless, still_water",
            "vacuous: no load acts, in no trouble: without the controller the vehicle stays wher",
        ),
    ):
        assert re.search(rf"^red    {system}: {reason}", done.output, re.M), done.output
    suites = {suite.name: suite for suite in JUnitXml.fromfile(str(tmp_path / "gate+some.xml"))}
    assert {one.name: one.value for one in suites["crashing"].properties()}["scenario"] == "Crashing"


def test_a_plant_that_is_right_is_green_beside_them(shown, fmus):
    assert re.search(r"^green  good, still_water: held, worst [\d.]+ mm of 20 mm$", shown[0], re.M)
    assert not re.search(r"^red    good", shown[0], re.M)


def test_the_xml_has_a_case_for_each_cell_and_the_fmus_that_ran(shown):
    suites = {suite.name: suite for suite in JUnitXml.fromfile(str(shown[1] / "gate+mixed.xml"))}
    assert list(suites) == re.findall(r"^\[systems\.(\w+)\]", GATE, re.M)
    kinds = {case.name: [type(result) for result in case.result] for case in suites["good"]}
    assert kinds == {"still_water": [], "delay_5": [], "current": [Skipped]}
    assert [case.name for case in suites["flipped"]] == ["still_water", "signs"]
    assert all(isinstance(case.result[0], Failure) for case in suites["flipped"])
    assert {one.name: one.value for one in suites["good"].properties()}["controller"] == "adaptive_pd"
    assert sum(suite.failures for suite in suites.values()) == 4 + 1  # and the signs


def test_page_and_table_have_all_cells(shown):
    page = (shown[1] / "gate+mixed.md").read_text(encoding="utf-8")
    assert page.startswith("## gate mixed: red, 4 of 6 cells failed\n\n- tight, delay_5: ")
    rows = re.findall(r"^\| (\w+) \| (\w+) \| (green|\*\*red\*\*|left out) \|", page, re.M)
    assert len(rows) == 7
    assert ("good", "current", "left out") in rows
    assert "| good | passive_arm, controller: adaptive_pd, rov_plant |" in page
    with (shown[1] / "gate+mixed.csv").open(encoding="utf-8") as file:
        scored = [(row["system"], row["trouble"]) for row in csv.DictReader(file)]
    assert scored == [tuple(row[:2]) for row in rows if row[0] != "missing" and row[2] != "left out"]
    assert (shown[1] / "gate+mixed.png").stat().st_size > 10_000


def test_a_cell_is_the_run_by_itself(shown, archives):
    with (shown[1] / "gate+mixed.csv").open(encoding="utf-8") as file:
        row = next(row for row in csv.DictReader(file) if row["system"] == "good" and row["trouble"] == "delay_5")
    told = ok("run", "station_keeping", "--trouble", "delay_5", "--output", shown[1])
    alone = max(float(cell) for cell in re.findall(r"^[xyz] .* ([\d.]+) mm$", told, re.M))
    assert 1e3 * float(row["worst"]) == pytest.approx(alone, abs=0.006)


def test_most_troubles_left_out_is_a_warning(fmus, tmp_path):
    text = 'troubles = ["still_water", "bias", "noise_2"]\n[systems.station_keeping]\nwithout = ["bias", "noise_2"]\n'
    told = ok("gate", written(tmp_path, text), "--output", tmp_path)
    assert "2 of 3 troubles are left out: what is left says little." in told
    assert "warning: station_keeping: 2 of 3" in (tmp_path / "gate+some.md").read_text(encoding="utf-8")


def answer(probe, way, told, push, axis=0):
    """Return an answer to a push: ways of vehicle and measurement, and the push of the controller, along an axis."""
    eta, measured = np.zeros((2, 6, 3))
    eta[axis], measured[axis] = way, told
    commands = push * np.linalg.pinv(probe._allocation)[:, [axis]] * np.ones(3)
    return signs._Answer(0.0, eta, measured, commands)


@pytest.mark.parametrize(
    ("moves", "reason"),
    [
        ((0.1, 0.1, -5.0), ""),
        ((0.0, 0.1, -5.0), "rov_plant does not move when it is pushed"),
        ((-0.1, -0.1, 5.0), "rov_plant goes the other way"),
        ((0.1, 0.0, -5.0), "controller is told no way when the vehicle moves"),
        ((0.1, -0.1, -5.0), "controller is told the other way when the vehicle moves"),
        ((0.1, 0.1, 5.0), "controller pushes on when the vehicle moves"),
    ],
)
def test_the_first_in_the_loop_that_answers_wrongly_is_named(loop, monkeypatch, moves, reason):
    probe = signs._Probe(loop, Settings())
    monkeypatch.setattr(probe, "_answer", lambda wrench: answer(probe, *(np.sign(wrench[0]) * np.array(moves))))
    assert probe.fault("x").startswith(reason)
    assert bool(probe.fault("x")) == bool(reason)


YAWS_THE_WRONG_WAY = {"x": (0.1, 0.1, 5.0), "psi": (-0.1, -0.1, 5.0)}
"""How the loop answers a push where psi' = -r in the plant: what turns away makes the controller push on along x."""


@pytest.mark.parametrize(
    ("moves", "is_plant_wrong", "blamed"),
    [
        (YAWS_THE_WRONG_WAY, False, ["rov_plant"]),
        (YAWS_THE_WRONG_WAY, True, ["rov_plant"]),
        ({"x": (0.1, 0.1, 5.0)}, False, ["controller"]),
        ({"x": (0.1, 0.1, 5.0)}, True, []),  # by its terms
        ({}, False, []),
    ],
)
def test_a_controller_is_not_blamed_for_a_plant_that_is_wrong(loop, monkeypatch, moves, is_plant_wrong, blamed):
    def answered(probe, wrench):
        i = int(np.flatnonzero(wrench)[0])
        return answer(probe, *(np.sign(wrench[i]) * np.array(moves.get(POSE[i], (0.1, 0.1, -5.0)))), axis=i)

    monkeypatch.setattr(signs._Probe, "_answer", answered)
    told = signs.faults(loop, Settings()).told(is_plant_wrong)
    assert [sentence.split()[0] for sentence in told] == blamed


def test_the_files_of_the_guide_are_gates(tmp_path):
    (text,) = re.findall(r"```toml\n(.*?)```", GUIDE, re.S)
    written(tmp_path, SCENARIO, "map.toml")
    gate = declared.read(written(tmp_path, text))
    assert {column.name: len(column.limits) for column in gate.columns} == {"station_keeping": 2, "theirs": 3}
    listed = re.findall(r"^\| (`.*?`) \|", GUIDE.partition("| key |")[2], re.M)
    keys = {key for row in listed for key in re.findall(r"`(\w+)`", row)}
    assert keys >= {*SETTINGS, *CHANGES, "export", "timeout", "troubles", "system", "without", "terms"}


def steps(name):
    """Return the steps of a workflow's job that run a command, by their name."""
    workflow = yaml.safe_load((GATES / name).read_text(encoding="utf-8"))
    assert workflow[True] == {"pull_request": None}  # YAML takes `on` for true
    assert workflow["permissions"] == {"contents": "read"}
    (job,) = workflow["jobs"].values()
    assert job["runs-on"] == "ubuntu-latest"
    assert all(("run" in step) != ("uses" in step) for step in job["steps"])
    return {step.get("name", step["run"]): step["run"] for step in job["steps"] if "run" in step}


@pytest.mark.parametrize(
    ("team", "element", "fmu"), [("plant", "rov_plant", "plant"), ("controller", "controller", "controller")]
)
def test_a_teams_workflow_gates_its_fmu(fmus, tmp_path, monkeypatch, team, element, fmu):
    commands = steps(f"{team}_team.yml")
    assert commands["Build our " + team] == f"make {fmu}.fmu"
    shutil.copy(fmus["adaptive_pd" if element == "controller" else element], tmp_path / f"{fmu}.fmu")
    written(
        tmp_path,
        f'''\
troubles = ["still_water"]
[systems.ours]
system = "station_keeping"
swaps = {{ {element} = "{fmu}.fmu" }}
''',
        "gate.toml",
    )
    monkeypatch.chdir(tmp_path)
    name, *arguments = shlex.split(commands["Gate"])
    assert name == "rov-cosim"
    assert "gate gate: green, 1 of 1 cells passed" in ok(*arguments)
    subprocess.run(commands["Summary"], shell=True, check=True, env={**os.environ, "GITHUB_STEP_SUMMARY": "summary"})
    assert Path("summary").read_text(encoding="utf-8").startswith("## gate gate: green")


@pytest.mark.slow
def test_the_quick_gate_is_green(fmus, tmp_path):
    assert ok("gate", "quick", "--output", tmp_path).splitlines()[-1] == "gate quick: green, 14 of 14 cells passed"


def test_neither_dask_nor_matplotlib_is_loaded_before_they_are_needed():
    script = "import sys, rov_cosim.cli.commands.gate; print(*{name.split('.')[0] for name in sys.modules})"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, encoding="utf-8", check=True)
    assert not {"distributed", "matplotlib", "scipy"} & set(done.stdout.split())
