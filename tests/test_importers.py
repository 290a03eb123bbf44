"""Other masters run every archive with the same result: FMPy's stock command in detail, Ecos, libcosim."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import Parameter, ParameterSet

from rov_cosim.exporters import archive, zig
from rov_cosim.importers.measuring import measure
from rov_cosim.importers.tools import IMPORTERS
from rov_cosim.master.simulation import simulate
from rov_cosim.ssp import reader as ssp_reader
from rov_cosim.ssp.declaration import wire
from rov_cosim.systems.catalogue import SYSTEMS
from rov_cosim.whole.writer import write
from typical import typical

WIRE = "station_keeping_taut_wire"
STOP = 12.0
# libcosim keeps time in whole nanoseconds, so that its steps differ in the last digit. The vehicle sums that up, and
# nothing corrects it until an encoder counts on.
TOLERANCE = {"ecos": 0.0, "libcosim": 1e-11}


def ours(path, stop, **values):
    with ssp_reader.opened(path) as wiring:
        return simulate(wiring.with_values(values), stop_time=stop)


def stock_fmpy(path, folder, *arguments):
    """Run `fmpy simulate` as a user would and return the CSV."""
    out = folder / "out.csv"
    fmpy = Path(sys.executable).with_name("fmpy")
    command = [fmpy, "simulate", path.name, "--output-file", out, *arguments]
    done = subprocess.run(command, cwd=path.parent, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return np.genfromtxt(out, delimiter=",", names=True, deletechars="", dtype=None, encoding=None)


def assert_same(theirs, results):
    every = round((theirs["time"][1] - theirs["time"][0]) / 0.03)
    assert theirs["time"] == pytest.approx(results["time"][::every])
    assert set(theirs.dtype.names) == set(results.dtype.names)
    for name in results.dtype.names:
        assert np.array_equal(theirs[name], results[name][::every]), name


@pytest.mark.slow
def test_stock_fmpy_runs_the_whole_archive_as_typed(archives, tmp_path):
    theirs = stock_fmpy(archives["station_keeping"], tmp_path)
    assert theirs["time"][-1] == pytest.approx(84.0)
    assert_same(theirs, ours(archives["station_keeping"], 84.0))


@pytest.mark.parametrize(
    "name",
    typical(
        ["station_keeping", "paper_simulation", WIRE, "bluerov2_heavy", "rexrov_pid"],
        WIRE,
    ),
)
def test_stock_fmpy_runs_every_archive(archives, tmp_path, name):
    theirs = stock_fmpy(archives[name], tmp_path, "--stop-time", "9")
    assert_same(theirs, ours(archives[name], 9.0))


def test_stock_fmpy_takes_start_values(archives, tmp_path):
    arguments = (
        "--stop-time",
        "6",
        "--start-values",
        "controller.K_P.x",
        "120",
        "passive_arm.seed",
        "7",
        "controller.adaptation",
        "false",
    )
    theirs = stock_fmpy(archives["station_keeping"], tmp_path, *arguments)
    values = {"controller.K_P.x": 120.0, "passive_arm.seed": 7, "controller.adaptation": False}
    assert_same(theirs, ours(archives["station_keeping"], 6.0, **values))
    assert theirs["controller.theta_hat.dB"][-1] == 0
    other = ours(archives["station_keeping"], 6.0)
    assert np.abs(theirs["rov_plant.eta.x"] - other["rov_plant.eta.x"]).max() > 1e-4


def test_stock_fmpy_tells_why_an_fmu_refuses(archives, tmp_path):
    command = [Path(sys.executable).with_name("fmpy"), "simulate", archives["station_keeping"]]
    command += ["--output-file", tmp_path / "out.csv", "--start-values", "rov_plant.mass", "-1"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "mass is -1; expected a finite number of at least 0.001." in done.stdout + done.stderr


@pytest.mark.parametrize("tool", TOLERANCE)
@pytest.mark.parametrize(
    "name",
    typical(
        ["station_keeping_pd", "paper_simulation", WIRE, "bluerov2_heavy"],
        WIRE,
    ),
)
def test_other_masters_load_and_run_every_archive(archives, tool, name):
    if IMPORTERS[tool].version() is None:
        pytest.skip(f"{IMPORTERS[tool].title} is not installed; it is part of the test extra on Linux")
    assert measure(tool, "loop", archives[name], STOP) <= TOLERANCE[tool]


@pytest.fixture(scope="module")
def wire_loops(archives, python_fmus, tmp_path_factory):
    """Return the archives of the taut wire's system by export, each an FMU too, of this platform alone."""
    folder = tmp_path_factory.mktemp("wire")
    here = {}
    for name in SYSTEMS[WIRE].elements.values():
        content = archive.read(python_fmus[name])
        place = f"binaries/{zig.host_platform()}/"
        here[name] = folder / f"{name}.fmu"
        kept = {n: data for n, data in content.items() if not n.startswith("binaries/") or n.startswith(place)}
        archive.write(here[name], kept)
    write(wire(SYSTEMS[WIRE], here), folder / "wire.ssp")
    return {"native": archives[WIRE], "pythonfmu": folder / "wire.ssp"}


@pytest.mark.slow
@pytest.mark.parametrize(("export", "stop_time"), [("native", None), ("pythonfmu", 6.0)])
@pytest.mark.parametrize("tool", ["fmpy", *TOLERANCE])
def test_the_taut_wire_measures_in_both_exports_in_other_masters(wire_loops, export, stop_time, tool):
    # To a millionth of a millimetre their runs are ours, of which test_taut_wire_loop.py tells how well they hold.
    if IMPORTERS[tool].version() is None:
        pytest.skip(f"{IMPORTERS[tool].title} is not installed; it is part of the test extra on Linux")
    assert measure(tool, "loop", wire_loops[export], stop_time) < 1e-9


def test_a_tool_that_hands_the_first_pose_on_late_kicks_no_vehicle(archives):
    # simulate_ssp starts every input at 0 and hands values on after a step: the first measurement is of a pose of 0.
    archive, own = archives["station_keeping"], SYSTEMS["station_keeping"].parameters
    values = {f"{element}.{name}": value for element, group in own.items() for name, value in group.items()}
    given = ParameterSet(parameters=[Parameter(name=name, value=value) for name, value in values.items()])
    theirs = simulate_ssp(str(archive), stop_time=30.0, step_size=0.03, parameter_set=given)
    results = ours(archive, 30.0)
    thrust = np.array([np.abs([run[f"controller.u[{i}]"] for i in range(1, 9)]).max() for run in (theirs, results)])
    assert thrust[0] == pytest.approx(thrust[1], rel=0.1)  # 757 N as against 51 N where the jump counts as a velocity
    settled = results["time"][1:] > 15.0
    for axis, close in (("x", 5e-3), ("y", 5e-3), ("z", 5e-3), ("psi", 0.01)):
        apart = theirs[f"rov_plant.eta.{axis}"] - results[f"rov_plant.eta.{axis}"][1:]
        assert np.abs(apart[settled]).max() < close, axis
