"""FMUs of others: what they do wrong is told by element, function and time; what is theirs by right is kept."""

import csv
import os
import re
import signal
import tempfile
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

import foreign
from rov_cosim.exporters import archive
from rov_cosim.master import memory
from rov_cosim.master.apart import simulate_apart
from rov_cosim.master.exchange import gauss_seidel, jacobi
from rov_cosim.master.instances import Instances
from rov_cosim.master.memory import Memory, seen_rows
from rov_cosim.master.simulation import SimulationError, simulate
from rov_cosim.ssp import swap_map
from rov_cosim.ssp.declaration import wire
from rov_cosim.ssp.swapping import with_swaps
from rov_cosim.ssp.wiring import End, Link, WiringError
from rov_cosim.systems.catalogue import SYSTEMS
from typed import call, ok, one_line

IN_BOTH = pytest.mark.parametrize("in_numpy", [False, True])
ALONE = foreign.ANY_STEP + ' canBeInstantiatedOnlyOncePerProcess="true"'
FIXED = 'canHandleVariableCommunicationStepSize="false"'


@pytest.fixture(scope="session")
def binary():
    return foreign.library()


@pytest.fixture
def make(binary, tmp_path):
    def make_(**how):
        return foreign.write(tmp_path / f"foreign{len(list(tmp_path.iterdir()))}.fmu", binary, **how)

    return make_


def failure(wiring, run=simulate, **how):
    with pytest.raises(SimulationError) as caught:
        run(wiring, **how)
    return str(caught.value), caught.value.results


@IN_BOTH
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("words_in_step", "At 0.12 s: valve V7 stuck at 3.5 bar (fmi2DoStep: discard)."),
        ("words_in_set", "At 0.12 s: valve V7 stuck at 3.5 bar (fmi2SetReal: discard)."),
        ("words_in_get", "At 0.09 s: valve V7 stuck at 3.5 bar (fmi2GetReal: discard)."),
        ("words_in_enter", "valve V7 stuck at 3.5 bar (fmi2EnterInitializationMode: discard)."),
        ("words_in_terminate", "valve V7 stuck at 3.5 bar (fmi2Terminate: discard)."),
        ("quiet_in_step", "At 0.12 s: fmi2DoStep failed with status 2 (discard)."),
        ("pending_in_step", "At 0.12 s: fmi2DoStep failed with status 5 (pending: which is not supported)."),
        ("odd_in_step", "At 0.12 s: fmi2DoStep failed with status 77 (none of FMI's)."),
        ("nothing_in_step", "At 0.12 s: fmi2DoStep failed with status 2 (discard)."),
        ("lost_in_step", "At 0.12 s: who am I (fmi2DoStep: discard)."),
    ],
)
def test_a_failure_is_told_by_element_words_function_and_time(make, name, message, in_numpy):
    wiring = foreign.alone(make(), name)
    inputs = np.zeros(1, [("time", float), (f"{name}.u", float)])
    told, results = failure(wiring, inputs=inputs, in_numpy=in_numpy)
    assert told == f"{name}: {message}"
    ends = {"step": 0.12, "set": 0.12, "get": 0.09, "terminate": 0.3}.get(name.split("_")[-1])
    assert (results["time"][-1] if len(results) else None) == (ends and pytest.approx(ends))


def test_a_message_is_cut_where_it_floods(make):
    told, _ = failure(foreign.alone(make(), "flood_in_step"))
    assert re.fullmatch(r"flood_in_step: At 0\.12 s: x{2000,3000} \.\.\. \(fmi2DoStep: discard\)\.", told)


@IN_BOTH
def test_an_error_that_is_logged_by_a_call_that_does_not_fail_is_told_without_orders_to_the_terminal(make, in_numpy):
    told = []
    assert len(simulate(foreign.alone(make(), "report_in_step"), warn=told.append, in_numpy=in_numpy)) == 11
    assert told == ["report_in_step logged an error, though none of its calls failed: [31mthe pump is broken"]


