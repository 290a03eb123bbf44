"""The check tells an import that conforms from one that does not, by its own names or by a map."""

import copy
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import foreign
import typed
from rov_cosim.components.cases import cases_of
from rov_cosim.components.interface import POSE, Signal, count
from rov_cosim.exporters import archive, native_export, zig
from rov_cosim.exporters.build import components
from rov_cosim.handover import reference, verdict
from rov_cosim.handover.check import CheckError, RunError, replay
from rov_cosim.ssp.places import Place
from rov_cosim.ssp.wiring import WiringError
from typical import typical

COMPONENTS = components()
NAMES = list(COMPONENTS)
CONTROLLER = COMPONENTS["adaptive_pd"]
SIGNALS, RUNS = CONTROLLER.y.size, len(cases_of(CONTROLLER))

pytestmark = pytest.mark.usefixtures("references")


@pytest.mark.parametrize("export", ["native", pytest.param("pythonfmu", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", typical(NAMES, "adaptive_pd", "passive_arm"))
def test_our_fmus_conform(exported, name, export):
    lines, conforms = verdict.judge(exported[export][name])
    assert conforms
    assert lines[-1].startswith(f"All {COMPONENTS[name].y.size} signals conform in ")


def wrong_controller(path, change):
    """Build a controller whose samples are changed; change is (states, outputs) from (sample, x, u, p, w)."""

    def sample(x, u, p, w):
        return change(CONTROLLER.sample, x, u, p, w)

    native_export.export(replace(CONTROLLER, sample=sample), path)
    return path


def flipped(sample, x, u, p, w):
    state, outputs = sample(x, u, p, w)
    return state, {**outputs, "disturbance": -outputs["disturbance"]}


def regained(sample, x, u, p, w):
    p = SimpleNamespace(**vars(copy.copy(p)))
    p.K_P = p.K_P * np.array([1.0, 1.0, 1.001, 1.0, 1.0, 1.0])
    return sample(x, u, p, w)


def in_degrees(sample, x, u, p, w):
    state, outputs = sample(x, u, p, w)
    return state, {**outputs, "e": outputs["e"] * np.array([1.0, 1.0, 1.0, 180 / np.pi, 180 / np.pi, 180 / np.pi])}


@pytest.mark.parametrize(
    ("change", "signal", "told"),
    [
        (flipped, "disturbance.Z", r"departs in step_response at [\d.]+ s: \S+ instead of \S+; the sign is flipped"),
        pytest.param(
            regained, "tau.Z", r"departs in step_response at 1\.0\d s: -20\.02 instead of -20$", marks=pytest.mark.slow
        ),
        pytest.param(
            in_degrees,
            "e.psi",
            r"departs in step_response at 1\.0\d s: -57\.\d+ instead of -1; it is in degrees",
            marks=pytest.mark.slow,
        ),
    ],
    ids=["sign", "gain", "unit"],
)
def test_a_wrong_controller_is_told_by_a_clear_line(tmp_path, change, signal, told):
    lines, conforms = verdict.judge(wrong_controller(tmp_path / "adaptive_pd.fmu", change))
    assert not conforms
    said = {line.split()[0]: line.split(maxsplit=1)[1] for line in lines[:-1]}
    assert re.match(told, said[signal])
    assert said["eta_dot.x"] == "conforms"
    assert re.match(rf"\d+ of {SIGNALS} signals depart", lines[-1])


def test_a_step_of_extra_delay_is_told(tmp_path):
    def late(x, u, p, w):
        state, outputs = CONTROLLER.sample(x, u, p, w)
        return {**state, "held": CONTROLLER.y.pack(outputs)}, vars(CONTROLLER.y.unpack(x.held))

    size = CONTROLLER.y.size
    delayed = replace(
        CONTROLLER,
        sample=late,
        states=(*CONTROLLER.states, Signal("held", "Outputs of the last sample", "held[{}]", (count(size),))),
        initial_state=lambda p: {**CONTROLLER.initial_state(p), "held": np.zeros(size)},
    )
    native_export.export(delayed, tmp_path / "adaptive_pd.fmu")
    lines, conforms = verdict.judge(tmp_path / "adaptive_pd.fmu")
    assert not conforms
    assert any(line.startswith("tau.Z") and line.endswith("it comes a step late") for line in lines)


def test_runs_that_fail_midway_are_compared_until_then(tmp_path):
    def failing(x, u, p, w):
        state, outputs = flipped(CONTROLLER.sample, x, u, p, w)
        return {**state, "n": x.n + 1.0}, {**outputs, "e": outputs["e"] / np.where(x.n < 4.0, 1.0, 0.0)}

    counting = replace(
        CONTROLLER,
        sample=failing,
        states=(*CONTROLLER.states, Signal("n", "Samples taken", "n")),
        initial_state=lambda p: {**CONTROLLER.initial_state(p), "n": 0.0},
    )
    native_export.export(counting, tmp_path / "adaptive_pd.fmu")
    lines, conforms = verdict.judge(tmp_path / "adaptive_pd.fmu")
    assert not conforms
    said = {line.split()[0]: line.split(maxsplit=1)[1] for line in lines[:SIGNALS]}
    assert said["disturbance.X"].endswith("; the sign is flipped")
    assert said["eta_dot.x"] == "conforms as far as the runs go"
    departed = sum(" departs in " in line for line in lines)
    assert lines[-1].startswith(f"{departed} of {SIGNALS} signals depart in {RUNS} reference runs of adaptive_pd, of w")
    assert lines[-1].endswith(f"of which {RUNS} failed.")
    assert sum(bool(re.match(r"The run .*At 0\.12 s: .*expected a finite number", line)) for line in lines) == RUNS


def renamed(fmu, path, old, new):
    """Write a copy of an FMU with another name in its description."""
    content = archive.read(fmu)
    description = content["modelDescription.xml"].replace(f'name="{old}'.encode(), f'name="{new}'.encode())
    archive.write(path, {**content, "modelDescription.xml": description})
    return path


def test_a_wrapped_fmu_with_other_names_is_checked_by_a_map(fmus, tmp_path):
    path = renamed(fmus["adaptive_pd"], tmp_path / "wrapped.fmu", "eta_m.", "sensor.position_")
    with pytest.raises(CheckError, match=r"The FMU has no variable eta_m\.x"):
        verdict.judge(path)
    lines = "".join(f'"sensor.position_{a}" = "eta_m.{a}"\n' for a in POSE)
    for section in ("controller", "adaptive_pd"):
        assert verdict.judge(path, None, typed.mapped(tmp_path, f"[{section}.variables]\n{lines}"))[1]


TURN = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
DEGREES = np.array([1.0, 1.0, 1.0, 180 / np.pi, 180 / np.pi, 180 / np.pi])
ITS = {"eta_m": "sensor_{}", "eta_d": "target_{}", "eta_m_valid": "fresh", "e": "error_{}", "thrust_max": "limit"}
ITS_MAP = "[rov_plant]\n[controller.variables]\n" + "\n".join(
    [
        'fresh = "eta_m_valid"',
        'limit = { ours = "thrust_max", unit = "kN" }',
        *(
            f'{name}_{axis} = {{ ours = "{ours}.{axis}", z_down = true{unit} }}'
            for name, ours in (("sensor", "eta_m"), ("target", "eta_d"), ("error", "e"))
            for axis, unit in zip(POSE, [""] * 3 + [', unit = "deg"'] * 3, strict=True)
        ),
    ]
)


@pytest.fixture(scope="module")
def of_another_make(tmp_path_factory):
    """Return a controller that counts z downwards, angles in degrees and the thrust in kN, under names of its own."""

    def ours(p):
        return SimpleNamespace(**{**vars(p), "thrust_max": 1e3 * p.thrust_max})

    def sample(x, u, p, w):
        u = SimpleNamespace(**vars(u))
        u.eta_m, u.eta_d = u.eta_m * TURN / DEGREES, u.eta_d * TURN / DEGREES
        state, outputs = CONTROLLER.sample(x, u, ours(p), w)
        return state, {**outputs, "e": outputs["e"] * TURN * DEGREES}

    def its(signals):
        return tuple(replace(s, pattern=ITS[s.key], unit="") if s.key in ITS else s for s in signals)

    groups = {group: its(getattr(CONTROLLER, group)) for group in ("inputs", "outputs", "parameters")}
    path = tmp_path_factory.mktemp("other") / "theirs.fmu"
    native_export.export(replace(CONTROLLER, sample=sample, requirements=(), **groups), path)
    return path


def test_an_fmu_of_another_make_conforms_by_the_map_of_its_swap(of_another_make, tmp_path):
    lines, conforms = verdict.judge(of_another_make, "adaptive_pd", typed.mapped(tmp_path, ITS_MAP))
    assert conforms, lines
    assert lines[-1] == f"All {SIGNALS} signals conform in {RUNS} reference runs of adaptive_pd."
    assert "[rov_plant] of the map is for another element: not looked at." in lines
    its = typed.mapped(tmp_path, ITS_MAP.removeprefix("[rov_plant]\n"))
    swap = ["run", "bluerov2", "--swap", f"controller={of_another_make}", "--map", its, "--stop-time", 0.3]
    done = typed.call(*swap, "--output", tmp_path)
    assert done.exit_code == 0, done.output


def test_a_wrong_sign_in_the_map_is_told_as_one(of_another_make, tmp_path):
    right, wrong = (f'error_y = {{ ours = "e.y", z_down = {word} }}' for word in ("true", "false"))
    assert right in ITS_MAP
    lines, conforms = verdict.judge(
        of_another_make, "adaptive_pd", typed.mapped(tmp_path, ITS_MAP.replace(right, wrong))
    )
    assert not conforms
    (departed,) = (line for line in lines if " departs " in line)
    assert departed.startswith("e.y ")
    assert departed.endswith("; the sign is flipped")


def test_an_angle_whose_unit_nobody_tells_is_told(of_another_make, tmp_path):
    text = ITS_MAP.replace('error_psi = { ours = "e.psi", z_down = true, unit = "deg" }', 'error_psi = "e.psi"')
    lines, conforms = verdict.judge(of_another_make, "adaptive_pd", typed.mapped(tmp_path, text))
    assert not conforms
    assert "The FMU declares no unit for error_psi: taken as rad." in lines


def test_what_the_map_leaves_out_is_told_and_does_not_fail(fmus, tmp_path):
    text = '[controller]\nwithout = ["nu_m", "disable"]\n[controller.constants]\ndisturbance = 0.0\n'
    lines, conforms = verdict.judge(fmus["adaptive_pd"], None, typed.mapped(tmp_path, text))
    assert conforms, lines
    assert "disturbance.Z".ljust(15) + "  not there, by the map" in lines
    assert "left out: disable, for which the FMU has no place for disable." in lines
    assert "left out: measured_velocity, for which the FMU has no place for nu_m.*." in lines
    those = f"{SIGNALS - 6} signals that are there"
    assert lines[-1] == f"All {those} conform in {RUNS - 2} of {RUNS} reference runs of adaptive_pd."


@pytest.mark.slow
def test_an_fmu_with_a_switch_built_in_follows_the_runs_that_leave_it_as_it_is(tmp_path):
    inputs = tuple(replace(s, start=1.0) if s.key == "eta_m_valid" else s for s in CONTROLLER.inputs)
    native_export.export(replace(CONTROLLER, inputs=inputs), tmp_path / "valid.fmu")
    text = '[controller]\nwithout = ["eta_m_valid"]\n'
    lines, conforms = verdict.judge(tmp_path / "valid.fmu", None, typed.mapped(tmp_path, text))
    assert conforms, lines
    assert "left out: loss_of_measurement, for which the FMU has no place for eta_m_valid." in lines
    assert lines[-1] == f"All {SIGNALS} signals conform in {RUNS - 3} of {RUNS} reference runs of adaptive_pd."


def test_a_parameter_without_a_place_leaves_out_the_runs_that_set_it(fmus, tmp_path):
    path = renamed(fmus["adaptive_pd"], tmp_path / "other.fmu", "thrust_max", "limit")
    lines, conforms = verdict.judge(path, None, typed.mapped(tmp_path, "[controller]\n"))
    assert conforms
    assert "left out: saturation, for which the FMU has no place for thrust_max." in lines
    assert lines[-1].startswith(f"All {SIGNALS} signals conform in {RUNS - 3} of {RUNS} ")


@pytest.mark.parametrize(
    "left_out",
    [
        '[controller]\nwithout = ["eta_m", "eta_d"]',
        "[controller.constants]\n" + "\n".join(f"{signal.key} = false" for signal in CONTROLLER.outputs),
    ],
    ids=["inputs", "outputs"],
)
def test_a_check_that_compares_nothing_does_not_pass(fmus, tmp_path, left_out):
    lines, conforms = verdict.judge(fmus["adaptive_pd"], None, typed.mapped(tmp_path, left_out))
    assert not conforms
    assert lines[-1] == "Nothing could be compared in the reference runs of adaptive_pd."
    assert not [line for line in lines if line.endswith("conforms")]


WRONG_MAPS = {
    '"eta_m.x" = "eta_m.x"': "eta_m.x stands in no section: expected [ELEMENT.variables], for example [controller.var",
    '[controller.variables]\n"eta_m.x" = "scenario.eta_d.x"': "The map feeds eta_m.x from scenario.eta_d.x, which is "
    "no variable of adaptive_pd: its reference runs have no such signal to replay.",
    '[controller.variables]\n"eta_m.x" = "eta_m.w"': "The map names eta_m.w, which is neither a variable of controller",
    "[controler]": "The map is for controler, which is not checked. Did you mean controller? In ",
    "[controller]\n[a]\n[b]": "The map is for a, which is not checked. The map is for b, which is not checked. In ",
    "[rov_plant]\n[passive_arm]": "has the sections rov_plant, passive_arm; expected [controller] or [adaptive_pd] for",
    "": "has no section; expected [controller] or [adaptive_pd] for adaptive_pd",
    '[controller.variables]\neta_m_valid = { ours = "eta_m_valid", factor = -1 }': "a Boolean takes no factor",
    '[controller.variables]\neta_m_valid = "eta_m.x"': "eta_m_valid is of type Boolean, and eta_m.x of type Real",
    '[controller.variables]\n"eta_m.x" = "eta_d.x"': "The FMU has no variable eta_m.x. Map it in [controller."
    "variables], or name it in [controller] without.",
    '[controller.variables]\n"e.x" = "e.y"': "or give it a constant in [controller.constants].",
}


@pytest.mark.parametrize("text", WRONG_MAPS)
def test_a_map_that_cannot_be_used_is_refused_with_its_reason(fmus, tmp_path, text):
    with pytest.raises((CheckError, WiringError)) as caught:
        verdict.judge(fmus["adaptive_pd"], None, typed.mapped(tmp_path, text))
    assert WRONG_MAPS[text] in str(caught.value)


@pytest.mark.slow
def test_the_commands_write_a_kit_and_check_an_fmu(fmus, tmp_path):
    done = typed.call("handover", "passive_arm", "--this-platform", "--output", tmp_path)
    assert done.exit_code == 0, done.output
    folder, zipped = map(Path, done.stdout.split())
    assert (folder / "guide.html").is_file()
    assert zipped.is_file()
    done = typed.call("handover", "check", folder / "passive_arm.fmu")
    assert (done.exit_code, done.output.splitlines()[-1]) == (0, verdict.judge(fmus["passive_arm"])[0][-1])
    done = typed.call("handover", "check", wrong_controller(tmp_path / "wrong.fmu", flipped))
    assert done.exit_code == 1
    assert "the sign is flipped" in done.output


LONG = "a" * 240


def changed(fmu, path, change):
    """Write a copy of an FMU; change is (name, data) from (name, data), or None to leave an entry out."""
    entries = [change(name, data) for name, data in archive.read(fmu).items()]
    archive.write(path, dict(entry for entry in entries if entry))
    return path


def test_what_cannot_be_checked_ends_with_a_reason(fmus, plain_gain, tmp_path):
    (tmp_path / "no.fmu").write_text("hello")
    (tmp_path / "no.toml").write_text("= 3")
    (tmp_path / "vain.toml").write_text('[controller.variables]\n"eta_m.x" = "eta_m.w"')
    (tmp_path / "long.toml").write_text(f'[controller.variables]\n"{LONG}" = "eta_m.x"')
    ours, here = fmus["adaptive_pd"], f"binaries/{zig.host_platform()}/"
    without, elsewhere, broken, named = (
        changed(ours, tmp_path / f"{i}.fmu", change)
        for i, change in enumerate(
            (
                lambda name, data: None if name.startswith("binaries/") else (name, data),
                lambda name, data: (name.replace(here, "binaries/c64x/"), data),
                lambda name, data: (name, b"no library" if name.startswith(here) else data),
                lambda name, data: (name, data.replace(b'modelName="adaptive_pd', b'modelName="' + LONG.encode())),
            )
        )
    )
    for arguments, reason in (
        ([tmp_path], "is a directory"),
        ([tmp_path / "none.fmu"], "does not exist"),
        ([tmp_path / f"{LONG}.fmu"], "does not exist"),
        ([tmp_path / "no.fmu"], "is not a readable FMU"),
        ([without], f"0.fmu has no binary for {zig.host_platform()}, which is this machine: it has none."),
        ([elsewhere], "which is this machine: it has those for c64x."),
        ([broken], "adaptive_pd: the FMU cannot be loaded: "),
        ([named], "is no component of this project"),
        ([plain_gain], "PlainGain is no component of this project"),
        ([ours, "--map", tmp_path], "is a directory"),
        ([ours, "--map", tmp_path / "no.toml"], "is not TOML"),
        ([ours, "--map", tmp_path / "no.fmu"], "is not TOML"),
        ([ours, "--map", tmp_path / "vain.toml"], "eta_m.w, which is neither a variable of controller"),
        ([ours, "--map", tmp_path / "long.toml"], f"{LONG}, which the FMU has not"),
    ):
        assert reason in typed.one_line(typed.call("handover", "check", *arguments))
    done = typed.call("handover", "check", plain_gain, "--component", "rov_plant")
    assert done.exit_code == 1
    assert done.output.startswith("Error: The FMU has no variable u[1].")


def test_a_flipped_input_that_few_runs_use_departs(tmp_path):
    def flipped_rates(sample, x, u, p, w):
        u = SimpleNamespace(**vars(u))
        u.nu_m = u.nu_m * np.array([1.0, 1.0, 1.0, -1.0, -1.0, 1.0])
        return sample(x, u, p, w)

    assert not verdict.judge(wrong_controller(tmp_path / "adaptive_pd.fmu", flipped_rates))[1]


def test_units_and_start_values_that_are_declared_otherwise_are_told(fmus, tmp_path):
    content = archive.read(fmus["adaptive_pd"])
    other = (
        content["modelDescription.xml"].replace(b'start="80.0"', b'start="8.0"', 1).replace(b'unit="N"', b'unit="kg"')
    )
    archive.write(tmp_path / "other.fmu", {**content, "modelDescription.xml": other})
    lines, conforms = verdict.judge(tmp_path / "other.fmu")
    assert not conforms
    assert "K_P.x starts at 8.0; expected 80.0." in lines
    assert "u[1] is declared in kg; expected N." in lines


def test_a_run_that_fails_leaves_the_verdict_of_the_others(fmus, tmp_path):
    content = archive.read(fmus["adaptive_pd"])
    other = content["modelDescription.xml"].replace(b'name="thrust_max"', b'name="limit"')
    archive.write(tmp_path / "other.fmu", {**content, "modelDescription.xml": other})
    lines, conforms = verdict.judge(tmp_path / "other.fmu")
    assert not conforms
    assert "The run saturation: the FMU has no variable thrust_max, which this run sets." in lines
    assert "tau.X".ljust(15) + "  conforms" in lines
    assert lines[-1].endswith(f" reference runs of adaptive_pd, of which {lines[-1].split()[-2]} failed.")


@pytest.mark.slow
def test_what_is_zero_or_a_switch_gets_no_false_explanation(tmp_path):
    def offset(sample, x, u, p, w):
        state, outputs = sample(x, u, p, w)
        return state, {**outputs, "e": outputs["e"] + 0.5, "saturated": 1.0 - outputs["saturated"]}

    lines, _ = verdict.judge(wrong_controller(tmp_path / "adaptive_pd.fmu", offset))
    departed = [line for line in lines if "departs" in line]
    assert len(departed) == 7
    assert not [line for line in departed if ";" in line]


def test_an_fmu_that_crashes_is_told_and_the_command_lives(tmp_path):
    fmu = foreign.write(tmp_path / "foreign.fmu", foreign.library())
    plain = min(cases_of(CONTROLLER), key=lambda case: len(case.parameters))
    run = reference.run(CONTROLLER, replace(plain, parameters={}))
    (crashing,) = foreign.alone(fmu, "crash_in_step").elements
    with pytest.raises(
        RunError, match=r"crash_in_step: At 0\.12 s: the process died of SIGSEGV in fmi2DoStep"
    ) as caught:
        replay(crashing, run, {CONTROLLER.y.names[0]: Place("y", 1.0)})
    assert len(caught.value.outputs[CONTROLLER.y.names[0]]) == 5  # 0 to 0.12 s
