"""The master: couplings, initial values, partial results; with FMUs that this project did not make."""

import os
import signal
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from rov_cosim.exporters import archive
from rov_cosim.master.exchange import Steps, gauss_seidel, jacobi
from rov_cosim.master.in_c import in_c
from rov_cosim.master.instances import Instances
from rov_cosim.master.interrupts import deferred
from rov_cosim.master.memory import Watch
from rov_cosim.master.simulation import SimulationError, simulate
from rov_cosim.ssp import reader as ssp_reader
from rov_cosim.ssp.declaration import System, wire
from rov_cosim.ssp.wiring import End, Link, Wiring, WiringError
from rov_cosim.systems.catalogue import SYSTEMS
from rov_cosim.whole import writer as ssp_writer
from typical import distinct, typical


def chain(plain_gain, tmp_path, n=3, **parameters):
    """Return n gains in a row, each y = 2 u + 1."""
    names = [f"g{i}" for i in range(n)]
    links = tuple((f"{a}.y", f"{b}.u") for a, b in pairwise(names))
    return wire(System("chain", "", dict.fromkeys(names, "g"), links, 0.3, parameters), {"g": plain_gain})


def test_an_fmu_that_is_replaced_is_read_anew_and_else_once(fmus, tmp_path):
    fmu, system = tmp_path / "any.fmu", System("one", "", {"one": "any"}, (), 0.3)
    made = []
    for name in ("pid", "pid", "scenario"):
        if not made or made[-1].modelName != name:
            fmu.write_bytes(fmus[name].read_bytes())
        made.append(wire(system, {"any": fmu}).elements[0].description)
    assert [description.modelName for description in made] == ["pid", "pid", "scenario"]
    assert made[0] is made[1]


def test_start_values_are_set_in_their_order_a_call_for_each_stretch_of_a_type(fmus):
    values = {"K_P.x": 1.0, "K_P.y": 2.0, "integration": True, "K_P.z": 3.0}
    wiring = wire(System("one", "", {"one": "pid"}, (), 0.3, {"one": values}), fmus)
    with Instances(wiring) as instances:
        (slave,) = instances.exchange(wiring, (), lambda message: None).slaves
        called = []
        for type_ in ("Real", "Boolean"):
            setattr(slave.fmu, f"set{type_}", lambda references, values: called.append(values))
        slave.set_start_values()
    assert called == [[1.0, 2.0], [True], [3.0]]


def test_initial_values_that_never_settle_are_told(plain_gain, tmp_path):
    wiring = chain(plain_gain, tmp_path, n=2)
    loop = Wiring("loop", wiring.elements, (*wiring.links, Link(End("g1", "y"), End("g0", "u"))), 0.3, 0.03)
    with pytest.raises(SimulationError, match="The initial values do not settle"):
        simulate(loop)


def test_initial_values_travel_the_whole_chain(plain_gain, tmp_path):
    results = simulate(chain(plain_gain, tmp_path, g0={"u": 1.0}))
    assert [results[f"g{i}.y"][0] for i in range(3)] == [3.0, 7.0, 15.0]


def test_jacobi_delays_a_connection_by_a_step_and_gauss_seidel_does_not(plain_gain, tmp_path):
    wiring = chain(plain_gain, tmp_path, g0={"rate": 1.0})
    delayed, direct = simulate(wiring, jacobi), simulate(wiring, gauss_seidel)
    source = 1.0 + np.arange(11) * 0.03
    for results in (delayed, direct):
        assert results["g0.y"] == pytest.approx(source)
    assert np.array_equal(direct["g1.y"], 2 * direct["g0.y"] + 1)
    assert np.array_equal(direct["g2.y"], 2 * direct["g1.y"] + 1)
    assert np.array_equal(delayed["g1.y"][1:], 2 * delayed["g0.y"][:-1] + 1)
    assert np.array_equal(delayed["g2.y"][1:], 2 * delayed["g1.y"][:-1] + 1)