@IN_BOTH
def test_what_does_not_settle_is_named(make, in_numpy):
    told, _ = failure(foreign.alone(make(), "drift_in_begin"), in_numpy=in_numpy)
    assert told.startswith("The initial values do not settle: drift_in_begin.far still changes, ")


def test_an_instance_that_is_not_made_is_told_with_its_words(make):
    told, results = failure(foreign.alone(make(), "words_in_instantiate"))
    assert "words_in_instantiate: " in told
    assert "valve V7 stuck at 3.5 bar" in told
    assert not len(results)


@IN_BOTH
@pytest.mark.parametrize("coupling", [jacobi, gauss_seidel])
def test_a_value_that_is_not_finite_ends_the_run_by_name_unless_it_may_be(make, coupling, in_numpy):
    wiring = foreign.alone(make(), "infinite_in_step")
    told, results = failure(wiring, coupling=coupling, in_numpy=in_numpy)
    assert told.startswith("infinite_in_step: At 0.12 s: far is inf: ")
    assert results["time"][-1] == pytest.approx(0.12)
    whole = simulate(wiring, coupling, in_numpy=in_numpy, allow_not_finite=True)
    assert np.isinf(whole["infinite_in_step.far"]).sum() == 6
    assert whole["time"][-1] == pytest.approx(0.3)


@IN_BOTH
def test_a_link_that_overflows_is_told_at_the_input(make, in_numpy):
    wiring = foreign.pair(make(), make())
    late = replace(wiring, links=(wiring.links[0]._replace(factor=1e308),), start_time=10.0, stop_time=10.3)
    told, _ = failure(late, in_numpy=in_numpy)
    assert told.startswith("b: At 10 s: u is fed inf: ")


@IN_BOTH
def test_a_fixed_step_is_kept_as_a_part_of_the_systems(make, in_numpy):
    fmu = make(flags=FIXED, experiment='stepSize="0.01"')
    results = simulate(foreign.alone(fmu), in_numpy=in_numpy)
    assert np.array_equal(results["a.n"], 3 * np.arange(11))
    assert results["a.t"] == pytest.approx(results["time"])


