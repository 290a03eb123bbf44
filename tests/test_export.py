"""What an exported FMU holds: description, dependencies, page, icon, licences; and that a rebuild is the same."""

import os
import re
import resource
import subprocess
import sys
from fnmatch import fnmatch
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu
from lxml import etree

from rig import Rig
from rov_cosim.components.instance import ComponentError
from rov_cosim.components.interface import Component, Sampled
from rov_cosim.components.vehicle import FORCES
from rov_cosim.exporters import archive, native_export, pythonfmu_export
from rov_cosim.exporters.build import EXPORTS, build_fmus, components, fmu_path
from rov_cosim.exporters.zig import host_platform
from typical import typical

COMPONENTS = components()
NAMES = list(COMPONENTS)
IGNORED = (Path(__file__).parent.parent / ".gitignore").read_text(encoding="utf-8").splitlines()


def number(literal):
    """Return the value of a start literal."""
    return {"true": 1.0, "false": 0.0}[literal] if literal in ("true", "false") else float(literal)


EXPORTERS = {"native": native_export.export, "pythonfmu": pythonfmu_export.export}


@pytest.mark.parametrize("export", EXPORTS)
@pytest.mark.parametrize("name", NAMES)
def test_fmpy_finds_no_problem(exported, name, export):
    assert validate_fmu(str(exported[export][name])) == []


@pytest.mark.parametrize("export", EXPORTS)
@pytest.mark.parametrize("name", typical(NAMES, "passive_arm"))
def test_building_twice_gives_the_same_bytes(name, export, tmp_path):
    paths = [tmp_path / folder / f"{name}.fmu" for folder in ("one", "another")]
    assert [EXPORTERS[export](COMPONENTS[name], path) for path in paths] == [True, True]
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert not EXPORTERS[export](COMPONENTS[name], paths[0])


@pytest.mark.parametrize("export", typical(EXPORTERS, "pythonfmu"))
def test_an_fmu_is_the_same_in_a_locale_without_utf_8(export, tmp_path):
    script = """
import locale, sys, warnings
from pathlib import Path
assert locale.getpreferredencoding() != "UTF-8"
warnings.filterwarnings("error", category=EncodingWarning, module="rov_cosim")
from rov_cosim.exporters.build import build_fmus
build_fmus(Path(sys.argv[1]), sys.argv[2], names=["pid"])
"""
    environment = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    command = [sys.executable, "-X", "warn_default_encoding", "-c", script, tmp_path, export]
    subprocess.run(command, env=environment, check=True, stderr=subprocess.DEVNULL)
    here = tmp_path / "pid.fmu"
    EXPORTERS[export](COMPONENTS["pid"], here)
    assert fmu_path(tmp_path, "pid", export).read_bytes() == here.read_bytes()


def test_a_build_tells_what_begins_and_makes_what_was_asked_for(tmp_path):
    told = []
    path = fmu_path(tmp_path, "pid")
    assert build_fmus(tmp_path, names=["pid"], progress=told.append) == {path: True}
    assert told == ["tracing pid", f"compiling pid for {host_platform()}"]
    assert list(path.parent.glob("*.fmu")) == [path]
    assert build_fmus(tmp_path, names=["pid"], progress=told.append) == {path: False}
    assert len(told) == 2


def test_an_archive_that_is_broken_or_outdated_is_written_anew(tmp_path):
    path = tmp_path / "a.zip"
    path.write_bytes(b"broken")
    assert archive.write(path, {"a": b"1"})
    assert not archive.write(path, {"a": b"1"})
    assert archive.write(path, {"a": b"2"})
    assert archive.read(path) == {"a": b"2"}


