"""Hosts unlike ours: single precision in time, exceptions that trap, other rounding, no denormals, ARM."""

import shutil
import subprocess
import sys
from ctypes import byref, c_bool, c_double, c_uint32, c_void_p
from pathlib import Path

import numpy as np
import pytest
from fmpy import extract, read_model_description

from raw_fmi import BEGIN, Bench
from raw_fmi3 import Bench3
from rig import Rig
from rov_cosim.components.instance import ComponentError
from rov_cosim.exporters import zig
from rov_cosim.exporters.build import components

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="these hosts are for Linux")
COMPONENTS = components()
HOST = Path(__file__).parent / "host.c"
HOUR = 120_000  # steps of 30 ms


def added(h, n):
    """Return the communication points of a host that adds its steps up, in single precision."""
    return np.concatenate([[np.float32(0)], np.add.accumulate(np.full(n - 1, h, dtype=np.float32))])


def multiplied(h, n):
    return np.arange(n, dtype=np.float32) * np.float32(h)


def rounded(h, n):
    return (np.arange(n) * h).astype(np.float32)


def ran(fmu, folder, times, h, moved, values=None):
    """Return the outputs at each 1000th step of a run in which some inputs change at each 100th."""
    one, outputs = Bench(fmu, folder), []
    for name, value in (values or {}).items():
        assert one.put({name: value}) == "ok"
    one.lead(BEGIN)
    component, now = c_void_p(one.component), (c_double * len(one.outputs))()
    for n, time in enumerate(times.tolist()):
        if n % 100 == 0:
            assert one.put({name: 0.1 * np.sin(0.01 * n + i) for i, name in enumerate(moved)}) == "ok"
        status = one.library.fmi2DoStep(component, c_double(time), c_double(h), 1)
        assert status == 0, f"step {n}: {one.messages}"
        if n % 1000 == 0:
            one.must("GetReal", one.outputs, len(now), now)
            outputs.append(np.array(now))
    return np.array(outputs)


def test_an_hour_in_single_precision_has_a_sample_in_each_step(fmus, tmp_path):
    def run(folder, times, h):
        moved = ["eta_m.x", "eta_m.psi"]
        return ran(fmus["adaptive_pd"], tmp_path / folder, times, h, moved, {"eta_m_valid": 1})

    exact = run("exact", np.arange(HOUR) * 0.03, 0.03)
    assert abs(float(added(0.03, HOUR)[-1]) - 0.03 * HOUR) > 1.0  # a clock that is fast by a second and more
    for clock, h in ((added, np.float32(0.03)), (multiplied, np.float32(0.03)), (rounded, 0.03)):
        np.testing.assert_array_equal(run(clock.__name__, clock(0.03, HOUR), float(h)), exact)


def test_a_step_that_is_a_little_longer_than_the_period_has_one_sample_too():
    rig = Rig(COMPONENTS["scenario"], {"sample_time": 0.1}).start()
    h = float(np.float32(0.1))
    for n, time in enumerate(added(0.1, 3000).tolist()):
        rig.instance.do_step(time, h)
        assert rig.instance._samples == n + 1


def test_the_vehicle_goes_by_the_steps_of_a_host_in_single_precision(fmus, tmp_path):
    def run(folder, times, h):
        return ran(fmus["rov_plant"], tmp_path / folder, times, h, ["u[1]", "u[2]", "u[5]"])

    exact = run("exact", np.arange(20_000) * 0.03, 0.03)
    single = run("single", added(0.03, 20_000), float(np.float32(0.03)))
    np.testing.assert_allclose(single, exact, rtol=1e-5, atol=1e-6)


def test_the_time_that_fmi_3_tells_is_the_hosts(fmi3_fmus, tmp_path):
    one, last = Bench3(fmi3_fmus["adaptive_pd"], tmp_path), c_double()
    one.lead(BEGIN)
    for time in added(0.03, 3000).tolist():
        one.must("DoStep", time, 0.03, 1, *[byref(c_bool())] * 3, byref(last))
        assert last.value == pytest.approx(time + 0.03, abs=1e-12)
    assert abs(time - 2999 * 0.03) > 1e-4  # the host's clock drifts
    now = (c_double * 1)()
    one.must("GetFloat64", byref(c_uint32(one.time_reference)), 1, now, 1)
    assert now[0] == last.value


