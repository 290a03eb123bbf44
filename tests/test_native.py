"""The native FMUs give what the Python side gives: steps, noise, long runs, save and restore, whole systems."""

import ctypes
import subprocess
import sys
from importlib.resources import files
from threading import Thread

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException
from scipy.integrate import solve_ivp

from fmu import Fmu
from rig import Rig
from rov_cosim.components import noise
from rov_cosim.exporters.build import components
from rov_cosim.systems import ssp_reader
from rov_cosim.systems.catalogue import SYSTEMS
from rov_cosim.systems.master import simulate

COMPONENTS = components()
NAMES = list(COMPONENTS)
RELAXED = {
    "rov_plant": {"lock_roll_pitch": False, "thrust_max": 30.0, "thruster_time_constant": 0.2, "r_G.x": 0.01},
    "passive_arm": {"noise_std_angle": 0.01, "noise_correlation_time": 0.5, "stiffness": 3.0, "preload.z": 1.0},
    "adaptive_pd": {"eta_m_valid": True, "control_roll_pitch": True, "thrust_max": 8.0, "r_G.x": 0.01},
}
"""Settings that put every term of the equations to work."""


@pytest.fixture
def native(fmus, tmp_path):
    opened = []

    def open_(name):
        opened.append(Fmu(fmus[name], tmp_path / f"{name}{len(opened)}"))
        return opened[-1]

    yield open_
    for one in opened:
        one.fmu.freeInstance()


def random_inputs(component, random):
    """Return a value for each input: poses near the structure, forces of some newtons, switches mostly as they are."""
    values = {}
    for signal in component.inputs:
        for name in signal.names:
            usual = name == "eta_m_valid"
            if signal.type == "Boolean":
                values[name] = usual if random.random() > 0.05 else not usual
            else:
                values[name] = random.normal(scale=3.0 if signal.key in ("u", "F_arm") else 0.2)
    return values


def pair(native, name, values):
    """Return an FMU and a Python instance, started with the same values."""
    both = native(name), Rig(COMPONENTS[name])
    for one in both:
        one.set(values)
        one.start()
    return both


def outputs(rig):
    return [rig.get(name) for name in rig.component.y.names]


