"""The FMUs of FMI 3.0: the same numbers as those of 2.0, arrays, states, derivatives, terminals, platforms."""

from importlib.resources import files
from pathlib import Path

import fmpy
import lief
import numpy as np
import pytest
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave
from fmpy.model_description import read_build_description
from fmpy.validation import validate_fmu
from lxml import etree

from rig import RELAXED, random_inputs
from rov_cosim.exporters import archive, native_export, zig
from rov_cosim.exporters.build import components
from rov_cosim.exporters.terminals import TERMINALS
from rov_cosim.systems.loop import SENSORS, SET_POINT_RATE, connections, element_of
from typical import typical

COMPONENTS = components()
NAMES = list(COMPONENTS)
TYPICAL = typical(NAMES, "adaptive_pd", "passive_arm", "rov_plant")
HEADERS = files("fmpy") / "c-code"
SCHEMAS = Path(fmpy.__file__).parent / "schema" / "fmi3"
HERE = zig.host_platform(3)


class Fmu3:
    """An instance of FMI 3.0, with the elements of its arrays by their names in FMI 2.0."""

    def __init__(self, path: Path, folder: Path):
        description = read_model_description(str(path))
        self.messages: list[str] = []
        self.fmu = FMU3Slave(
            guid=description.guid,
            unzipDirectory=extract(str(path), folder),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="tested",
        )
        self.fmu.instantiate(logMessage=lambda _, status, category, text: self.messages.append(text.decode()))
        component = COMPONENTS[path.stem]
        self.variables = {v.name: v for v in description.modelVariables}
        signals = component.inputs + component.outputs + component.parameters
        self.place = {name: (s.name, i) for s in signals for i, name in enumerate(s.names)}
        self.size = {s.name: s.size for s in signals}
        self.output_names = [s.name for s in component.outputs]

    def get(self, name):
        variable = self.variables[name]
        return getattr(self.fmu, f"get{variable.type}")([variable.valueReference], self.size.get(name, 1))

    def put(self, name, values):
        variable = self.variables[name]
        getattr(self.fmu, f"set{variable.type}")([variable.valueReference], values)

    def set(self, values):
        changed = {}
        for name, value in values.items():
            whole, i = self.place[name]
            changed.setdefault(whole, self.get(whole))[i] = value
        for name, elements in changed.items():
            self.put(name, elements)

    def outputs(self):
        return [value for name in self.output_names for value in self.get(name)]

    def start(self):
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def step(self, n, h=0.03):
        self.fmu.doStep(n * h, h)


@pytest.fixture
def native3(fmi3_fmus, tmp_path):
    """Return what opens an FMU of FMI 3.0 by its component's name."""
    opened = []

    def open_(name):
        opened.append(Fmu3(fmi3_fmus[name], tmp_path / f"three {name}{len(opened)}"))
        return opened[-1]

    yield open_
    for one in opened:
        one.fmu.freeInstance()


@pytest.mark.parametrize("name", NAMES)
def test_fmpy_finds_no_problem_and_the_schemas_hold(fmi3_fmus, name):
    path = fmi3_fmus[name]
    assert validate_fmu(str(path)) == []
    content = archive.read(path)
    schema = etree.XMLSchema(file=SCHEMAS / "fmi3TerminalsAndIcons.xsd")
    schema.assertValid(etree.fromstring(content["terminalsAndIcons/terminalsAndIcons.xml"]))
    assert content["terminalsAndIcons/icon.png"].startswith(b"\x89PNG")
    (configuration,) = read_build_description(str(path))
    sources = {f"sources/{file}" for file in configuration.sourceFileSets[0].sourceFiles}
    assert sources == {entry for entry in content if entry.endswith(".c")}
    assert not [entry for entry in content if "fmi2" in entry]


@pytest.mark.parametrize("name", NAMES)
def test_the_description_says_what_the_interface_declares(fmi3_fmus, name):
    component = COMPONENTS[name]
    description = read_model_description(str(fmi3_fmus[name]))
    variables = {v.name: v for v in description.modelVariables}
    assert variables.pop("time").causality == "independent"
    for causality in ("input", "output", "parameter"):
        for signal in getattr(component, f"{causality}s"):
            variable = variables.pop(signal.name)
            assert (variable.causality, variable.shape) == (causality, signal.shape)
            assert {variable.unit or ""} >= (set(signal.units) if len(set(signal.units)) == 1 else {""})
            assert len(set(signal.units)) == 1 or all(f" in {unit}" in variable.description for unit in signal.units)
            if causality != "output":
                words = {"true": 1.0, "false": 0.0}
                start = [words[word] if word in words else float(word) for word in variable.start.split()]
                assert start == signal.elements(signal.start).tolist()
            if causality == "parameter":
                assert variable.variability == ("tunable" if signal.tunable else "fixed")
    assert variables == {}