def test_time_is_a_multiple_of_the_step_and_types_are_kept(plain_gain, tmp_path):
    results = simulate(chain(plain_gain, tmp_path))
    assert np.array_equal(results["time"], np.arange(11) * 0.03)
    assert results.dtype["g0.started"] == np.bool_
    assert results["g0.started"].tolist() == [False] + [True] * 10


def test_a_failing_fmu_ends_the_run_with_the_results_so_far(plain_gain, tmp_path):
    wiring = chain(plain_gain, tmp_path, g1={"fail_at": 0.1})
    with pytest.raises(SimulationError, match="discard") as caught:
        simulate(wiring)
    assert np.array_equal(caught.value.results["time"], np.arange(4) * 0.03)
    assert caught.value.results["g0.y"][-1] == 1.0


def test_an_interrupted_run_keeps_its_results(plain_gain, tmp_path):
    def stop(steps):
        for n in steps:
            if n == 5:
                raise KeyboardInterrupt
            yield n

    with pytest.raises(SimulationError, match="Interrupted at ") as caught:
        simulate(chain(plain_gain, tmp_path), progress=stop)
    assert caught.value.results["time"][-1] >= 0.15
    assert f"at {caught.value.results['time'][-1]:g} s" in str(caught.value)


def test_the_reason_of_a_failing_component_is_in_the_error(archives):
    with ssp_reader.opened(archives["station_keeping"]) as wiring:
        wrong = wiring.with_values({"rov_plant.mass": "-1"})
        with pytest.raises(SimulationError, match=r"^rov_plant: mass is -1; expected a finite number"):
            simulate(wrong)
        inconsistent = wiring.with_values({"rov_plant.eta_0.phi": "0.2"})
        with pytest.raises(SimulationError, match="Roll and pitch are locked at zero"):
            simulate(inconsistent)


def test_warnings_of_a_component_reach_the_caller(archives):
    warnings = []
    with ssp_reader.opened(archives["station_keeping"]) as wiring:
        far = wiring.with_values({"passive_arm.attachment.x": "9"})
        results = simulate(far, stop_time=0.3, warn=warnings.append)
    assert len(warnings) == 1
    assert warnings[0].startswith("passive_arm: At 0 s: The arm is detached")
    assert not results["passive_arm.eta_m_valid"].any()


def test_any_flat_archive_runs(plain_gain, tmp_path):
    system = System("pair", "", {"a": "g", "b": "g"}, (("a.y", "b.u"),), 0.3, {"a": {"u": 4.0, "gain": 0.5}})
    path = tmp_path / "pair.ssp"
    ssp_writer.write(wire(system, {"g": plain_gain}), path)
    with ssp_reader.opened(path) as wiring:
        results = simulate(wiring)
    assert results["b.y"][-1] == 2 * (0.5 * 4.0 + 1) + 1


def test_the_start_time_is_that_of_the_experiment(fmus, tmp_path):
    wiring = wire(SYSTEMS["station_keeping"], fmus)
    early = replace(wiring, stop_time=0.3)
    late = replace(wiring, stop_time=100.3, start_time=100.0)
    a, b = simulate(early), simulate(late)
    assert b["time"] - 100.0 == pytest.approx(a["time"])
    assert b["rov_plant.eta.z"] == pytest.approx(a["rov_plant.eta.z"], abs=1e-12)


@pytest.mark.parametrize("coupling", [jacobi, gauss_seidel])
@pytest.mark.parametrize(
    "name",
    typical(distinct(SYSTEMS, "paper_simulation", "bluerov2_heavy_pid"), "station_keeping", "bluerov2_heavy_pid"),
)
def test_the_steps_in_c_are_those_in_python_to_the_last_bit(fmus, name, coupling):
    wiring = wire(SYSTEMS[name], fmus)
    assert np.array_equal(
        simulate(wiring, coupling, stop_time=3.0), simulate(wiring, coupling, stop_time=3.0, in_numpy=True)
    )


def test_the_steps_are_those_in_c_where_there_is_a_compiler(fmus):
    with Instances(wiring := wire(SYSTEMS["station_keeping"], fmus)) as instances:
        exchange = instances.exchange(wiring, (), lambda message: None)
        for coupling in (jacobi, gauss_seidel):
            assert in_c(exchange, Steps(coupling, 0.0, 0.03, True), Watch()) is not None


