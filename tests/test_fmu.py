"""The exported FMUs through FMI: faults, save and restore, reset."""

import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
from fmpy import extract
from fmpy.fmi1 import FMICallException

from fmu import Fmu
from rov_cosim.exporters import archive
from rov_cosim.exporters.build import EXPORTS, components

COMPONENTS = components()
NAMES = list(COMPONENTS)


@pytest.fixture(params=EXPORTS)
def fmu(request, exported, tmp_path):
    opened = []

    def open_(name):
        opened.append(Fmu(exported[request.param][name], tmp_path / f"{name}{len(opened)}"))
        return opened[-1]

    open_.export = request.param

    yield open_
    for one in opened:
        one.fmu.freeInstance()


FAULTS = [
    ("rov_plant", {"u[3]": np.nan}, r"u[3] is nan; expected a finite number"),
    ("rov_plant", {"mass": -5.0}, "mass is -5; expected a finite number of at least 0.001"),
    ("adaptive_pd", {"epsilon_0": 2.0}, "epsilon_0 is 2; expected a finite number of at least 0 and at most 1"),
    ("passive_arm", {"seed": -1}, "seed is -1; expected a finite number of at least 0"),
    ("passive_arm", {"reach": 1.0}, "reach is an output: only inputs and parameters can be set"),
]


@pytest.mark.parametrize(("name", "values", "message"), FAULTS)
def test_a_bad_value_fails_the_call_with_the_reason_and_harms_nothing(fmu, name, values, message):
    one = fmu(name)
    for _ in range(3):  # the FMU survives its own errors
        with pytest.raises(FMICallException):
            one.set(values)
        assert message in one.errors
    one.start()
    one.step(0)


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        (
            "rov_plant",
            {"I.xx": 0.01, "I.yy": 0.01, "added_mass.p": 0.0, "r_G.z": 0.3},
            "The mass matrix is not positive definite",
        ),
        ("adaptive_pd", {f"thruster[{i}].enabled": False for i in range(5, 9)}, "The enabled thrusters cannot produce"),
    ],
)
def test_inconsistent_parameters_fail_the_initialization_with_the_reason(fmu, name, values, message):
    one = fmu(name)
    one.set(values)
    one.fmu.setupExperiment(startTime=0.0)
    one.fmu.enterInitializationMode()
    with pytest.raises(FMICallException):
        one.fmu.exitInitializationMode()
    assert message in one.errors


@pytest.mark.parametrize(
    ("time", "h", "message"),
    [
        (0.0, 0.0, "The step size is 0 s; expected a positive number"),
        (0.0, -0.03, "The step size is -0.03 s"),
        (0.0, np.nan, "The step size is nan s"),
        (7.0, 0.03, "Expected the communication point 0 s but was 7 s"),
    ],
)
def test_a_bad_step_is_refused_with_the_reason_and_the_next_good_one_works(fmu, time, h, message):
    one = fmu("rov_plant")
    one.start()
    # pythonfmu has no fmi2Error for a step, and FMPy repeats a discarded step of an FMU that does not ask for its end.
    with pytest.raises(FMICallException, match="error" if fmu.export == "native" else "discard"):
        one.fmu.doStep(time, h)
    assert message in one.errors
    one.step(0)


def test_unknown_value_references_and_wrong_types_are_refused(fmu):
    one = fmu("adaptive_pd")
    with pytest.raises(FMICallException):
        one.fmu.getReal([100000])
    assert "There is no variable with value reference 100000" in one.errors
    with pytest.raises(FMICallException):
        one.fmu.getReal([one.variables["adaptation"].valueReference])
    assert "adaptation (value reference" in one.errors
    assert "is of type Boolean, not Real" in one.errors
    with pytest.raises(FMICallException):
        one.fmu.getString([0])
    with pytest.raises(FMICallException):
        one.fmu.doStep(0.0, 0.03)
    assert "only while running; the component is instantiated" in one.errors
    one.start()
    one.step(0)


def test_a_terminated_fmu_takes_no_step(fmu):
    one = fmu("rov_plant")
    one.start()
    one.step(0)
    one.fmu.terminate()
    with pytest.raises(FMICallException):
        one.step(1)
    assert "the component is terminated" in one.errors
    assert np.isfinite(one.outputs()).all()


def test_a_detached_arm_is_logged_once_as_a_warning(fmu):
    one = fmu("passive_arm")
    one["eta.x"] = 5.0
    one.start()
    for n in range(3):
        one.step(n)
    assert len(one.warnings) == 1
    assert "The arm is detached" in one.warnings[0]
    assert one["eta_m_valid"] == 0