@pytest.mark.slow
def test_a_whole_system_runs_for_an_hour_in_single_precision(systems, tmp_path):
    def run(folder, times, h):
        return ran(systems["station_keeping"], tmp_path / folder, times, h, ["rov_plant.current.x"])

    exact = run("exact", np.arange(HOUR) * 0.03, 0.03)
    np.testing.assert_array_equal(run("single", added(0.03, HOUR), float(np.float32(0.03))), exact)


def began(fmu, folder, start=0.0, stop=None):
    """Return both exports of a component, about to step from a start time: a bench, and a rig."""
    one, rig = Bench(fmu, folder), Rig(COMPONENTS[fmu.stem])
    one.must("SetupExperiment", 0, 0.0, start, stop is not None, stop or 0.0)
    one.must("EnterInitializationMode")
    one.must("ExitInitializationMode")
    rig.instance.set_times(start, np.inf if stop is None else stop)
    rig.instance.enter_initialization()
    rig.instance.exit_initialization()
    return one, rig


def refusal(one, rig, time, h):
    """Return what both exports say against a step, nothing if they take it."""
    status = one.step(h, time)
    try:
        rig.instance.do_step(time, h)
    except ComponentError as error:
        said = [str(error)]
    else:
        said = []
    assert (status, one.messages) == ("error" if said else "ok", said)
    return "".join(said)


@pytest.mark.parametrize("off", [-0.03, -0.01, 0.01, 0.03])
def test_a_part_of_a_step_is_no_rounding_however_late(fmus, tmp_path, off):
    both = began(fmus["adaptive_pd"], tmp_path, 6e4)
    assert not refusal(*both, 6e4 + 0.0035, 0.03)  # the spacing there is 3.9 ms
    assert "Expected the communication point 60000.0335 s" in refusal(*both, 6e4 + 0.0335 + off, 0.03)


def test_where_single_precision_cannot_tell_steps_apart_a_clock_must_have_better(fmus, tmp_path):
    both = began(fmus["adaptive_pd"], tmp_path, 1e5)
    assert "Expected the communication point 100000 s" in refusal(*both, 1e5 + 1e-4, 0.03)  # the spacing is 7.8 ms
    assert not refusal(*both, 1e5, 0.03)


@pytest.mark.parametrize("clock", [added, multiplied, rounded])
@pytest.mark.parametrize("h", [0.03, 0.1])  # the sums of which run ahead, and fall behind
def test_a_run_in_single_precision_goes_to_its_stop_time_and_no_further(fmus, tmp_path, h, clock):
    *times, last, over = clock(h, 1001).tolist()
    single, stop = float(np.float32(h)), 1000 * h
    both = began(fmus["scenario"], tmp_path, stop=stop)
    for time in times:
        assert not refusal(*both, time, single)
    assert f"expected at most the stop time {stop:.9g} s" in refusal(*both, last, single + 3e-3)
    assert not refusal(*both, last, single)
    assert f"expected at most the stop time {stop:.9g} s" in refusal(*both, over, single)
    rest = stop - over
    assert rest < 1e-4 or not refusal(*both, over, rest)  # of a host whose clock is behind


def test_a_clock_that_is_wrong_by_more_than_rounding_is_refused_early(fmus, tmp_path):
    one = Bench(fmus["adaptive_pd"], tmp_path)
    one.lead(BEGIN)
    one.step()
    assert one.step(at=0.0301) == "error"


def test_the_clock_of_the_host_is_saved_and_restored(fmus, tmp_path):
    times, h = added(0.03, 30_000)[-200:].tolist(), float(np.float32(0.03))
    one, rig = began(fmus["adaptive_pd"], tmp_path, times[0])
    for time in times[:100]:
        assert not refusal(one, rig, time, h)
    kept, saved = one.save(), rig.instance.save()
    for _ in range(2):
        assert one.restore(kept) == "ok"
        rig.instance.restore(saved)
        for time in times[100:]:
            assert not refusal(one, rig, time, h)
    assert rig.instance._samples == 200


