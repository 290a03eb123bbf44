"""The C shell of the native FMUs: noise, derivatives, instances and threads, long runs, what it logs."""

import ctypes
import resource
import subprocess
import sys
from importlib.resources import files
from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2LastSuccessfulTime
from scipy.integrate import solve_ivp

from rig import RELAXED, Rig, random_inputs
from rov_cosim.components import noise
from rov_cosim.exporters.build import components

COMPONENTS = components()
NAMES = list(COMPONENTS)
SHELL = files("rov_cosim.exporters") / "c"


def compiled(source, folder, *options):
    """Return a file of the shell as a library of its own."""
    library = folder / "library.so"
    flags = ["-std=c99", "-O2", "-shared", "-fPIC", "-I", SHELL, "-DHIDDEN_H"]  # as if hidden.h were in: all is visible
    subprocess.run([sys.executable, "-m", "ziglang", "cc", *flags, *options, "-o", library, source, "-lm"], check=True)
    return ctypes.CDLL(str(library))


@pytest.fixture(scope="module", params=[(), ("-U__SIZEOF_INT128__",)], ids=["128 bits", "64 bits"])
def noise_library(tmp_path_factory, request):
    return compiled(SHELL / "noise.c", tmp_path_factory.mktemp("noise"), *request.param)


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


def present_outputs(name, values):
    rig = Rig(COMPONENTS[name], values)
    rig.instance.enter_initialization()
    return np.array(rig.outputs())


@pytest.mark.parametrize("phase", ["initialization", "running"])
@pytest.mark.parametrize("name", NAMES)
def test_directional_derivatives_are_those_of_difference_quotients(native, name, phase):
    component, random = COMPONENTS[name], np.random.default_rng(8)
    values = {**RELAXED[name], **random_inputs(component, random)}
    values |= {"theta_hat_0.dB": 3.0, "theta_hat_0.F_A.y": -2.0} if name == "adaptive_pd" else {}
    values |= {"integral_0.x": 3.0, "integral_0.psi": -2.0} if name == "pid" else {}
    values |= {"encoder_counts": 0} if name == "passive_arm" else {}
    values |= {"thruster_time_constant": 0.0, "thrust_max": 0.0} if name == "rov_plant" else {}
    values |= {"eta_m_valid": True, "disable": False, "thrust_max": 0.0} if "eta_m_valid" in component.u.names else {}
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


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_simulated_day_takes_no_memory_and_loses_no_time(native, name):
    one, steps = native(name), 2_880_000
    one.set({"encoder_counts": 0} if name == "passive_arm" else {})
    one.start()
    do_step = one.fmu.dll["fmi2DoStep"]
    do_step.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int]
    early = None
    for n in range(steps):
        assert do_step(one.fmu.component, n * 0.03, 0.03, 1) == 0
        if n == 1000:
            early = memory()
    assert memory() - early < 1e6
    assert one.fmu.getRealStatus(fmi2LastSuccessfulTime) == 86400.0
    if name == "passive_arm":  # each sample has its own noise: the last one is that of the last step
        draw = noise.standard_normal(
            COMPONENTS[name].p.start[list(COMPONENTS[name].p.names).index("seed")], steps - 1, 6
        )
        assert one["eta_m.x"] == pytest.approx(one["noise_std"] * draw[0], abs=1e-12)


def memory():
    """Return the resident memory of this process in bytes."""
    return int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1]) * resource.getpagesize()


def test_each_log_category_can_be_chosen(native):
    detached = {"eta.x": 9.0}

    def logged(on, *categories):
        one = native("passive_arm")
        one.fmu.setDebugLogging(on, categories)
        one.set(detached)
        one.start()
        with pytest.raises(FMICallException):
            one["L[1]"] = -1.0
        return bool(one.warnings), "L[1] is -1" in one.errors

    assert logged(True) == (True, True)
    assert logged(True, "logStatusWarning") == (True, False)
    assert logged(True, "logStatusError", "logStatusDiscard") == (False, True)
    assert logged(False) == (False, False)


def test_without_debug_logging_errors_are_told_and_warnings_are_not(native):
    one = native("passive_arm")
    one.fmu.fmi2FreeInstance(one.fmu.component)
    one.fmu.instantiate(callbacks=one.slave.log.callbacks, loggingOn=False)
    one.set({"eta.x": 9.0})
    one.start()
    assert one.warnings == []
    with pytest.raises(FMICallException):
        one["eta.x"] = np.nan
    assert "eta.x is nan" in one.errors


FOREIGN_LOCALE = r"""
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
/* As printf is in a locale whose decimal sign has two bytes. */
static int foreign(char *text, size_t size, const char *format, ...) {
    char plain[64];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(plain, sizeof plain, format, arguments);
    va_end(arguments);
    int whole = (int)strcspn(plain, ".");
    const char *rest = &plain[whole];
    return snprintf(text, size, "%.*s%s%s", whole, plain, *rest ? "\xd9\xab" : "", *rest ? rest + 1 : "");
}
#define snprintf foreign
#include "message.c"
"""


def test_numbers_in_messages_are_the_same_in_every_locale(tmp_path):
    (tmp_path / "foreign.c").write_text(FOREIGN_LOCALE, encoding="utf-8")
    number = compiled(tmp_path / "foreign.c", tmp_path).number
    number.restype, number.argtypes = ctypes.c_char_p, [ctypes.c_double, ctypes.c_int, ctypes.c_char_p]
    text = ctypes.create_string_buffer(32)
    for value in (0.5, -0.5, 80.0, 1.5e300, -1.25e-9, np.inf, -np.inf, np.nan, -np.nan):
        assert number(value, 6, text).decode() == f"{value:g}"