@pytest.mark.parametrize("name", TYPICAL)
def test_the_numbers_are_those_of_fmi_2_to_the_last_digit(native, native3, name):
    both, random = (native(name), native3(name)), np.random.default_rng(3)
    for one in both:
        one.set(RELAXED[name])
        one.start()
    for n in range(600):
        if n % 7 == 0:
            change = random_inputs(COMPONENTS[name], random)
            for one in both:
                one.set(change)
        for one in both:
            one.step(n)
        two, three = (one.outputs() for one in both)
        assert two == three, n
    assert any(two)


@pytest.mark.parametrize("name", TYPICAL)
def test_a_state_that_is_restored_or_deserialised_goes_on_as_it_did(native3, name):
    one, other, random = native3(name), native3(name), np.random.default_rng(4)
    one.set(RELAXED[name])
    one.start()
    changes = [random_inputs(COMPONENTS[name], random) for _ in range(40)]

    def drive(fmu, first, last):
        for n in range(first, last):
            fmu.set(changes[n])
            fmu.step(n)
        return fmu.outputs()

    drive(one, 0, 20)
    state = one.fmu.getFMUState()
    data = one.fmu.serializeFMUState(state)
    after = drive(one, 20, 40)
    assert one.get("time") == [pytest.approx(1.2)]
    one.fmu.setFMUState(state)
    assert one.get("time") == [pytest.approx(0.6)]
    assert drive(one, 20, 40) == after
    one.fmu.freeFMUState(state)
    given = other.fmu.deserializeFMUState(data)
    other.fmu.setFMUState(given)
    other.fmu.freeFMUState(given)
    assert drive(other, 20, 40) == after
    other.fmu.reset()
    other.set(RELAXED[name])
    other.start()
    drive(other, 0, 20)
    assert drive(other, 20, 40) == after


@pytest.mark.parametrize("name", TYPICAL)
def test_derivatives_are_those_of_fmi_2_and_the_adjoint_is_their_transpose(native, native3, name):
    component, random = COMPONENTS[name], np.random.default_rng(8)
    values = {**RELAXED[name], **random_inputs(component, random)}
    values |= {"encoder_counts": 0} if name == "passive_arm" else {}
    two, three = native(name), native3(name)
    for one in (two, three):
        one.set(values)
        one.start()
    inputs, outputs = ([s for s in signals if s.type == "Real"] for signals in (component.inputs, component.outputs))
    n, m = (sum(s.size for s in signals) for signals in (inputs, outputs))
    direction, weights = random.normal(size=n), random.normal(size=m)
    scalars = [[two.variables[x].valueReference for s in signals for x in s.names] for signals in (outputs, inputs)]
    arrays = [[three.variables[s.name].valueReference for s in signals] for signals in (outputs, inputs)]
    forward = three.fmu.getDirectionalDerivative(*arrays, direction, m)
    assert forward == two.fmu.getDirectionalDerivative(*scalars, direction)
    backward = three.fmu.getAdjointDerivative(*arrays, weights, n)
    assert np.dot(backward, direction) == pytest.approx(np.dot(weights, forward), rel=1e-9)
    assert np.any(forward)


def test_values_are_counted_by_element_and_set_together_or_not_at_all(native3):
    plant = native3("rov_plant")
    plant.put("u", [1.0] * 8)
    for values, reason in (([2.0] * 7, "there are 7 values; expected 8"), ([2.0] * 7 + [np.nan], r"u\[8] is nan")):
        with pytest.raises(FMICallException):
            plant.put("u", values)
        assert reason.replace("\\", "") in plant.messages[-1]
    assert plant.get("u") == [1.0] * 8
    with pytest.raises(FMICallException):
        plant.fmu.getFloat64([1])  # within u
    assert "no variable with value reference 1" in plant.messages[-1]
    plant.put("thruster.enabled", [True] * 7 + [False])
    assert plant.get("thruster.enabled") == [True] * 7 + [False]