def drive(one, first, n):
    rows = []
    reals = [v.name for v in one.variables.values() if v.causality == "input" and v.type == "Real"]
    for k in range(first, first + n):
        for i, name in enumerate(reals):
            one[name] = 0.2 * np.sin(0.1 * k + i)
        one.step(k)
        rows.append(one.outputs())
    return rows


@pytest.mark.parametrize("name", NAMES)
def test_save_restore_serialise_and_reset_repeat_the_rest_bit_for_bit(fmu, name):
    one = fmu(name)

    def begin():
        if name == "adaptive_pd":
            one["eta_m_valid"] = True
        one.start()
        return drive(one, 0, 10)

    first = begin()
    state = one.fmu.getFMUstate()
    rest = drive(one, 10, 10)
    one.fmu.setFMUstate(state)
    assert drive(one, 10, 10) == rest
    data = one.fmu.serializeFMUstate(state)
    other = fmu(name)
    restored = other.fmu.deSerializeFMUstate(data)
    other.fmu.setFMUstate(restored)
    assert drive(other, 10, 10) == rest
    one.fmu.reset()
    assert begin() == first
    one.fmu.setFMUstate(state)
    assert drive(one, 10, 10) == rest
    for holder, held in ((one, state), (other, restored)):
        holder.fmu.freeFMUstate(held)


def test_a_broken_saved_state_is_refused_and_harms_nothing(fmu):
    one = fmu("rov_plant")
    one.start()
    with pytest.raises(FMICallException):  # pythonfmu takes any bytes, and looks at them when they are set
        one.fmu.setFMUstate(one.fmu.deSerializeFMUstate(b"nonsense"))
    assert "The saved state has 8 bytes; expected" in one.errors
    one.step(0)


def test_many_instances_run_side_by_side(fmu):
    arms = [fmu("passive_arm") for _ in range(8)]
    for i, arm in enumerate(arms):
        arm["seed"] = i // 2
        arm.start()
    for n in range(3):
        for arm in arms:
            arm.step(n)
    values = [arm["eta_m.x"] for arm in arms]
    assert values[0::2] == values[1::2]
    assert len(set(values)) == 4


def test_two_versions_of_a_pythonfmu_component_keep_apart_in_one_process(python_fmus, tmp_path):
    # As if an older build ran beside the new one: other content, so another package name inside.
    script = """
import json, sys
from pathlib import Path
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
values = []
for path in sys.argv[1:]:
    folder = extract(path)
    md = read_model_description(folder)
    fmu = FMU2Slave(guid=md.guid, unzipDirectory=folder, modelIdentifier="rov_plant", instanceName="i")
    fmu.instantiate()
    fmu.setupExperiment()
    fmu.enterInitializationMode()
    values += fmu.getReal([v.valueReference for v in md.modelVariables if v.name == "mass"])
    fmu.exitInitializationMode()
    fmu.doStep(0.0, 0.03)
print(json.dumps(values))
"""
    entries = archive.read(python_fmus["rov_plant"])
    package = entries["resources/slavemodule.txt"].decode().removesuffix("_main")
    renamed = {}
    for name, content in entries.items():
        content = content.replace(b"start=80.0", b"start=70.0") if name.endswith("vehicle.py") else content
        content = content.replace(package.encode(), b"rov_plant_0") if name.startswith("resources/rov") else content
        renamed[name.replace(package, "rov_plant_0")] = content
    renamed["resources/slavemodule.txt"] = b"rov_plant_0_main"
    old = tmp_path / "old.fmu"
    archive.write(old, renamed)
    run = subprocess.run(
        [sys.executable, "-c", script, str(python_fmus["rov_plant"]), str(old)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert json.loads(run.stdout) == [80.0, 70.0]


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
def test_the_process_ends_without_touching_freed_memory(python_fmus, tmp_path):
    # pythonfmu's exit handlers release its interpreter state twice; unmended, some runs end with a corrupted heap.
    script = """
import sys
from fmpy.fmi2 import FMU2Slave
fmu = FMU2Slave(guid="", unzipDirectory=sys.argv[1], modelIdentifier="passive_arm", instanceName="i")
fmu.instantiate()
fmu.freeInstance()
"""
    folder = extract(python_fmus["passive_arm"], tmp_path / "fmu")
    log = tmp_path / "log"
    command = ["valgrind", f"--log-file={log}", sys.executable, "-c", script, folder]
    subprocess.run(command, check=True, env={**os.environ, "PYTHONMALLOC": "malloc"})
    assert "ERROR SUMMARY" in log.read_text(encoding="utf-8")
    assert "finalizePythonInterpreter" not in log.read_text(encoding="utf-8")
