"""The native FMUs give what the Python side gives: steps, minutes, save and restore, descriptions, whole systems."""

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2LastSuccessfulTime

from rig import RELAXED, Rig, random_inputs
from rov_cosim.components.instance import ComponentError
from rov_cosim.exporters.build import components
from rov_cosim.master.simulation import simulate
from rov_cosim.ssp import reader as ssp_reader
from typical import typical

COMPONENTS = components()
NAMES = list(COMPONENTS)
# Fewer internal steps, for they are slow in Python; still several, of which the last is shortened.
COARSE = {"rov_plant": {"max_step": 0.02}}
COARSEST = {"rov_plant": {"max_step": 0.1}}


def pair(native, name, values):
    """Return an FMU and a Python instance, started with the same values."""
    both = native(name), Rig(COMPONENTS[name])
    for one in both:
        one.set(values)
        one.start()
    return both


@pytest.mark.parametrize("name", NAMES)
def test_a_single_step_agrees_to_rounding_from_any_parameters(native, name):
    component, random = COMPONENTS[name], np.random.default_rng(5)
    free = [
        s for s in component.parameters if s.type == "Real" and s.key not in ("thruster_d", "sample_time", "max_step")
    ]
    for _ in range(10):
        varied = {
            n: min(v * random.uniform(0.9, 1.1), most)
            for s in free
            for n, v, most in zip(s.names, s.elements(s.start), s.elements(s.maximum), strict=True)
        }
        fmu, rig = pair(native, name, {**varied, **RELAXED[name]})
        change = random_inputs(component, random)
        for one in (fmu, rig):
            one.set(change)
        fmu.step(0)
        rig.step()
        assert fmu.outputs() == pytest.approx(rig.outputs(), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("start", [0.0, pytest.param(86400.0, marks=pytest.mark.slow), 1.7e9])
@pytest.mark.parametrize("name", typical(NAMES, "adaptive_pd", "rov_plant", "scenario"))
def test_both_take_and_refuse_the_same_steps(native, name, start):
    fmu, rig = native(name), Rig(COMPONENTS[name])
    for one in (fmu, rig):
        one.set(COARSEST.get(name, {}))
    fmu.fmu.setupExperiment(startTime=start, stopTime=start + 40.0)
    fmu.fmu.enterInitializationMode()
    fmu.fmu.exitInitializationMode()
    rig.instance.set_times(start, start + 40.0)
    rig.instance.enter_initialization()
    rig.instance.exit_initialization()

    def both(offset, step):
        """Take a step that begins so far from where the last one ended; tell whether it was taken."""
        time = rig.instance.time + offset
        taken = []
        for do_step, refused in ((fmu.fmu.doStep, FMICallException), (rig.instance.do_step, ComponentError)):
            try:
                do_step(time, step)
                taken.append(True)
            except refused:
                taken.append(False)
        assert taken[0] == taken[1], (offset, step)
        assert fmu.fmu.getRealStatus(fmi2LastSuccessfulTime) == rig.instance.time
        assert fmu.outputs() == pytest.approx(rig.outputs(), rel=1e-11, abs=1e-11)
        return taken[0]

    spacing = np.spacing(start)
    assert both(0.0, 0.03)
    for offset in (3 * spacing, -3 * spacing, 0.9e-9, -0.9e-9):
        assert both(offset, 0.03)
    assert not both(1e-4, 0.03)
    assert not both(-1e-4, 0.03)
    assert both(0.0, 19.9)
    assert both(15e-9, 0.03)  # a share of the time since the start
    assert both(0.0, 0.9e-9)
    assert both(0.0, 2e-9)
    rest = start + 40.0 - rig.instance.time
    assert not both(0.0, rest + 1e-3)
    assert both(0.0, rest + 1e-9)  # past the stop time by rounding
    assert not both(0.0, 0.03)


@pytest.mark.parametrize("name", typical(NAMES, "adaptive_pd", "scenario"))
def test_a_minute_of_random_inputs_agrees_through_save_restore_and_reset(native, name):
    component = COMPONENTS[name]
    values = {**RELAXED[name], **COARSE.get(name, {})}
    fmu, rig = pair(native, name, values)

    def drive(first, last, seed):
        random, worst = np.random.default_rng(seed), 0.0
        for n in range(first, last):
            if n % 10 == 0:
                change = random_inputs(component, random)
                fmu.set(change)
                rig.set(change)
            fmu.step(n)
            rig.step()
            worst = max(worst, np.abs(np.array(fmu.outputs()) - rig.outputs()).max())
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
        one.set(values)
        one.start()
    assert drive(0, 200, seed=4) < 1e-9


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


@pytest.mark.parametrize("name", typical(["paper_simulation", "bluerov2_heavy", "rexrov_pid"], "bluerov2_heavy"))
def test_systems_agree_between_exports(archives, python_archives, name):
    assert_systems_agree(archives[name], python_archives[name], 4.5)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["station_keeping", "station_keeping_pd", "paper_simulation", "paper_simulation_pd"])
def test_whole_runs_agree_between_exports(archives, python_archives, name):
    assert_systems_agree(archives[name], python_archives[name], None)


def assert_systems_agree(native_archive, python_archive, stop):
    results = []
    for path in (native_archive, python_archive):
        with ssp_reader.opened(path) as wiring:
            results.append(simulate(wiring, stop_time=stop))
    for signal in results[0].dtype.names:
        assert np.abs(np.subtract(*(r[signal].astype(float) for r in results))).max() <= 1e-9, signal
