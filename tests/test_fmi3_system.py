"""A whole system as one FMU of FMI 3.0: arrays, and the numbers of that of 2.0."""

import csv
import shutil
import subprocess
from pathlib import Path
from types import SimpleNamespace

import fmpy
import numpy as np
import pytest
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave
from fmpy.model_description import read_build_description
from fmpy.validation import validate_fmu
from lxml import etree

from rov_cosim.exporters import archive, native_export, zig
from rov_cosim.exporters.build import FMI3, components, fmu_path, project_root
from rov_cosim.ssp.declaration import System, wire
from rov_cosim.study import archives as building
from rov_cosim.systems.catalogue import SYSTEMS
from rov_cosim.whole import writer
from rov_cosim.whole.face import FaceError
from typical import distinct

NAME = "station_keeping"
H = 0.03


@pytest.fixture(scope="module")
def built(systems):
    """Return what builds the FMUs of a system; they are by the version of FMI."""

    def build(name=NAME):
        building.build_fmi3(SYSTEMS[name])
        return {2: systems[name], 3: fmu_path(project_root(), name, FMI3)}

    return build


@pytest.fixture
def system(built, tmp_path):
    """Return what opens an instance, with its log and its variables by name."""
    opened = []

    def open_():
        path = built()[3]
        description = read_model_description(str(path))
        messages = []
        one = FMU3Slave(
            guid=description.guid,
            unzipDirectory=extract(str(path), tmp_path / str(len(opened))),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="tested",
        )
        one.instantiate(loggingOn=True, logMessage=lambda _, status, category, text: messages.append(text.decode()))
        variables = {variable.name: variable for variable in description.modelVariables}
        opened.append(SimpleNamespace(fmu=one, messages=messages, variables=variables))
        return opened[-1]

    yield open_
    for one in opened:
        one.fmu.freeInstance()


def pose(one):
    return one.fmu.getFloat64([one.variables["rov_plant.eta"].valueReference], 6)


def begin(one):
    one.fmu.enterInitializationMode()
    one.fmu.exitInitializationMode()


def run(one, first, last):
    rows = []
    for n in range(first, last):
        one.fmu.doStep(n * H, H)
        rows.append(pose(one))
    return rows


def outputs(path):
    """Return the names of the outputs in the order of value references."""
    return [v.name for v in read_model_description(str(path)).modelVariables if v.causality == "output"]


def assert_equal(fmus, stop_time, two=None, three=None):
    """Check that both have the same outputs in FMPy, with start values of each."""
    found = []
    for fmi, values in ((2, two or {}), (3, three or {})):
        names = outputs(fmus[fmi])
        rows = simulate_fmu(fmus[fmi], stop_time=stop_time, output_interval=H, output=names, start_values=values)
        found.append(np.concatenate([rows[name].reshape(len(rows), -1) for name in names], axis=1))
    assert len(found[0]) > stop_time / H - 2
    assert np.array_equal(*found)


@pytest.mark.parametrize("coupling", [0, 1])
def test_fmpy_gets_the_numbers_of_fmi_2_to_the_last_digit(built, coupling):
    two = {"rov_plant.current.x": 0.1, "rov_plant.thruster[8].enabled": False, "coupling": coupling}
    enabled = [True] * 7 + [False]
    three = {"rov_plant.current": [0.1, 0.0, 0.0], "rov_plant.thruster.enabled": enabled, "coupling": coupling}
    assert_equal(built(), 3.0, two, three)


@pytest.mark.slow
@pytest.mark.parametrize("name", distinct(SYSTEMS, "paper_simulation", "bluerov2_heavy", "minerva_pd"))
def test_every_system_has_the_numbers_of_fmi_2_over_its_whole_run(built, name):
    assert_equal(built(name), SYSTEMS[name].stop_time)


@pytest.mark.slow
def test_fmusim_gets_the_numbers_of_fmi_2_in_the_digits_that_it_prints(built, tmp_path):
    if not (fmusim := shutil.which("fmusim")):
        pytest.skip("fmusim of the Reference FMUs is not installed")
    fmus, out, n = built(), tmp_path / "out.csv", 1000
    command = [fmusim, "--stop-time", n * H, "--output-interval", H, "--output-file", out]
    command += ["--start-value", "rov_plant.current", "0.1 0 0", fmus[3]]
    subprocess.run([str(part) for part in command], check=True)
    names, *rows = csv.reader(out.read_text(encoding="utf-8").splitlines())
    scalars, current = outputs(fmus[2]), {"rov_plant.current.x": 0.1}
    ours = simulate_fmu(fmus[2], stop_time=n * H, output_interval=H, output=scalars, start_values=current)
    for column, name in enumerate(names[1:], 1):
        own = [scalar for scalar in scalars if scalar == name or scalar.startswith((f"{name}.", f"{name}["))]
        found = np.array([[float(value) for value in row[column].split()] for row in rows])
        np.testing.assert_allclose(found, np.stack([ours[scalar] for scalar in own], axis=1), rtol=1e-15, atol=0)