@pytest.mark.parametrize("in_numpy", [False, True])
def test_some_outputs_recorded_are_the_same_as_among_all(fmus, in_numpy):
    wiring = wire(SYSTEMS["station_keeping"], fmus)
    wanted = ["controller.saturated", "rov_plant.nu.r", "rov_plant.eta.x"]
    every = simulate(wiring, stop_time=3.0, in_numpy=in_numpy)
    some = simulate(wiring, stop_time=3.0, in_numpy=in_numpy, recorded=wanted)
    assert set(some.dtype.names) == {"time", *wanted}
    assert some.dtype.itemsize == 8 + 1 + 8 + 8
    assert all(np.array_equal(some[name], every[name]) for name in some.dtype.names)


def test_what_is_not_recorded_is_checked_all_the_same_in_the_order_of_the_fmu(plain_gain, tmp_path):
    wiring = chain(plain_gain, tmp_path, n=2, g0={"rate": 1e308}, g1={"rate": 1e308})
    with pytest.raises(SimulationError, match=r"y is inf"):
        simulate(replace(wiring, stop_time=30.0), recorded=())
    with Instances(wiring := wire(SYSTEMS["station_keeping"])) as instances:
        orders = []
        for recorded in (None, ["rov_plant.nu.r"]):
            exchange = instances.exchange(wiring, (), lambda message: None, recorded=recorded)
            orders.append([block.names for slave in exchange.slaves for block in slave.outputs.values()])
            instances.free()
    assert orders[0] == orders[1]


@pytest.mark.parametrize("recorded", [{"rov_plant.eta.xx"}, {"rov_plant.mass"}, "rov_plant.eta.x"])
def test_what_is_no_output_cannot_be_recorded(fmus, recorded):
    with pytest.raises(WiringError, match="There is no output "):
        simulate(wire(SYSTEMS["station_keeping"], fmus), recorded=recorded)


def test_factors_are_handed_on_in_c_as_in_python(plain_gain):
    links = (("a.y", "b.u", {"u": -2.5}), ("b.y", "c.u"))
    wiring = wire(System("three", "", dict.fromkeys("abc", "g"), links, 3.0, {"a": {"rate": 0.7}}), {"g": plain_gain})
    for coupling in (jacobi, gauss_seidel):
        in_c, in_python = simulate(wiring, coupling), simulate(wiring, coupling, in_numpy=True)
        assert np.array_equal(in_c, in_python)
        assert np.ptp(in_c["c.y"]) > 1.0


@pytest.mark.parametrize("in_numpy", [False, True])
def test_a_step_that_fails_without_a_word_is_told_by_element_call_and_time(plain_gain, in_numpy):
    wiring = wire(System("one", "", {"a": "g"}, (), 3.0, {"a": {"fail_at": 1.0}}), {"g": plain_gain})
    with pytest.raises(SimulationError) as caught:
        simulate(wiring, in_numpy=in_numpy)
    assert str(caught.value) == "a: At 0.99 s: fmi2DoStep failed with status 2 (discard)."
    assert caught.value.results["time"][-1] == pytest.approx(0.99)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_orders_to_end_wait_for_the_step(number):
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with deferred() as received:
            os.kill(os.getpid(), number)
            assert received == [number]
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), number)
    finally:
        signal.signal(signal.SIGTERM, before)


def test_a_library_that_does_not_load_leaves_the_folder_as_it_was(fmus, tmp_path, monkeypatch):
    content = archive.read(fmus["pid"])
    broken = {name: b"no library" if name.startswith("binaries/") else data for name, data in content.items()}
    archive.write(tmp_path / "broken.fmu", broken)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SimulationError, match="a: the FMU cannot be loaded"):
        simulate(wire(System("one", "", {"a": "pid"}, (), 0.3), {"pid": tmp_path / "broken.fmu"}))
    assert Path.cwd() == tmp_path
