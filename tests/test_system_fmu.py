"""A whole system as one FMU: the master's numbers, states, steps, logs, and elements of other makes."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from lxml import etree
from pythonfmu.builder import FmuBuilder

from fmu import Fmu
from rov_cosim.exporters import archive, native_export, zig
from rov_cosim.exporters.build import components
from rov_cosim.importers.measuring import measure
from rov_cosim.importers.tools import IMPORTERS
from rov_cosim.master.exchange import gauss_seidel, jacobi
from rov_cosim.master.simulation import simulate
from rov_cosim.ssp.declaration import System, wire
from rov_cosim.ssp.z_down import Z_DOWN
from rov_cosim.systems.catalogue import SYSTEMS
from rov_cosim.whole import writer
from rov_cosim.whole.layout import laid_out
from typical import distinct, typical

COUPLINGS = {"jacobi": (0, jacobi), "gauss-seidel": (1, gauss_seidel)}
NAME = "station_keeping"
H = 0.03


@pytest.fixture
def system(systems, tmp_path):
    """Return what opens the FMU of a system."""
    opened = []

    def open_(name=NAME):
        opened.append(Fmu(systems[name], tmp_path / f"{name}{len(opened)}"))
        return opened[-1]

    yield open_
    for one in opened:
        one.fmu.freeInstance()


def equal(found, ours):
    return all(np.array_equal(found[name], ours[name]) for name in ours.dtype.names if name != "time")


def run(path, ours, **values):
    names = list(ours.dtype.names[1:])
    stop = ours["time"][-1]
    return simulate_fmu(path, stop_time=stop, output_interval=H, output=names, start_values=values)


def assert_the_masters_numbers(path, name, coupling, stop_time):
    number, function = COUPLINGS[coupling]
    ours = simulate(wire(SYSTEMS[name]), function, stop_time=stop_time)
    found = run(path, ours, coupling=number)
    assert len(found) == len(ours)
    assert equal(found, ours)


@pytest.mark.parametrize("coupling", COUPLINGS)
@pytest.mark.parametrize("name", [NAME, "bluerov2_heavy_pid"])
def test_it_gives_the_masters_numbers_to_the_last_bit(systems, name, coupling):
    assert_the_masters_numbers(systems[name], name, coupling, 6.0)


@pytest.mark.slow
@pytest.mark.parametrize("coupling", COUPLINGS)
@pytest.mark.parametrize("name", distinct(SYSTEMS, "paper_simulation", "bluerov2_heavy", "minerva_pd"))
def test_every_system_gives_the_masters_numbers_over_its_whole_run(systems, name, coupling):
    assert_the_masters_numbers(systems[name], name, coupling, None)


def test_the_couplings_differ(systems):
    ours = simulate(wire(SYSTEMS[NAME]), stop_time=1.0)
    assert not equal(run(systems[NAME], ours, coupling=1), ours)


@pytest.mark.parametrize("name", [NAME, pytest.param("minerva_pid", marks=pytest.mark.slow)])
def test_its_description_has_what_the_elements_declare(systems, name):
    wiring, description = wire(SYSTEMS[name]), read_model_description(str(systems[name]))
    shown = {variable.name: variable for variable in description.modelVariables}
    fed = {str(link.target) for link in wiring.links}
    for element in wiring.elements:
        for declared in element.description.modelVariables:
            end = f"{element.name}.{declared.name}"
            assert (end in shown) == (end not in fed)
            if end in shown:
                kept = ("type", "unit", "displayUnit", "min", "max", "description", "causality", "variability")
                assert all(getattr(shown[end], key) == getattr(declared, key) for key in kept)
                start = element.start_values.get(declared.name, declared.start)
                assert shown[end].start == (None if start is None else str(start).lower()) or (
                    float(shown[end].start) == float(start)
                )
    assert set(shown) - {f"{e.name}.{v}" for e in wiring.elements for v in e.variables} == {"coupling"}
    assert description.coSimulation.canSerializeFMUstate


def rest_of_run(one, first, last):
    rows = []
    for n in range(first, last):
        one.step(n)
        rows.append(one.outputs())
    return rows


def test_a_saved_state_goes_on_to_the_last_bit(system):
    one, other = system(), system()
    for each in (one, other):
        each["rov_plant.current.x"] = 0.1
        each.start()
    rest_of_run(one, 0, 100)
    state = one.fmu.getFMUState()
    data = one.fmu.serializeFMUState(state)
    expected = rest_of_run(one, 100, 200)
    one.fmu.setFMUState(state)
    assert rest_of_run(one, 100, 200) == expected
    other.fmu.setFMUState(other.fmu.deserializeFMUState(data))
    assert rest_of_run(other, 100, 200) == expected


def test_a_state_of_the_initialization_is_restored(system):
    one = system()
    one["rov_plant.eta_0.x"] = 0.2
    one.fmu.setupExperiment(startTime=0.0)
    one.fmu.enterInitializationMode()
    state = one.fmu.getFMUState()
    one.fmu.exitInitializationMode()
    expected = rest_of_run(one, 0, 20)
    one.fmu.setFMUState(state)
    one["rov_plant.eta_0.x"] = 0.4
    assert one["passive_arm.eta_m.x"] > 0.3
    one["rov_plant.eta_0.x"] = 0.2
    one.fmu.exitInitializationMode()
    assert rest_of_run(one, 0, 20) == expected


def test_a_reset_starts_anew_to_the_last_bit(system):
    one = system()
    one.start()
    expected = rest_of_run(one, 0, 100)
    one["controller.K_P.x"] = 200.0
    one.fmu.reset()
    one.start()
    assert rest_of_run(one, 0, 100) == expected


def test_instances_run_in_threads_of_their_own(system):
    ones = [system() for _ in range(4)]
    for i, one in enumerate(ones):
        one["rov_plant.eta_0.x"] = 0.1 * (i % 2)
        one.start()
    with ThreadPoolExecutor(4) as pool:
        rows = list(pool.map(lambda one: rest_of_run(one, 0, 200), ones))
    assert rows[0] == rows[2]
    assert rows[1] == rows[3]
    assert rows[0] != rows[1]


@pytest.mark.parametrize("n", [2, 7])
def test_a_step_may_be_several_inner_ones(system, n):
    one, other = system(), system()
    for each in (one, other):
        each.start()
    for k in range(20):
        one.fmu.doStep(k * n * H, n * H)
        assert one.outputs() == rest_of_run(other, k * n, (k + 1) * n)[-1]


@pytest.mark.parametrize("h", [0.01, 0.05, 0.03 * (1 + 1e-5)])
def test_a_step_that_is_no_multiple_is_refused_and_changes_nothing(system, h):
    one, other = system(), system()
    for each in (one, other):
        each.start()
        rest_of_run(each, 0, 10)
    with pytest.raises(FMICallException):
        one.fmu.doStep(10 * H, h)
    assert f"step of {h:.6g} s is no multiple of the inner step of 0.03 s" in one.errors
    assert rest_of_run(one, 10, 20) == rest_of_run(other, 10, 20)


def test_rounding_of_the_host_does_no_harm(system):
    one, other = system(), system()
    one.start()
    other.start()
    time = 0.0
    for _ in range(2000):  # sums drift, by more than a share of the last digit
        one.fmu.doStep(time, H)
        time += H
    one.fmu.doStep(time, 5e-15)
    assert one.outputs() == rest_of_run(other, 0, 2000)[-1]


def test_any_start_time_and_stop_time(archives, tmp_path):
    out = tmp_path / "out.csv"
    fmpy = Path(sys.executable).with_name("fmpy")
    command = [fmpy, "simulate", archives[NAME], "--stop-time", "10", "--output-file", out]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert out.read_text(encoding="utf-8").splitlines()[-1].startswith("9.99,")


def test_a_warning_has_the_name_of_its_element(system):
    one = system()
    one["rov_plant.eta_0.x"] = 5.0
    one.start()
    assert any("passive_arm: At 0 s: " in warning for warning in one.warnings)


def test_a_failed_step_names_the_element_and_the_way_on(system):
    one = system()
    one.set({"rov_plant.lock_roll_pitch": False, "rov_plant.r_B.z": 0.0, "rov_plant.F_A.z": 60.0})
    one.start()
    state = one.fmu.getFMUState()
    with pytest.raises(FMICallException):
        rest_of_run(one, 0, 1500)
    assert "rov_plant: The step from" in one.errors
    assert "eta.theta" in one.errors
    one.slave.errors.clear()
    with pytest.raises(FMICallException):
        one.step(0)
    assert "stopped by a failure" in one.errors
    one.fmu.setFMUState(state)
    one.step(0)
    one.fmu.reset()
    one.start()
    one.step(0)


def test_initial_values_that_cannot_be_name_their_element(system):
    one = system()
    one["rov_plant.eta_0.phi"] = 0.1
    one.fmu.setupExperiment(startTime=0.0)
    one.fmu.enterInitializationMode()
    with pytest.raises(FMICallException):
        one.fmu.exitInitializationMode()
    assert "rov_plant: Roll and pitch are locked" in one.errors
    one["rov_plant.eta_0.phi"] = 0.0
    one.fmu.exitInitializationMode()
    one.step(0)


def test_a_tunable_parameter_counts_from_the_next_step(system):
    one, other = system(), system()
    for each in (one, other):
        each.start()
        rest_of_run(each, 0, 20)
    one["controller.K_P.z"] = 800.0
    assert one.outputs() == other.outputs()
    assert rest_of_run(one, 20, 25) != rest_of_run(other, 20, 25)
    one["controller.K_P.z"] = other["controller.K_P.z"]
    assert one["controller.K_P.z"] == other["controller.K_P.z"]


@pytest.fixture(scope="module")
def z_down(fmus, tmp_path_factory):
    """Return a system with a plant that this project did not make, and with signs."""
    folder = tmp_path_factory.mktemp("ned")
    plant = FmuBuilder.build_FMU(Path(__file__).parent / "fmus" / "ned_plant.py", folder)
    connections = (
        ("plant.pose", "controller.eta_m", Z_DOWN),
        ("plant.valid", "controller.eta_m_valid"),
        ("controller.tau", "plant.force", Z_DOWN),
    )
    parameters = {"plant": {"push.y": 3.0, "push.z": 2.0}}
    declared = System("ned", "", {"plant": "ned", "controller": "adaptive_pd"}, connections, 6.0, parameters)
    return wire(declared, {**fmus, "ned": plant})


@pytest.mark.parametrize("coupling", typical(COUPLINGS, "jacobi"))
def test_elements_of_another_make_are_loaded_and_get_the_factors(z_down, tmp_path, coupling):
    path, told = tmp_path / "ned.ssp", []
    assert writer.write(z_down, path, warn=told.append)
    assert not writer.write(z_down, path)
    assert told == []
    assert validate_fmu(str(path)) == []
    number, function = COUPLINGS[coupling]
    ours = simulate(z_down, function)
    assert np.abs(ours["plant.pose.z"]).max() > 1e-3
    assert equal(run(path, ours, coupling=number), ours)


def test_what_cannot_save_its_elements_says_so(z_down, tmp_path):
    path = tmp_path / "ned.fmu"
    writer.write_fmu(z_down, path)
    assert not read_model_description(str(path)).coSimulation.canGetAndSetFMUstate
    one = Fmu(path, tmp_path / "ned")
    one.start()
    with pytest.raises(FMICallException):
        one.fmu.getFMUState()
    assert "FMUs of their own" in one.errors
    one.fmu.reset()
    one.start()
    one.step(0)
    one.fmu.freeInstance()


def test_an_archive_without_a_compiler_is_an_ssp_alone(z_down, tmp_path, monkeypatch):
    monkeypatch.setattr("rov_cosim.exporters.zig.find_spec", lambda name: None)
    told = []
    assert writer.write(z_down, tmp_path / "ned.ssp", warn=told.append)
    assert told == [
        "ned: one FMU takes a compiler: pip install casadi ziglang. "
        "The archive has SSP content alone, which `fmpy simulate` cannot run."
    ]
    assert "modelDescription.xml" not in archive.read(tmp_path / "ned.ssp")


def test_two_elements_of_a_component_share_its_code_and_nothing_else(fmus, tmp_path):
    connections = (("a.e", "b.eta_d", {"y": -1.0}),)
    parameters = {"a": {"eta_m_valid": True, "eta_d.y": 0.3}, "b": {"eta_m_valid": True, "eta_m.y": 0.1}}
    two = wire(System("two", "", {"a": "pid", "b": "pid"}, connections, 0.9, parameters), fmus)
    writer.write_fmu(two, tmp_path / "two.fmu")
    ours = simulate(two)
    assert not np.array_equal(ours["a.e.y"], ours["b.e.y"])
    assert equal(run(tmp_path / "two.fmu", ours), ours)


@pytest.mark.parametrize("tool", ["ecos", "libcosim", pytest.param("toolbox", marks=pytest.mark.slow)])
def test_other_masters_run_it_as_an_fmu(systems, tmp_path, tool):
    if IMPORTERS[tool].version() is None:
        pytest.skip(f"{tool} is not installed; it is part of the extra importers")
    outer = wire(System("outer", "", {"whole": NAME}, (), 6.0), {NAME: systems[NAME]})
    path = tmp_path / "outer.ssp"
    writer.write(outer, path, plain=True)
    assert measure(tool, "loop", path, 6.0) <= IMPORTERS[tool].tolerance
    inner = simulate(wire(SYSTEMS[NAME]), stop_time=6.0)
    ours = simulate(outer)
    assert all(np.array_equal(ours[f"whole.{name}"], inner[name]) for name in inner.dtype.names[1:])


def test_the_layout_has_each_value_once(archives):
    layout = laid_out(wire(SYSTEMS["bluerov2"]))
    assert [shown.variable.valueReference for shown in layout.variables] == list(range(len(layout.variables)))
    assert sum(len(copies.to) for copies in layout.copies) == len(layout.wiring.links)


def test_a_rebuild_gives_the_same_bytes(systems, tmp_path):
    again = tmp_path / f"{NAME}.fmu"
    assert writer.write_fmu(wire(SYSTEMS[NAME]), again)
    assert again.read_bytes() == systems[NAME].read_bytes()
    assert not writer.write_fmu(wire(SYSTEMS[NAME]), again)


@pytest.mark.slow
def test_the_sources_inside_make_the_same(systems, tmp_path):
    content = archive.read(systems[NAME])
    listed = [file.get("name") for file in etree.fromstring(content["modelDescription.xml"]).iter("File")]
    sources = {n.removeprefix("sources/"): data for n, data in content.items() if n.startswith("sources/")}
    assert set(listed) == {name for name in sources if name.endswith(".c") and "/" not in name}
    binary = zig.shared_library(NAME, sources, "linux64")
    made = tmp_path / "made.fmu"
    archive.write(made, {**content, f"binaries/linux64/{NAME}.so": binary})
    ours = simulate(wire(SYSTEMS[NAME]), stop_time=3.0)
    assert equal(run(made, ours), ours)


@pytest.mark.slow
@pytest.mark.parametrize("linked", [True, False])
def test_there_is_a_binary_for_each_platform_of_all_elements(fmus, tmp_path, linked):
    component = components()["scenario"]
    path = tmp_path / "scenario.fmu"
    native_export.export(component, path, zig.TARGETS)
    if not linked:
        archive.write(path, {**archive.read(path), "sources/recipe.txt": b"another"})
    writer.write_fmu(wire(System("one", "", {"a": "scenario"}, (), 0.9), {"scenario": path}), tmp_path / "one.fmu")
    content = archive.read(tmp_path / "one.fmu")
    assert ("resources/a/modelDescription.xml" in content) == (not linked)
    assert {name for name in content if name.startswith("binaries/")} == {
        f"binaries/{platform}/one{zig.SUFFIXES[platform]}" for platform in zig.TARGETS
    }