def test_what_a_killed_build_left_goes_with_the_next_and_what_another_build_writes_stays(tmp_path):
    killed = """
import os, sys
from pathlib import Path
from rov_cosim.exporters import archive
os.fdopen = lambda *_: os.kill(os.getpid(), 9)
archive.write(Path(sys.argv[1]), {"a": b"1"})
"""
    path = tmp_path / "a[1].zip"
    for _ in range(2):
        subprocess.run([sys.executable, "-c", killed, path], check=False)
    left, at_work = tmp_path.iterdir()
    assert left.name.startswith(".a[1].zip.")
    assert fnmatch(left.name, next(line for line in IGNORED if line.endswith(".part")))
    os.utime(left, (0, 0))
    assert archive.write(path, {"a": b"1"})
    assert set(tmp_path.iterdir()) == {path, at_work}


def test_an_archive_that_cannot_be_written_is_named_with_the_reason_and_nothing_is_left(tmp_path):
    folder = tmp_path / "a.fmu"
    folder.mkdir()
    with pytest.raises(OSError, match=rf"^{re.escape(str(folder))} is a folder, where a file belongs; remove it$"):
        archive.write(folder, {"a": b"1"})
    folder.rmdir()
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10, limit[1]))  # a full disk, in small
    try:
        with pytest.raises(OSError, match=rf"^{re.escape(str(folder))} cannot be written: File too large$"):
            archive.write(folder, {"a": b"1"})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    assert list(tmp_path.iterdir()) == []
    folder.write_bytes(b"a file")
    with pytest.raises(OSError, match=re.escape(str(folder))):
        archive.write(folder / "b.fmu", {"a": b"1"})


@pytest.mark.parametrize("name", NAMES)
def test_the_description_says_what_the_interface_declares(fmus, name):
    component: Component = COMPONENTS[name]
    description = read_model_description(str(fmus[name]))
    variables = {v.name: v for v in description.modelVariables}
    for signals, causality in (
        (component.inputs, "input"),
        (component.outputs, "output"),
        (component.parameters, "parameter"),
    ):
        for signal in signals:
            for i, scalar in enumerate(signal.names):
                variable = variables.pop(scalar)
                assert (variable.causality, variable.type) == (causality, signal.type)
                assert (variable.unit or "") == signal.units[i]
                assert variable.description
                if causality != "output":
                    assert number(variable.start) == signal.elements(signal.start)[i]
                for limit, declared in ((variable.min, signal.minimum), (variable.max, signal.maximum)):
                    bound = signal.elements(declared)[i]
                    assert (limit is None) == (signal.type == "Boolean" or not np.isfinite(bound))
                    assert limit is None or float(limit) == bound
                if causality == "output":
                    discrete = signal.type != "Real" or isinstance(component, Sampled)
                    assert variable.variability == ("discrete" if discrete else "continuous")
                if causality == "parameter":
                    assert variable.variability == ("tunable" if signal.tunable else "fixed")
    assert variables == {}
    assert [v.valueReference for v in description.modelVariables] == list(range(len(description.modelVariables)))
    simulation = description.coSimulation
    assert simulation.modelIdentifier == description.modelName == name
    assert simulation.canGetAndSetFMUstate
    assert simulation.canSerializeFMUstate
    assert simulation.canHandleVariableCommunicationStepSize
    assert not simulation.needsExecutionTool
    assert description.variableNamingConvention == "structured"
    assert description.generationDateAndTime.endswith("Z")
    experiment = description.defaultExperiment
    assert [float(t) for t in (experiment.startTime, experiment.stopTime, experiment.stepSize)] == [0.0, 60.0, 0.03]
    assert all(unknown.dependencies == [] for unknown in description.outputs)
    angle = next(unit for unit in description.unitDefinitions if unit.name == "rad")
    assert angle.baseUnit.rad == 1
    assert float(angle.displayUnits[0].factor) == pytest.approx(180 / np.pi)