@IN_BOTH
@pytest.mark.parametrize("coupling", [jacobi, gauss_seidel])
def test_a_slower_fmu_steps_when_its_step_ends_and_holds_between(make, coupling, in_numpy):
    wiring = foreign.pair(make(), make(flags=FIXED, experiment='stepSize="0.09"'))
    results = simulate(replace(wiring, stop_time=0.36), coupling, in_numpy=in_numpy)
    assert np.array_equal(results["b.n"], np.arange(13) // 3)
    assert results["b.t"] == pytest.approx(0.09 * (np.arange(13) // 3))
    # What it last was fed: the time at the beginning of the system's step, or at its end.
    fed = np.where(np.arange(13) < 3, 0.0, np.arange(13) // 3 * 0.09 - (0.03 if coupling is jacobi else 0.0))
    assert results["b.y"] == pytest.approx(fed)


@pytest.mark.parametrize(
    ("step", "reason"),
    [
        ("0.02", r"the system steps by 0\.03 s: one must divide the other, as by --step 0\.02"),
        ("1e-300", r"which are 3e\+299 in the run; expected at most 1e\+07"),
        ("0.6", r"and the run from 0 s to 0\.3 s is shorter than one"),
    ],
)
def test_a_fixed_step_that_does_not_fit_is_refused_with_both(make, step, reason):
    with pytest.raises(WiringError, match=rf"a takes steps of {float(step):g} s alone .*{reason}"):
        simulate(foreign.alone(make(flags=FIXED, experiment=f'stepSize="{step}"')))


def test_a_step_that_is_no_number_is_none(make, tmp_path):
    fmu = make(flags=FIXED, experiment='stepSize="0,01"')
    told = ok("run", foreign.ssp(tmp_path / "a.ssp", fmu), "--output", tmp_path)
    assert "attribute 'stepSize': '0,01'" in told
    assert len(simulate(foreign.alone(fmu))) == 11


def test_times_too_far_from_zero_for_the_step_are_refused(make):
    far = replace(foreign.alone(make()), start_time=1e15, stop_time=1e15 + 1)
    with pytest.raises(WiringError, match=r"numbers are too coarse for steps of 0\.03 s: start nearer to 0 s"):
        simulate(far)


@IN_BOTH
def test_strings_enumerations_and_exact_outputs_are_set_and_recorded(make, in_numpy):
    results = simulate(foreign.alone(make(), file="Größe.csv", mode=2, h=2.5), in_numpy=in_numpy)
    assert set(results["a.text"]) == {"Größe.csv".encode()}
    assert set(results["a.state"]) == {2}
    assert set(results["a.h"]) == {2.5}
    long = simulate(foreign.alone(make(), file="x" * 150), in_numpy=in_numpy)
    assert long["a.text"][0] == b"x" * 64


def test_both_ways_to_step_are_equal_in_every_type_and_rate(make):
    wiring = foreign.pair(
        make(flags=FIXED, experiment='stepSize="0.015"'), make(flags=FIXED, experiment='stepSize="0.06"')
    )
    for coupling in (jacobi, gauss_seidel):
        assert simulate(wiring, coupling).tobytes() == simulate(wiring, coupling, in_numpy=True).tobytes()


@IN_BOTH
def test_a_string_lasts_until_it_is_recorded(make, in_numpy):
    results = simulate(foreign.pair(make(), make()), in_numpy=in_numpy)
    assert set(results["b.text"]) == {b""}
    wiring = foreign.pair(make(), make())
    named = replace(wiring, elements=tuple(replace(e, start_values={"file": f"of {e.name}"}) for e in wiring.elements))
    assert set(simulate(named, in_numpy=in_numpy)["b.text"]) == {b"of b"}


@pytest.mark.parametrize(("value", "fits"), [(7, True), (2**31, False), (-(2**31), False), (1.5, False)])
def test_a_constant_that_its_integer_cannot_hold_is_refused(make, tmp_path, value, fits):
    wiring, other = foreign.pair(make(), make()), make()
    wiring = replace(wiring, links=(Link(End("a", "selected"), End("b", "select")),))
    content = archive.read(other)
    text = content["modelDescription.xml"].replace(b'"selected"', b'"another"')
    archive.write(other, {**content, "modelDescription.xml": text})
    file = tmp_path / "map.toml"
    file.write_text(f"[a.constants]\nselected = {value}\n", encoding="utf-8-sig")  # as Windows' editor writes it
    if fits:
        assert with_swaps(wiring, {"a": other}, swap_map.read(file)).value("b.select") == value
        return
    with pytest.raises(WiringError, match=rf"The constant {value} is not for selected, a Integer\."):
        with_swaps(wiring, {"a": other}, swap_map.read(file))


def test_strings_are_not_handed_on(make):
    wiring = foreign.pair(make(), make())
    link = Link(End("a", "text"), End("b", "word"))
    with pytest.raises(WiringError, match="Strings are not handed on"):
        simulate(replace(wiring, links=(link,)))


@IN_BOTH
def test_a_held_input_changes_at_the_time_of_its_row(make, in_numpy):
    times = np.arange(0.0, 0.3, 0.03)
    table = np.array([(0.0, 1.0), (0.27, 2.0)], [("time", float), ("a.select", float)])
    results = simulate(foreign.alone(make()), inputs=table, in_numpy=in_numpy)
    assert results["a.selected"][1:].tolist() == [1 if n < 9 else 2 for n in range(len(times))]


@IN_BOTH
def test_inputs_follow_a_table_linear_where_they_are_continuous(make, in_numpy):
    table = np.array([(0.1, 1.0), (0.2, 3.0)], [("time", float), ("a.u", float)])
    results = simulate(foreign.alone(make()), inputs=table, in_numpy=in_numpy)
    begins = results["time"][:-1]
    assert results["a.y"][1:] == pytest.approx(np.interp(begins, [0.1, 0.2], [1.0, 3.0]))


@pytest.mark.parametrize(
    ("names", "rows", "message"),
    [
        (("time", "a.v"), [(0, 1)], r"there is no variable a\.v.*a\.u"),
        (("time", "a.y"), [(0, 1)], "a.y is a Real output; expected an input"),
        (("t", "a.u"), [(0, 1)], "first column is not `time`"),
        (("time", "a.u"), [(0, np.nan)], r"column a\.u has a value that is not a finite number"),
        (("time", "a.u"), [(1, 1), (0, 1)], "the time goes back"),
        (("time",), [(0,)], "feeds nothing"),
        (("time", "a.select"), [(0, 0.5)], r"column a\.select has a value that is no Integer"),
        (("time", "a.select"), [(0, 1e10)], r"column a\.select has a value that is no Integer"),
        (("time", "b.u"), [(0, 1)], r"b\.u is connected: its value comes from a\.t"),
    ],
)
def test_a_table_that_cannot_feed_is_refused(make, names, rows, message):
    table = np.array(rows, [(name, float) for name in names])
    with pytest.raises(WiringError, match=message):
        simulate(foreign.pair(make(), make()) if "b.u" in names else foreign.alone(make()), inputs=table)


@IN_BOTH
def test_rows_are_recorded_at_the_output_interval(fmus, in_numpy):
    wiring = replace(wire(SYSTEMS["station_keeping"], fmus), stop_time=3.05)
    every, fifth, tenth = (simulate(wiring, output_interval=i, in_numpy=in_numpy) for i in (None, 0.15, 0.1))
    assert np.array_equal(every[::5], fifth)
    first_beyond = np.ceil(np.arange(31) * 0.1 / 0.03 - 1e-9).astype(int)
    assert np.array_equal(every[first_beyond], tenth)
    with pytest.raises(WiringError, match=r"output interval is 0\.01 s; expected at least a step of 0\.03 s"):
        simulate(wiring, output_interval=0.01)


def test_another_process_sees_the_rows_of_a_run_with_any_number_of_columns(tmp_path):
    dtype = np.dtype([(f'"Größe" 😀[{i}]', np.float64) for i in range(1000)])
    Memory(tmp_path).rows(2, dtype)['"Größe" 😀[999]'] = 3.0
    assert seen_rows(tmp_path)['"Größe" 😀[999]'].tolist() == [3.0, 3.0]


def test_many_results_are_kept_in_a_file(fmus, monkeypatch):
    wiring = replace(wire(SYSTEMS["station_keeping"], fmus), stop_time=3.0)
    expected = simulate(wiring)
    monkeypatch.setattr(memory, "LARGEST", 1000)
    kept = simulate(wiring)
    assert np.array_equal(kept, expected)
    assert not kept.flags.owndata


@pytest.mark.parametrize("flags", [foreign.ANY_STEP, ALONE])
def test_a_kept_library_gives_fresh_instances_and_one_with_a_memory_is_loaded_anew(make, flags):
    wiring = foreign.alone(make(flags=flags))
    changed = foreign.alone(wiring.elements[0].fmu, h=7.0)
    with Instances(wiring) as instances:
        runs = [simulate(one, instances=instances) for one in (wiring, changed, wiring)]
    counted = [one["a.h"][0] for one in runs]
    assert counted == ([1.0, 7.0, 1.0] if flags == ALONE else [1.0, 7.0, 3.0])  # it counts its instances
    assert runs[0]["a.y"].tobytes() == runs[2]["a.y"].tobytes()


def test_repeated_runs_in_threads_are_those_of_fresh_ones(fmus):
    plain = replace(wire(SYSTEMS["station_keeping"], fmus), stop_time=6.0)
    stronger = plain.with_values({"controller.K_P.x": 120.0})

    def alternate(_):
        with Instances(plain) as instances:
            return [simulate(wiring, instances=instances) for wiring in (plain, stronger, plain, stronger)]

    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(alternate, range(2)))
    for runs in found:
        for results, wiring in zip(runs, (plain, stronger, plain, stronger), strict=True):
            assert np.array_equal(results, simulate(wiring))


@pytest.mark.parametrize(
    ("name", "message", "rows"),
    [
        ("crash_in_instantiate", "the process died of SIGSEGV in fmi2Instantiate.", 0),
        ("crash_in_step", "At 0.12 s: the process died of SIGSEGV in fmi2DoStep.", 5),
        ("crash_in_get", "At 0.09 s: the process died of SIGSEGV in fmi2GetReal.", 4),
        ("crash_in_terminate", "At 0.27 s: the process died of SIGSEGV in fmi2Terminate.", 11),
        ("crash_in_free", "At 0.27 s: the process died of SIGSEGV in fmi2FreeInstance.", 11),
        ("exit_in_step", "At 0.12 s: the process ended itself with status 3 in fmi2DoStep.", 5),
        ("abort_in_step", "At 0.12 s: the process died of SIGABRT in fmi2DoStep.", 5),
        ("overflow_in_step", "At 0.12 s: the process died of SIGSEGV in fmi2DoStep.", 5),
        ("hang_in_enter", "fmi2EnterInitializationMode does not return within 2 s.", 0),
        ("hang_in_step", "At 0.12 s: fmi2DoStep does not return within 2 s.", 5),
        ("hang_in_free", "At 0.27 s: fmi2FreeInstance does not return within 2 s.", 11),
    ],
)
@pytest.mark.skipif(os.name == "nt", reason="the names are those of POSIX signals")
def test_a_process_that_dies_in_an_fmu_is_told_and_the_results_so_far_are_kept(make, name, message, rows):
    timeout = 2.0 if name.startswith("hang") else None
    told, results = failure(foreign.alone(make(), name), simulate_apart, timeout=timeout)
    assert told == f"{name}: {message}"
    assert np.array_equal(results["time"], np.arange(rows) * 0.03)


@pytest.mark.parametrize("name", ["close_in_step", "chdir_in_setup", "warn_in_step", "fork_in_step", "a"])
def test_a_run_apart_is_the_run_here_whatever_an_fmu_does_to_its_process(make, name):
    wiring, warnings = foreign.alone(make(), name), []
    apart = simulate_apart(wiring, warn=warnings.append)
    assert len(warnings) == (6 if name.startswith("warn") else 0)
    if not name.startswith(("close", "fork")):
        assert np.array_equal(apart, simulate(wiring))
    assert np.array_equal(apart[f"{name}.n"], np.arange(11))


def test_the_command_keeps_the_results_of_an_fmu_that_crashes_or_hangs(make, tmp_path):
    for name, options, message in (
        ("crash_in_step", (), "crash_in_step: At 0.12 s: the process died of SIGSEGV in fmi2DoStep."),
        ("hang_in_step", ("--timeout", "2"), "hang_in_step: At 0.12 s: fmi2DoStep does not return within 2 s."),
    ):
        archive = foreign.ssp(tmp_path / f"{name}.ssp", make(), name)
        done = call("run", archive, "--output", tmp_path / "out", "--name", name, *options)
        assert done.exit_code == 1
        assert one_line(done).startswith(f"Error: {message} The results so far are in ")
        assert len((tmp_path / "out" / f"{name}.csv").read_text(encoding="utf-8").splitlines()) == 6


def test_the_command_sets_times_and_inputs(make, tmp_path):
    archive, table = foreign.ssp(tmp_path / "a.ssp", make()), tmp_path / "u.csv"
    table.write_text('"time","a.u"\n10,1\n10.2,3\n', encoding="utf-8-sig")  # as spreadsheets write it
    times = ("--start-time", "10", "--stop-time", "10.2", "--step", "0.05", "--output-interval", "0.1")
    ok("run", archive, *times, "--input", table, "--output", tmp_path, "--name", "a")
    with (tmp_path / "a.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["time"]) for row in rows] == pytest.approx([10.0, 10.1, 10.2])
    assert [float(row["a.y"]) for row in rows] == pytest.approx([0.0, 1.5, 2.5])
    assert [row["a.state"] for row in rows] == ["1", "1", "1"]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "(it is empty)"),
        ("time\n", "has no rows"),
        ("time,a.u\n0\n", "(line 2 has 1 cells, the head 2, parted by commas)"),
        ("time,a.u\n0,much\n", "(line 2, parted by commas: expected a number, got 'much')"),
        ("time;a.u\n0;0\n", "(line 2, parted by commas: expected a number, got '0;0')"),
        ("time,a.u\n0,1_0\n", "got '1_0'"),
        ("a.u,time\n0,0\n", "first column is not `time`"),
    ],
)
def test_a_file_that_is_no_table_is_named(make, tmp_path, text, reason):
    (tmp_path / "u.csv").write_text(text, encoding="utf-8")
    archive = foreign.ssp(tmp_path / "a.ssp", make())
    done = call("run", archive, "--input", tmp_path / "u.csv", "--output", tmp_path)
    assert done.exit_code == 1
    assert "table of inputs" in one_line(done)
    assert reason in one_line(done)


def test_texts_and_names_are_cells_of_the_csv(make, tmp_path):
    path, text = foreign.ssp(tmp_path / "a.ssp", make(), "x&quot;,y"), 'a,b "c"\nd'
    ok("run", path, "--set", f'x",y.file={text}', "--output", tmp_path, "--name", "a")
    with (tmp_path / "a.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row['x",y.text'] for row in rows] == [text] * 11


def test_what_an_fmu_prints_does_not_come_between_the_lines_of_results(make, capfd):
    assert len(simulate_apart(foreign.alone(make(), "print_in_step"))) == 11
    assert capfd.readouterr() == ("", "said by the FMU\n" * 6)


def test_an_element_of_an_inner_system_is_fed_by_its_whole_name(make):
    table = np.array([(0.0, 4.0)], [("time", float), ("inner.a.u", float)])
    assert set(simulate(foreign.alone(make(), "inner.a"), inputs=table)["inner.a.y"][1:]) == {4.0}


@IN_BOTH
def test_a_run_that_is_told_to_stop_before_its_first_step_is_no_failure(make, in_numpy):
    stopped = memory.Memory()
    stopped.watch.stop = 1
    told, results = failure(foreign.alone(make()), memory=stopped, in_numpy=in_numpy)
    assert told == "Interrupted at 0 s."
    assert len(results) == 1


@pytest.mark.parametrize("in_numpy", [False, True])
def test_ctrl_c_while_the_process_begins_is_not_lost(make, in_numpy):
    timer = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    stop_time = 3e3 if in_numpy else 3e5
    told, _ = failure(foreign.alone(make(), stop_time=stop_time), simulate_apart, in_numpy=in_numpy)
    timer.join()
    assert told.startswith("Interrupted at ")


@pytest.mark.parametrize("name", ["crash_in_step", "hang_in_step", "a"])
def test_a_run_apart_leaves_no_folder_whatever_its_end(make, name, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    fmu, before = make(), sorted(tmp_path.iterdir())
    with suppress(SimulationError):
        simulate_apart(foreign.alone(fmu, name), timeout=2.0 if name.startswith("hang") else None)
    assert sorted(tmp_path.iterdir()) == before


def test_modules_of_the_users_folder_are_not_imported(make, tmp_path, monkeypatch):
    (tmp_path / "random.py").write_text("raise SystemExit(9)", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert len(simulate_apart(foreign.alone(make()))) == 11


def test_ctrl_c_ends_a_run_apart_with_its_results(make):
    def stop(steps):
        for n in steps:
            if n == 5:
                os.kill(os.getpid(), signal.SIGINT)
            yield n

    told, results = failure(foreign.alone(make(), stop_time=3e5), simulate_apart, progress=stop, output_interval=1000.0)
    assert re.fullmatch(r"Interrupted at [\d.e+]+ s\.", told)
    assert 1 <= len(results) < 301
