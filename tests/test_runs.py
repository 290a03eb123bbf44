"""From a system to files: one way for all that differs, names that keep runs apart, verdicts, archives of what ran."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fmpy.util import write_csv as fmpy_write_csv
from pythonfmu.builder import FmuBuilder

from rov_cosim.cli.commands import compare
from rov_cosim.importers.measuring import measure
from rov_cosim.importers.tools import IMPORTERS
from rov_cosim.ssp import reader
from rov_cosim.ssp.declaration import System, wire
from rov_cosim.ssp.swap_map import SwapMap
from rov_cosim.study.changes import Changes
from rov_cosim.study.csv_table import write_csv
from rov_cosim.study.nominal import DoesNotApplyError
from rov_cosim.study.runs import file_name, opened, simulated
from rov_cosim.study.screen import counted
from rov_cosim.study.settings import Settings
from rov_cosim.study.troubles import TROUBLES
from rov_cosim.systems.catalogue import SYSTEMS
from rov_cosim.whole.writer import write
from typed import call, ok
from typical import typical

PAPER = SYSTEMS["station_keeping"]


def run(system, changes=None, **options):
    with opened(system, changes) as wiring:
        return simulated(wiring, Settings(**options))


def test_a_csv_has_the_bytes_of_fmpys(fmus, tmp_path):
    results = run(PAPER, stop_time=0.6).results
    write_csv(tmp_path / "ours.csv", results)
    fmpy_write_csv(tmp_path / "theirs.csv", results)
    assert (tmp_path / "ours.csv").read_bytes() == (tmp_path / "theirs.csv").read_bytes()


def test_a_system_and_its_archive_run_alike(archives):
    declared, read = (run(what, stop_time=3.0) for what in (PAPER, archives["station_keeping"]))
    assert declared.name == read.name == "station_keeping+3s"
    assert np.array_equal(declared.results, read.results)


def test_whatever_differs_has_a_name_of_its_own(fmus, archives, plain_gain, tmp_path):
    copy = tmp_path / "station_keeping.ssp"
    with opened(PAPER, Changes(values={"controller.K_P.x": 90.0})) as wiring:
        write(wiring, copy)
    their = tmp_path / "rov_plant.fmu"
    their.write_bytes(fmus["rov_plant"].read_bytes())
    swap = {"rov_plant": their}
    ways = [
        (PAPER, Changes(), {}),
        (copy, Changes(), {}),
        (PAPER, Changes(), {"coupling": "gauss-seidel"}),
        (PAPER, Changes(), {"stop_time": 0.6}),
        (PAPER, Changes(values={"controller.K_P.x": "90"}), {}),
        (PAPER, Changes(values={"controller.K_P.x": "91"}), {}),
        (PAPER, Changes(values={"controller.K_P.y": "90"}), {}),
        (PAPER, Changes(troubles=("delay_5",)), {}),
        (PAPER, Changes(troubles=("delay_5", "bias")), {}),
        (PAPER, Changes(swap), {}),
        (PAPER, Changes(swap, {"rov_plant": SwapMap()}), {}),
    ]
    names = []
    for system, changes, options in ways:
        names.append(run(system, changes, **{"stop_time": 0.3, **options}).name)
    assert len(set(names)) == len(ways)
    assert names[7] == "station_keeping+delay_5+0.3s"


def test_a_long_name_is_shortened_and_stays_its_own():
    one, other = (file_name("x" * 300 + end) for end in "ab")
    assert one != other
    assert max(len(one), len(other)) <= 120
    assert file_name("a/b\\c:d\nä").startswith("a_b_c_d__+")
    assert file_name("ü") != file_name("ö")
    assert file_name("bluerov2+controller.K_P.x=40") == "bluerov2+controller.K_P.x=40"


def test_the_name_can_be_chosen(archives, tmp_path):
    ok("run", "station_keeping", "--stop-time", "0.3", "--name", "mine", "--output", tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"mine.csv", "mine.png"}


@pytest.mark.parametrize("tool", typical(["fmpy_command", "ecos", "libcosim"], "ecos"))
def test_what_was_run_goes_to_another_tool_as_an_archive(fmus, tool, tmp_path):
    if IMPORTERS[tool].version() is None:
        pytest.skip(f"{IMPORTERS[tool].title} is not installed; the extra `importers` has it")
    their = tmp_path / "theirs.fmu"
    their.write_bytes(fmus["passive_arm"].read_bytes())
    changed = tmp_path / "changed.ssp"
    options = ["--trouble", "delay_5", "--trouble", "current", "--swap", f"passive_arm={their}"]
    options += ["--set", "controller.K_P.x=20", "--set", "rov_plant.thruster[1].enabled=false", "--stop-time", "9"]
    ok("run", "bluerov2_heavy", *options, "--archive", changed, "--name", "ran", "--output", tmp_path)
    ran = np.genfromtxt(tmp_path / "ran.csv", delimiter=",", names=True, deletechars="", dtype=None, encoding="utf-8")
    again = run(changed, stop_time=9.0)
    plain = run(SYSTEMS["bluerov2_heavy"], stop_time=9.0)
    assert all(np.array_equal(ran[name], again.results[name]) for name in ran.dtype.names)
    assert not np.array_equal(ran["rov_plant.eta.x"], plain.results["rov_plant.eta.x"])
    assert measure(tool, "loop", changed, 9.0) <= IMPORTERS[tool].tolerance


@pytest.mark.parametrize("name", typical(["station_keeping", "bluerov2"]))
def test_each_trouble_of_a_system_becomes_an_archive(fmus, name, tmp_path):
    written = set()
    for trouble in TROUBLES:
        with opened(SYSTEMS[name]) as plain:
            try:
                changed = Changes(troubles=(trouble,)).applied(plain)
            except DoesNotApplyError:
                continue
        write(changed, tmp_path / f"{trouble}.ssp", plain=True)
        written.add(trouble)
        with reader.opened(tmp_path / f"{trouble}.ssp") as read:
            assert [e.start_values for e in read.elements] == [dict(e.start_values) for e in changed.elements]
    assert {"delay_5", "thruster_lost", "wrong_mass"} <= written
    assert ("current" in written) == (name == "bluerov2")


@pytest.mark.parametrize(
    ("values", "limit", "status", "verdict"),
    [
        ({}, "lost", 0, "verdict: held"),
        ({"controller.adaptation": "false"}, "lost", 0, "verdict: offset"),
        ({"controller.adaptation": "false"}, "offset", 1, "verdict: offset"),
        ({"rov_plant.F_A.z": "900"}, "lost", 1, "out of the sensor's reach"),
    ],
)
def test_a_run_ends_in_a_verdict_that_can_set_the_status(archives, tmp_path, values, limit, status, verdict):
    sets = [part for name, value in values.items() for part in ("--set", f"{name}={value}")]
    done = call("run", "station_keeping", *sets, "--fail-on", limit, "--output", tmp_path)
    assert done.exit_code == status, done.output
    assert verdict in done.output
    assert len(list(tmp_path.iterdir())) == 2  # nothing is lost


def test_a_gate_without_a_vehicle_does_not_pass(plain_gain, tmp_path):
    write(wire(System("alone", "", {"a": "g"}, (), 0.3), {"g": plain_gain}), tmp_path / "alone.ssp")
    done = call("run", tmp_path / "alone.ssp", "--fail-on", "lost", "--output", tmp_path)
    assert done.exit_code == 1
    assert "has no vehicle with a pose eta: there is no verdict" in done.output


def test_repeated_warnings_are_counted(capsys):
    with counted() as warn:
        for n in range(100):
            warn(f"arm: At {0.03 * n} s: pressure high")
        warn("plant: another")
    assert capsys.readouterr().err.splitlines() == [
        "warning: arm: At 0.0 s: pressure high",
        "warning: plant: another",
        "warning: 99 more of the kind: arm: At # s: pressure high",
    ]


def test_compare_varies_values_troubles_and_systems(archives, tmp_path):
    picture = tmp_path / "all.png"
    vary = ["--vary", "controller.K_P.x=40,80", "--vary", "trouble=still_water,delay_5"]
    output = ok("compare", "hoang_kreuzer", *vary, "--stop-time", "3", "--output", picture)
    labels = [f"controller.K_P.x={k}, {trouble}" for k in (40, 80) for trouble in ("still_water", "delay_5")]
    assert [line[: len(labels[0])].strip() for line in output.splitlines()[1:5]] == labels
    with (tmp_path / "all.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["run"] for row in rows] == labels
    assert len({row["rms"] for row in rows}) == 4
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["station_keeping", "station_keeping"], "station_keeping is the same run as station_keeping"),
        (["station_keeping"], "One run is nothing to compare"),
        (
            ["station_keeping", "--vary", "controller.K_P.x=80,8e1"],
            "controller.K_P.x=8e1 is the same run as controller.K_P.x=80",
        ),
        (
            ["station_keeping", "--vary", "controller.K_P.x=1,2", "--set", "controller.K_P.x=3"],
            "controller.K_P.x is set and varied",
        ),
        (["bluerov2", "--trouble", "delay_3", "--vary", "trouble=delay_4,bias"], "delay_3 and delay_4 both set"),
        (["station_keeping", "ARCHIVE"], "is the same run as station_keeping"),
        (["station_keeping", "--vary", "controller.K_P.x=40,b"], "controller.K_P.x: expected a number, got 'b'"),
        (["station_keeping", "--vary", "trouble=dely_5,bias"], "there is no trouble dely_5. Did you mean delay_5"),
        (["station_keeping", "--vary", "controller.K_P.x"], "expected ELEMENT.VARIABLE=VALUE,VALUE,..."),
    ],
)
def test_a_comparison_that_says_nothing_is_refused(archives, tmp_path, arguments, reason):
    arguments = [archives["station_keeping"] if argument == "ARCHIVE" else argument for argument in arguments]
    done = call("compare", *arguments, "--stop-time", "0.3", "--output", tmp_path / "c.png")
    assert done.exit_code != 0
    assert reason in done.output
    assert isinstance(done.exception, SystemExit)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--set", "adaptive_pd.K_P.x=1"], "adaptive_pd is the FMU of controller; write controller.K_P.x."),
        (
            ["--set", "controller.K_P.x=1", "--set", "controller.K_P.x=2"],
            "controller.K_P.x stands twice, as 1 and as 2",
        ),
        (["--set", "controller.K_P.x=1_000"], "controller.K_P.x: expected a number, got '1_000'"),
        (["--set", "controller.K_P.x=٣"], "controller.K_P.x: expected a number, got '٣'"),
        (["--trouble", "current"], "The system hoang_kreuzer has a scenario"),
        (["--map", __file__], "--map tells how the FMUs of --swap take their places"),
        (["--swap", f"rov_plant={Path(__file__).parent}"], "is a folder; expected an FMU"),
        (["--swap", f"rov_plant={'x' * 300}.fmu"], "File name too long"),
        (["--archive", "no.zip"], "expected a name that ends in .ssp"),
    ],
)
def test_bad_input_ends_with_one_line(archives, tmp_path, arguments, reason):
    done = call("run", "station_keeping", *arguments, "--stop-time", "0.3", "--output", tmp_path)
    assert done.exit_code != 0
    assert reason in done.output
    assert isinstance(done.exception, SystemExit)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (
            ["--trouble", "delay_5", "--trouble", "delay_6"],
            "The troubles delay_5 and delay_6 both set passive_arm.delay",
        ),
        (["--set", "K_P.x=1"], "There is no variable K_P.x. Did you mean controller.K_P.x?"),
        (
            ["--set", "controller.K_P=1"],
            "controller.K_P is a group: set controller.K_P.x ... controller.K_P.psi, one by one.",
        ),
        (["--set", "scenario.eta_d.x=1"], "scenario.eta_d.x is of causality output"),
        (["--set", "rov_plant.current.x=1"], "its value comes from scenario.current.x; set a parameter of scenario."),
    ],
)
def test_what_cannot_be_changed_is_told_with_the_cure(archives, tmp_path, arguments, reason):
    done = call("run", "bluerov2", *arguments, "--stop-time", "0.3", "--output", tmp_path)
    assert done.exit_code == 1
    assert reason in done.output


def test_a_trouble_that_takes_the_place_of_a_set_value_is_told(archives, tmp_path):
    changed = ("--set", "passive_arm.delay=1", "--trouble", "delay_5")
    output = ok("run", "bluerov2", *changed, "--stop-time", "0.3", "--output", tmp_path)
    assert "warning: delay_5 makes passive_arm.delay 5; it was set to 1." in output


def test_the_files_of_a_run_lie_where_they_should_though_an_fmu_changes_the_folder(archives, tmp_path, monkeypatch):
    source = Path(__file__).parent / "fmus" / "plain_gain.py"
    moving = tmp_path / "moving_gain.py"
    text = source.read_text(encoding="utf-8").replace("class PlainGain", "class MovingGain")
    lines = "        super().__init__(**kwargs)\n"
    moving.write_text("import os\n" + text.replace(lines, f"{lines}        os.chdir('/')\n"), encoding="utf-8")
    fmu = FmuBuilder.build_FMU(moving, tmp_path)
    write(wire(System("moving", "", {"a": "g"}, (), 0.3), {"g": fmu}), tmp_path / "moving.ssp", plain=True)
    monkeypatch.chdir(tmp_path)
    ok("run", "moving.ssp", "--output", "out")
    assert [path.suffix for path in (tmp_path / "out").iterdir()] == [".csv"]
    assert Path.cwd() == tmp_path


def test_the_picture_goes_where_it_is_wanted(archives, tmp_path):
    ok("run", "station_keeping", "--stop-time", "0.3", "--output", tmp_path, "--picture", tmp_path / "p" / "it.svg")
    assert (tmp_path / "p" / "it.svg").read_text(encoding="utf-8").startswith("<?xml")
    assert not list(tmp_path.glob("*.png"))


def test_an_archive_ends_when_the_run_did_and_tells_what_it_cannot_hold(archives, tmp_path):
    options = ("--stop-time", "0.6", "--coupling", "gauss-seidel", "--archive", tmp_path / "a.ssp")
    output = ok("run", "station_keeping", *options, "--output", tmp_path)
    assert "cannot say that its coupling is gauss-seidel" in output
    with reader.opened(tmp_path / "a.ssp") as read:
        assert read.stop_time == 0.6


def test_compare_keeps_what_ran_and_ends_as_its_runs_did(archives, tmp_path):
    vary = ("--vary", "rov_plant.mass=80,-1", "--stop-time", "0.3", "--output", tmp_path / "c.png")
    done = call("compare", "station_keeping", *vary)
    assert done.exit_code == 1
    assert "mass is -1; expected" in done.output
    assert [line.split()[0] for line in done.output.splitlines()[1:3]] == ["rov_plant.mass=80", "rov_plant.mass=-1"]
    assert len((tmp_path / "c.csv").read_text(encoding="utf-8").splitlines()) == 3
    both = ("station_keeping", "station_keeping_pd", "--output", tmp_path / "d.png")
    assert call("compare", *both, "--fail-on", "lost").exit_code == 0
    assert call("compare", *both, "--fail-on", "offset").exit_code == 1


def test_compare_varies_beside_what_holds_for_all(archives, tmp_path):
    both = ("--trouble", "bias", "--vary", "trouble=noise_2,delay_3", "--stop-time", "0.3")
    ok("compare", "bluerov2", *both, "--output", tmp_path / "c.png")
    with_bias = (tmp_path / "c.csv").read_text(encoding="utf-8")
    ok("compare", "bluerov2", *both[2:], "--output", tmp_path / "d.png")
    assert with_bias != (tmp_path / "d.csv").read_text(encoding="utf-8")


def test_an_interrupted_comparison_stops_and_shows_what_it_has(archives, tmp_path, monkeypatch):
    started = []

    def interrupted(wiring, *arguments):
        started.append(wiring.name)
        return replace(run(PAPER, stop_time=0.3), failure="Interrupted at 0.3 s.", is_interrupted=True)

    monkeypatch.setattr(compare, "simulated", interrupted)
    done = call("compare", "station_keeping", "station_keeping_pd", "--output", tmp_path / "c.png")
    assert (done.exit_code, started) == (1, ["station_keeping"])
    assert (tmp_path / "c.csv").is_file()


def test_a_system_without_arm_or_controller_has_a_verdict_by_its_pose(fmus):
    alone = wire(System("alone", "", {"rov_plant": "rov_plant"}, (), 3.0), fmus)
    assert simulated(alone).score.verdict == "held"
    drifting = wire(System("alone", "", {"rov_plant": "rov_plant"}, (), 60.0, {"rov_plant": {"current.x": 0.2}}), fmus)
    assert str(simulated(drifting).score).startswith("lost at ")


def test_troubles_that_need_a_controller_do_not_apply_without_one(fmus):
    alone = wire(System("alone", "", {"rov_plant": "rov_plant"}, (), 3.0), fmus)
    with pytest.raises(DoesNotApplyError, match="There is no controller with parameters K_"):
        TROUBLES["paper_gains"].applied(alone)