@pytest.mark.parametrize("name", NAMES)
def test_no_initial_output_follows_a_variable_that_its_dependencies_leave_out(fmus, name):
    component = COMPONENTS[name]
    description = read_model_description(str(fmus[name]))
    declared = {u.variable.name: {v.name for v in u.dependencies} for u in description.initialUnknowns}
    # Everything at work: away from zero, noisy, limited, free in roll and pitch.
    lively = {v.name: 0.1 for v in description.modelVariables if v.causality == "input" and v.type == "Real"}
    lively |= {n: v for n, v in LIVELY.items() if n in component.u.names + component.p.names}

    def initial(**changed):
        rig = Rig(component, {**lively, **changed})
        rig.instance.enter_initialization()
        return {output: rig.get(output) for output in declared}

    before = initial()
    assert any(before.values())
    for variable in [v for v in description.modelVariables if v.causality != "output"]:
        now = lively.get(variable.name, number(variable.start))
        other = (
            1.0 - now if variable.type == "Boolean" else now + 1 if variable.type == "Integer" else now * 0.99 + 1e-3
        )
        if variable.name.startswith("thruster") and ".d." in variable.name:
            continue  # a direction cannot change alone; it goes with thruster[i].r
        try:
            after = initial(**{variable.name: other})
        except ComponentError:
            continue  # not a legal value, so no dependency to find
        followed = {output for output in declared if after[output] != before[output]}
        assert all(variable.name in declared[output] for output in followed), (variable.name, followed)


LIVELY = {
    "lock_roll_pitch": 0,
    "thrust_max": 2.0,
    "eta_m_valid": 1,
    "control_roll_pitch": 1,
    "use_measured_velocity": 1,
    "noise_std_angle": 0.01,
    "noise_correlation_time": 1.0,
    "stiffness": 3.0,
    "r_G.x": 0.02,
    **{f"theta_hat_0.{force}": 2.0 for force in FORCES},
}


@pytest.mark.parametrize("export", EXPORTS)
@pytest.mark.parametrize("name", NAMES)
def test_the_archive_holds_page_icon_and_licences(exported, name, export):
    entries = archive.read(exported[export][name])
    assert entries["model.png"].startswith(b"\x89PNG")
    packages = {"native": {"rov-cosim"}, "pythonfmu": {"rov-cosim", "pythonfmu"}}[export]
    assert {f"documentation/licenses/{package}.txt" for package in packages} <= set(entries)
    page = entries["documentation/index.html"]
    root = etree.fromstring(page, etree.HTMLParser(recover=False, huge_tree=True, encoding="utf-8"))
    assert len(root.findall(".//math")) > 5
    assert "$" not in "".join(root.itertext())
    inside = [link.get("href") for link in root.iter("a") if ":" not in link.get("href")]
    assert inside == [f"#{heading.get('id')}" for heading in root.iter("h2")]  # the contents; none into the project
    assert " in equations.py" in "".join(root.itertext())  # their text stays
    for heading in ("Inputs", "Outputs", "Parameters", "Frames and signs"):
        assert any(heading == h.text for h in root.iter("h2"))


@pytest.mark.parametrize("name", NAMES)
def test_the_modules_inside_a_pythonfmu_fmu_are_named_after_the_component(python_fmus, name):
    # All FMUs of a process share the names of their modules.
    entries = archive.read(python_fmus[name])
    assert entries["resources/slavemodule.txt"].decode().startswith(f"{name}_")
    modules = [n for n in entries if n.startswith("resources/") and n.endswith(".py") and "/pythonfmu/" not in n]
    assert all(module.split("/")[1].startswith(f"{name}_") for module in modules)


@pytest.mark.parametrize("name", NAMES)
def test_there_is_no_python_in_a_native_fmu(fmus, name):
    entries = archive.read(fmus[name])
    assert not [entry for entry in entries if entry.endswith((".py", ".txt")) and entry.startswith("resources/")]
    listed = etree.fromstring(entries["modelDescription.xml"]).findall("CoSimulation/SourceFiles/File")
    assert {f"sources/{file.get('name')}" for file in listed} == {n for n in entries if n.endswith(".c")}