@pytest.mark.parametrize("name", NAMES)
def test_a_single_step_agrees_to_rounding_from_any_parameters(native, name):
    component, random = COMPONENTS[name], np.random.default_rng(5)
    free = [
        s for s in component.parameters if s.type == "Real" and s.key not in ("thruster_d", "sample_time", "max_step")
    ]
    for _ in range(10):
        varied = {
            n: v * random.uniform(0.9, 1.1) for s in free for n, v in zip(s.names, s.elements(s.start), strict=True)
        }
        fmu, rig = pair(native, name, {**varied, **RELAXED[name]})
        change = random_inputs(component, random)
        for one in (fmu, rig):
            one.set(change)
        fmu.step(0)
        rig.step()
        assert fmu.outputs() == pytest.approx(outputs(rig), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_a_minute_of_random_inputs_agrees_through_save_restore_and_reset(native, name):
    component = COMPONENTS[name]
    fmu, rig = pair(native, name, RELAXED[name])

    def drive(first, last, seed):
        random, worst = np.random.default_rng(seed), 0.0
        for n in range(first, last):
            if n % 10 == 0:
                change = random_inputs(component, random)
                fmu.set(change)
                rig.set(change)
            fmu.step(n)
            rig.step()
            worst = max(worst, np.abs(np.array(fmu.outputs()) - outputs(rig)).max())
        return worst

    assert drive(0, 1000, seed=1) < 1e-9
    saved, state = rig.instance.save(), fmu.fmu.getFMUstate()
    assert drive(1000, 1500, seed=2) < 1e-9
    rig.instance.restore(saved)
    fmu.fmu.setFMUstate(state)
    assert drive(1000, 2000, seed=3) < 1e-9
    fmu.fmu.freeFMUstate(state)
    fmu.fmu.reset()
    rig = Rig(component)
    for one in (fmu, rig):
        one.set(RELAXED[name])
        one.start()
    assert drive(0, 200, seed=4) < 1e-9


@pytest.fixture(scope="module")
def noise_library(tmp_path_factory):
    """Return the shell's noise generator, compiled alone."""
    source = files("rov_cosim.exporters") / "c" / "noise.c"
    library = tmp_path_factory.mktemp("noise") / "noise.so"
    flags = ["-std=c99", "-O2", "-shared", "-fPIC", "-DHIDDEN_H"]  # as if hidden.h had been included: all is visible
    subprocess.run([sys.executable, "-m", "ziglang", "cc", *flags, "-o", library, source, "-lm"], check=True)
    return ctypes.CDLL(str(library))


PLACES = [(0, 0), (1, 0), (7, 123), (2**31 - 1, 5), (12, 2**40 + 3)]


@pytest.mark.parametrize(("seed", "index"), PLACES)
def test_noise_bits_are_equal(noise_library, seed, index):
    words = (ctypes.c_uint64 * 8)()
    for block in (0, 1):
        place = ctypes.byref(words, 32 * block)
        noise_library.philox(ctypes.c_uint64(seed), ctypes.c_uint64(index), ctypes.c_uint64(1 + block), place)
    assert list(words) == np.random.Philox(key=seed, counter=index << 64).random_raw(8).tolist()


@pytest.mark.parametrize("n", [1, 2, 3, 6, 9])
def test_noise_values_are_equal_to_rounding(noise_library, n):
    draws = (ctypes.c_double * n)()
    for seed, index in [*PLACES, *((3, k) for k in range(200))]:
        noise_library.standard_normal(ctypes.c_uint64(seed), ctypes.c_uint64(index), n, draws)
        assert list(draws) == pytest.approx(noise.standard_normal(seed, index, n), rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("name", NAMES)
def test_the_descriptions_differ_only_where_fmi_demands_it(exported, name):
    one, other = (read_model_description(str(exported[export][name])) for export in exported)
    assert one.guid != other.guid  # of another description
    attributes = ["name", "valueReference", "type", "description", "causality", "variability", "initial", "start"]
    attributes += ["min", "max", "unit", "displayUnit"]
    for a, b in zip(one.modelVariables, other.modelVariables, strict=True):
        assert [getattr(a, attribute) for attribute in attributes] == [
            getattr(b, attribute) for attribute in attributes
        ]
    for a, b in zip(one.initialUnknowns, other.initialUnknowns, strict=True):
        assert [v.name for v in a.dependencies] == [v.name for v in b.dependencies]
    capabilities = {a for a in vars(type(one.coSimulation)) if a.startswith(("can", "provides", "needs", "max"))}
    differing = {a for a in capabilities if getattr(one.coSimulation, a) != getattr(other.coSimulation, a)}
    assert differing <= {"canInterpolateInputs", "providesDirectionalDerivative"}
    assert one.coSimulation.canInterpolateInputs == (name == "rov_plant")


def present_outputs(name, values):
    rig = Rig(COMPONENTS[name], values)
    rig.instance.enter_initialization()
    return np.array(outputs(rig))


@pytest.mark.parametrize("phase", ["initialization", "running"])
@pytest.mark.parametrize("name", NAMES)
def test_directional_derivatives_are_those_of_difference_quotients(native, name, phase):
    component, random = COMPONENTS[name], np.random.default_rng(8)
    values = {**RELAXED[name], **random_inputs(component, random)}
    values |= {"encoder_counts": 0} if name == "passive_arm" else {}
    values |= {"thruster_time_constant": 0.0, "thrust_max": 0.0} if name == "rov_plant" else {}
    values |= {"eta_m_valid": True, "disable": False, "thrust_max": 0.0} if name == "adaptive_pd" else {}
    inputs = [n for s in component.inputs if s.type == "Real" for n in s.names]
    reals = [n for s in component.outputs if s.type == "Real" for n in s.names]
    fmu = native(name)
    fmu.set(values)
    fmu.fmu.setupExperiment(startTime=0.0)
    fmu.fmu.enterInitializationMode()
    if phase == "running":
        fmu.fmu.exitInitializationMode()
    direction = random.normal(size=len(inputs))
    references = [[fmu.variables[n].valueReference for n in group] for group in (reals, inputs)]
    derivative = fmu.fmu.getDirectionalDerivative(*references, direction)
    step = 1e-6
    ends = [
        present_outputs(
            name, {**values, **{n: values[n] + sign * step * d for n, d in zip(inputs, direction, strict=True)}}
        )
        for sign in (1, -1)
    ]
    quotient = ((ends[0] - ends[1]) / (2 * step))[[component.y.names.index(n) for n in reals]]
    assert derivative == pytest.approx(quotient, rel=1e-6, abs=1e-6)
    assert np.abs(quotient).max() > 0.1


def test_derivatives_are_for_outputs_by_inputs_alone(native):
    fmu = native("rov_plant")
    fmu.start()
    for unknown, known, reason in (("mass", "u[1]", "mass is no output"), ("tau.X", "mass", "mass is no input")):
        with pytest.raises(FMICallException):
            fmu.fmu.getDirectionalDerivative(*([fmu.variables[n].valueReference] for n in (unknown, known)), [1.0])
        assert reason in fmu.errors
    arm = native("passive_arm")
    at_the_shoulder = {f"{signal}.{axis}": 0.0 for signal in ("attachment", "r_A") for axis in "xyz"}
    arm.set({"encoder_counts": 0, **at_the_shoulder})
    arm.start()
    with pytest.raises(FMICallException, match="discard"):
        arm.fmu.getDirectionalDerivative(*([arm.variables[n].valueReference] for n in ("reach", "eta.x")), [1.0])
    assert "reach has no finite derivative here" in arm.errors


def ramp_error(fmu, h):
    """Return how far the plant is from an accurate solution after a second of a thrust that grows steadily."""
    mass, damping = fmu["mass"] + fmu["added_mass.w"], fmu["D_quadratic.w"]
    vertical = [f"u[{i}]" for i in range(5, 9)]
    references = [fmu.variables[name].valueReference for name in vertical]
    fmu.start()
    steps = round(1.0 / h)
    for n in range(steps):
        fmu.set({name: 10.0 * n * h for name in vertical})
        fmu.fmu.setRealInputDerivatives(references, [1] * 4, [10.0] * 4)
        fmu.fmu.doStep(n * h, h)
    exact = solve_ivp(lambda t, w: (40.0 * t - damping * abs(w) * w) / mass, (0, 1), [0.0], rtol=1e-11, atol=1e-12)
    assert fmu["tau.Z"] == pytest.approx(40.0)  # of the input at the step's end
    return abs(fmu["nu.w"] - exact.y[0, -1])


def test_inputs_that_change_within_a_step_are_integrated_to_second_order(native):
    errors = []
    for max_step in (0.02, 0.01):
        fmu = native("rov_plant")
        fmu.set({"max_step": max_step})
        errors.append(ramp_error(fmu, 0.2))
    assert errors[1] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_input_derivatives_hold_for_one_step_and_are_saved(native):
    fmu = native("rov_plant")
    fmu.start()
    reference = [fmu.variables["u[5]"].valueReference]
    fmu.fmu.setRealInputDerivatives(reference, [1], [100.0])
    state = fmu.fmu.getFMUstate()
    fmu.step(0)
    once = fmu.outputs()
    assert fmu["tau.Z"] == pytest.approx(3.0)
    fmu.step(1)
    assert fmu["tau.Z"] == 0.0
    fmu.fmu.setFMUstate(state)
    fmu.step(0)
    assert fmu.outputs() == once
    fmu.fmu.freeFMUstate(state)
    for order, value, reason in ((2, 1.0, "of order 2; expected the first"), (1, np.inf, "is inf; expected a finite")):
        with pytest.raises(FMICallException):
            fmu.fmu.setRealInputDerivatives(reference, [order], [value])
        assert reason in fmu.errors


@pytest.mark.parametrize("name", NAMES)
def test_a_thousand_instances_run_side_by_side(native, name):
    one = native(name)
    handles = [one.fmu.component]
    for _ in range(1000):
        one.fmu.instantiate(loggingOn=False)
        handles.append(one.fmu.component)
    results = []
    for handle in handles:
        one.fmu.component = handle
        one.set(RELAXED[name])
        one.start()
    for n in range(3):
        for handle in handles:
            one.fmu.component = handle
            one.step(n)
    for handle in handles:
        one.fmu.component = handle
        results.append(one.outputs())
    assert results == [results[0]] * 1001
    for one.fmu.component in handles[1:]:
        one.fmu.fmi2FreeInstance(one.fmu.component)
    one.fmu.component = handles[0]


@pytest.mark.parametrize("name", NAMES)
def test_threads_that_step_different_instances_do_not_disturb_each_other(native, name):
    alone, *together = [native(name) for _ in range(3)]

    def drive(one):
        one.set(RELAXED[name])
        one.start()
        for n in range(3000):
            one.step(n)

    drive(alone)
    threads = [Thread(target=drive, args=(one,)) for one in together]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [one.outputs() for one in together] == [alone.outputs()] * 2


@pytest.mark.parametrize("name", ["station_keeping", "paper_simulation"])
def test_systems_agree_between_exports(archives, python_archives, name):
    assert_systems_agree(archives[name], python_archives[name], 9.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", SYSTEMS)
def test_whole_runs_agree_between_exports(archives, python_archives, name):
    assert_systems_agree(archives[name], python_archives[name], None)


def assert_systems_agree(native_archive, python_archive, stop):
    results = []
    for path in (native_archive, python_archive):
        with ssp_reader.opened(path) as wiring:
            results.append(simulate(wiring, stop_time=stop))
    for signal in results[0].dtype.names:
        assert np.abs(np.subtract(*(r[signal].astype(float) for r in results))).max() <= 1e-9, signal