def test_fmpy_finds_no_problem_and_all_sources_are_listed(built):
    path = built()[3]
    assert validate_fmu(str(path)) == []
    schema = etree.XMLSchema(file=Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3TerminalsAndIcons.xsd")
    schema.assertValid(etree.fromstring(archive.read(path)["terminalsAndIcons/terminalsAndIcons.xml"]))
    assert read_model_description(str(path)).coSimulation.fixedInternalStepSize == str(H)
    (configuration,) = read_build_description(str(path))
    listed = {f"sources/{file}" for file in configuration.sourceFileSets[0].sourceFiles}
    assert listed == {n for n in archive.names(path) if n.endswith(".c") and n.count("/") == 1}


def test_a_signal_is_an_array_unless_it_is_connected(built):
    shown = {v.name: v for v in read_model_description(str(built()[3])).modelVariables}
    wiring = wire(SYSTEMS[NAME])
    fed = {str(link.target) for link in wiring.links}
    for element in wiring.elements:
        component = components()[element.description.modelName]
        for signal in component.inputs + component.outputs + component.parameters:
            variable = shown.pop(f"{element.name}.{signal.name}", None)
            connected = [f"{element.name}.{name}" in fed for name in signal.names]
            assert (variable is None) == all(connected)
            assert any(connected) or variable.shape == signal.shape
    assert set(shown) == {"coupling", "time"}


def test_each_terminal_of_an_element_has_its_signals_as_the_elements_own_fmu_has(built, fmi3_fmus):
    def terminals(path):
        root = etree.fromstring(archive.read(path)["terminalsAndIcons/terminalsAndIcons.xml"])
        return {t.get("name"): [(m.get("memberName"), m.get("variableName")) for m in t] for t in root.iter("Terminal")}

    shown = {variable.name for variable in read_model_description(str(built()[3])).modelVariables}
    expected = {}
    for element, component in SYSTEMS[NAME].elements.items():
        for name, members in terminals(fmi3_fmus[component]).items():
            named = [(key, f"{element}.{variable}") for key, variable in members]
            if shown.issuperset(variable for _, variable in named):
                expected[f"{element}.{name}"] = named
    assert {"rov_plant.pose", "rov_plant.velocity", "controller.thrusters"} <= expected.keys()
    assert terminals(built()[3]) == expected


def test_a_saved_state_goes_on_to_the_last_bit(system):
    one, other = system(), system()
    for each in (one, other):
        begin(each)
    run(one, 0, 50)
    state = one.fmu.getFMUState()
    data = one.fmu.serializeFMUState(state)
    expected = run(one, 50, 80)
    one.fmu.setFMUState(state)
    assert run(one, 50, 80) == expected
    other.fmu.setFMUState(other.fmu.deserializeFMUState(data))
    assert run(other, 50, 80) == expected


def test_what_fails_is_told_by_the_name_of_the_element(system):
    one = system()
    one.fmu.setFloat64([one.variables["rov_plant.eta_0"].valueReference], [0.0, 0.0, 0.0, 0.1, 0.0, 0.0])
    one.fmu.enterInitializationMode()
    with pytest.raises(FMICallException):
        one.fmu.exitInitializationMode()
    assert "rov_plant: Roll and pitch are locked" in one.messages[-1]


def test_a_step_that_is_no_multiple_and_a_derivative_are_refused_and_change_nothing(system):
    one, other = system(), system()
    for each in (one, other):
        begin(each)
    with pytest.raises(FMICallException):
        one.fmu.doStep(0.0, 0.05)
    assert "no multiple of the inner step of 0.03 s" in one.messages[-1]
    known, unknown = (one.variables[name].valueReference for name in ("rov_plant.current", "rov_plant.eta"))
    with pytest.raises(FMICallException):
        one.fmu.getDirectionalDerivative([unknown], [known], [1.0, 0.0, 0.0], 6)
    assert "no directional derivatives" in one.messages[-1]
    assert run(one, 0, 5) == run(other, 0, 5)


def test_elements_that_cannot_be_linked_are_refused(fmus, tmp_path):
    content = archive.read(fmus["scenario"])
    archive.write(tmp_path / "other.fmu", {**content, "sources/recipe.txt": b"another compiler"})
    other = wire(System("other", "", {"a": "scenario"}, (), 0.9), {"scenario": tmp_path / "other.fmu"})
    with pytest.raises(FaceError, match="takes native FMUs of this project alone"):
        writer.write_fmu(other, tmp_path / "whole.fmu", fmi=3)
    assert not (tmp_path / "whole.fmu").exists()


@pytest.mark.slow
def test_there_is_a_binary_for_each_tuple_for_which_all_elements_are_built(tmp_path):
    path, whole = tmp_path / "scenario.fmu", tmp_path / "one.fmu"
    native_export.export(components()["scenario"], path, zig.TARGETS)
    writer.write_fmu(wire(System("one", "", {"a": "scenario"}, (), 0.9), {"scenario": path}), whole, fmi=3)
    found = {name for name in archive.names(whole) if name.startswith("binaries/")}
    assert found == {f"binaries/{platform}/one{zig.SUFFIXES[platform]}" for platform in zig.TUPLES}