MOVED = {"rov_plant": ["u", "current"], "adaptive_pd": ["eta_m"]}


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    """Return what compiles the host for a target, as one of a version of FMI."""
    folder = tmp_path_factory.mktemp("host")

    def compiled(target, fmi=2):
        program = folder / f"{target}-{fmi}"
        if not program.is_file():
            sources = {"host.c": HOST.read_bytes(), **zig.standard_headers(fmi)}
            program.write_bytes(zig.compiled(sources, target, "host", ["-ldl", f"-DFMI{fmi}"]))
            program.chmod(0o755)
        return program

    return compiled


def answers(host, fmu, folder, mode, platform="", before=()):
    """Return whether the host's environment was kept, what its calls answered, and the outputs as they were printed."""
    unpacked = Path(extract(fmu, folder))
    description = read_model_description(unpacked)
    fmi = description.fmiMajorVersion
    component = COMPONENTS[fmu.stem]
    variables = {v.name: v.valueReference for v in description.modelVariables}
    outputs = [s for s in component.outputs if s.type == "Real"]
    moved = [s for s in component.inputs if s.name in MOVED[fmu.stem]]

    def references(signals):
        if fmi == 3:
            return [f"{variables[s.name]}:{s.size}" for s in signals]
        return [variables[name] for s in signals for name in s.names]

    library = unpacked / "binaries" / (platform or zig.host_platform(fmi)) / f"{fmu.stem}.so"
    numbers = [variables.get("eta_m_valid", -1), len(references(outputs)), *references(outputs), *references(moved)]
    command = [*before, host, library, description.guid, mode, *numbers]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{done.returncode} {done.stdout[:300]} {done.stderr}"
    kept, codes, *rows = done.stdout.splitlines()
    return kept, [int(code) for code in codes.split()], rows


@pytest.mark.parametrize("name", MOVED)
@pytest.mark.parametrize("mode", ["trap", "flush", "upward"])
def test_what_the_host_makes_of_numbers_is_kept_and_changes_nothing(host, fmus, fmi3_fmus, tmp_path, name, mode):
    _, expected, rows = answers(host(zig.host_target()), fmus[name], tmp_path / "plain", "plain")
    assert 3 in expected  # some of the calls fail, as they are meant to
    assert expected[-1] == 0  # and the last step is fine
    assert len(set(rows)) > 100
    for fmi, fmu in ((2, fmus[name]), (3, fmi3_fmus[name])):
        program = host(zig.host_target(), fmi)
        assert answers(program, fmu, tmp_path / f"{mode}{fmi}", mode) == ("kept", expected, rows)


def numbers(rows):
    return np.array([[float.fromhex(text) for text in row.split()] for row in rows])


@pytest.mark.slow
@pytest.mark.parametrize("name", MOVED)
@pytest.mark.parametrize(("mode", "fmi"), [("plain", 2), ("flush", 2), ("upward", 2), ("plain", 3), ("upward", 3)])
def test_the_arm_binary_gives_the_same_under_qemu(host, fmus, tmp_path, name, mode, fmi):
    qemu, root = shutil.which("qemu-aarch64"), Path("/usr/aarch64-linux-gnu")
    if not qemu or not root.is_dir():
        pytest.skip("needs Debian's packages qemu-user and libc6-arm64-cross")
    from rov_cosim.exporters import native_export

    fmu = tmp_path / f"{name}.fmu"
    native_export.export(COMPONENTS[name], fmu, ["aarch64-linux"], fmi=fmi)
    (target,) = zig.TARGETS["aarch64-linux"]
    _, codes, rows = answers(host(zig.host_target()), fmus[name], tmp_path / "here", "plain")
    before = [qemu, "-L", root]
    kept, there, found = answers(host(target, fmi), fmu, tmp_path / "there", mode, "aarch64-linux", before)
    assert (kept, there) == ("kept", codes)
    np.testing.assert_allclose(numbers(found), numbers(rows), rtol=1e-12, atol=1e-12)