def test_fmpy_runs_one_with_start_values_and_an_input(fmi3_fmus):
    times = np.array([0.0, 0.6])
    signals = np.zeros(2, dtype=[("time", float), ("u", float, 8)])
    signals["time"], signals["u"] = times, [0.0, 0.0, 0.0, 0.0, 5.0, 5.0, 5.0, 5.0]
    found = simulate_fmu(
        str(fmi3_fmus["rov_plant"]),
        stop_time=0.6,
        output_interval=0.03,
        start_values={"eta_0": [1.0, 2.0, 3.0, 0.0, 0.0, 0.5], "D_quadratic": "0 0 0 0 0 0"},
        input=signals,
        output=["eta", "tau"],
        validate=True,
    )
    mass = 80.0 + 56.0  # with the added mass of the default vehicle
    assert found["tau"][-1].tolist() == pytest.approx([0, 0, 20, 0, 0, 0], abs=1e-12)
    assert found["eta"][-1].tolist() == pytest.approx([1, 2, 3 + 0.5 * 20 / mass * 0.6**2, 0, 0, 0.5], rel=1e-12)


@pytest.mark.parametrize("sensor", SENSORS)
def test_terminals_of_one_name_make_the_connections_of_the_loop(fmi3_fmus, sensor):
    ends = {(name, key): {"input": [], "output": []} for name, keys in TERMINALS.items() for key in keys}
    for name in ("scenario", sensor, "adaptive_pd", "rov_plant"):
        root = etree.fromstring(archive.read(fmi3_fmus[name])["terminalsAndIcons/terminalsAndIcons.xml"])
        variables = {v.name: v for v in read_model_description(str(fmi3_fmus[name])).modelVariables}
        for terminal in root.iter("Terminal"):
            assert tuple(m.get("memberName") for m in terminal) == TERMINALS[terminal.get("name")]
            for member in terminal:
                variable = variables[member.get("variableName")]
                end = f"{element_of(name)}.{variable.name}", variable.type, variable.shape
                ends[terminal.get("name"), member.get("memberName")][variable.causality].append(end)
    pairs = [(a, b) for end in ends.values() for a in end["output"] for b in end["input"]]
    assert all(a[1:] == b[1:] for a, b in pairs)
    assert {(a[0], b[0]) for a, b in pairs} == {*connections(sensor), SET_POINT_RATE}


def exported_symbols(binary):
    return {function.name for function in binary.exported_functions}


@pytest.mark.parametrize("name", ["adaptive_pd", "rov_plant"])
def test_all_functions_of_the_standard_and_no_others_are_exported(fmi3_fmus, name):
    standard = {
        line.split()[1]
        for line in (HEADERS / "fmi3Functions.h").read_text(encoding="utf-8").splitlines()
        if line.startswith("#define fmi3") and "fmi3FullName(fmi3" in line
    }
    binary = lief.parse(list(archive.read(fmi3_fmus[name])[f"binaries/{HERE}/{name}{zig.SUFFIXES[HERE]}"]))
    assert exported_symbols(binary) == standard
    assert len(standard) > 60
    assert set(binary.libraries) <= {"libc.so.6", "libm.so.6"}


@pytest.mark.slow
def test_there_is_a_binary_for_each_platform_and_a_rebuild_gives_the_same_bytes(tmp_path):
    component, path = COMPONENTS["pid"], tmp_path / "pid.fmu"
    native_export.export(component, path, zig.TUPLES, fmi=3)
    content = archive.read(path)
    kinds = {"linux": lief.ELF.Binary, "windows": lief.PE.Binary, "darwin": lief.MachO.Binary}
    for platform in zig.TUPLES:
        binary = lief.parse(list(content[f"binaries/{platform}/pid{zig.SUFFIXES[platform]}"]))
        assert isinstance(binary, kinds[platform.split("-")[1]])
        assert ("AARCH64" in str(binary.header) or "ARM64" in str(binary.header)) == platform.startswith("aarch64")
    assert not native_export.export(component, path, zig.TUPLES, fmi=3)
    native_export.export(component, tmp_path / "again" / "pid.fmu", zig.TUPLES, fmi=3)
    assert (tmp_path / "again" / "pid.fmu").read_bytes() == path.read_bytes()
