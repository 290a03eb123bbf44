"""The kit holds what its guide promises, and the check tells a conforming import from one that is not."""

import copy
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.ssp.ssd import read_ssv
from fmpy.util import read_csv
from lxml import etree

import typed
from rov_cosim.components.cases import cases_of
from rov_cosim.components.interface import POSE, Signal, count
from rov_cosim.exporters import archive, native_export, zig
from rov_cosim.exporters.build import components
from rov_cosim.handover import kit, verdict
from rov_cosim.handover.check import CheckError
from rov_cosim.ssp import swap_map
from rov_cosim.ssp.wiring import WiringError
from rov_cosim.systems.catalogue import SYSTEMS

COMPONENTS = components()
NAMES = list(COMPONENTS)
CONTROLLER = COMPONENTS["adaptive_pd"]


@pytest.fixture(scope="module")
def kits(tmp_path_factory) -> dict[str, Path]:
    """Return the kits' folders by component, with binaries for this machine."""
    folder = tmp_path_factory.mktemp("kits")
    return {name: kit.write(component, folder, [zig.host_platform()])[0] for name, component in COMPONENTS.items()}


@pytest.mark.parametrize("name", NAMES)
def test_the_kit_holds_what_its_guide_promises(kits, name):
    folder = kits[name]
    guide = (folder / "guide.md").read_text()
    for target in re.findall(r"\]\(([^):]+)\)", guide):
        assert (folder / target).exists(), target
    assert "{" not in re.sub(r"```toml.*?```|'\{[0-9a-f-]+\}'|\$.*?\$|\\.*", "", guide, flags=re.S).replace("{...}", "")
    for quoted in re.findall(r"^\| ((?:`[^`]+`(?:, )?)+) \|", guide.split("## Wire it")[0], re.M):
        for pattern in re.findall(r"`([^`]+)`", quoted):
            assert list(folder.glob(pattern.rstrip("/"))), pattern
    for page in ("guide.md", "guide.html", "wiring.svg"):
        text = (folder / page).read_text(encoding="utf-8")
        for signal in COMPONENTS[name].inputs + COMPONENTS[name].outputs:
            assert signal.key in text
    etree.fromstring((folder / "wiring.svg").read_bytes())
    names = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert set(archive.read(folder.with_name(f"{folder.name}.zip"))) == {f"{folder.name}/{n}" for n in names}


def test_the_long_steps_of_a_kit_are_told_as_they_come(tmp_path):
    told = []

    def progress(steps, what):
        for step in steps:
            told.append(f"{what} {step}")
            yield step

    kit.write(COMPONENTS["scenario"], tmp_path, [zig.host_platform()], progress)
    runs = [f"reference run {case.name}" for case in cases_of(COMPONENTS["scenario"])]
    assert told == [f"binary {zig.host_platform()}", *runs]


@pytest.mark.parametrize("name", NAMES)
def test_references_are_in_the_form_of_the_cross_check(kits, name):
    schema = etree.XMLSchema(file=str(files("fmpy.ssp") / "schema" / "SystemStructureParameterValues.xsd"))
    for case in cases_of(COMPONENTS[name]):
        folder = kits[name] / "reference" / case.name
        inputs, outputs = (read_csv(folder / f"{name}_{suffix}.csv") for suffix in ("in", "ref"))
        assert inputs.dtype.names == ("time", *COMPONENTS[name].u.names)
        assert outputs.dtype.names == ("time", *COMPONENTS[name].y.names)
        options = dict(
            line.split(", ") for line in (folder / f"{name}_ref.opt").read_text(encoding="utf-8").splitlines()
        )
        assert float(options["StopTime"]) == outputs["time"][-1] == inputs["time"][-1]
        assert np.diff(outputs["time"]) == pytest.approx(float(options["StepSize"]))
        assert (folder / f"{name}.ssv").exists() == bool(case.parameters)
    for path in kits[name].rglob("*.ssv"):
        assert schema.validate(etree.parse(path))


@pytest.mark.parametrize("export", ["native", "pythonfmu"])
@pytest.mark.parametrize("name", NAMES)
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
        (regained, "tau.Z", r"departs in step_response at 1\.0\d s: -20\.02 instead of -20$"),
        (in_degrees, "e.psi", r"departs in step_response at 1\.0\d s: -57\.\d+ instead of -1; it is in degrees"),
    ],
    ids=["sign", "gain", "unit"],
)
def test_a_wrong_controller_is_told_by_a_clear_line(tmp_path, change, signal, told):
    lines, conforms = verdict.judge(wrong_controller(tmp_path / "adaptive_pd.fmu", change))
    assert not conforms
    said = {line.split()[0]: line.split(maxsplit=1)[1] for line in lines[:-1]}
    assert re.match(told, said[signal])
    assert said["eta_dot.x"] == "conforms"
    assert re.match(r"\d+ of 40 signals depart", lines[-1])


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


def renamed(fmu, path, old, new):
    """Write a copy of an FMU with another name in its description."""
    content = archive.read(fmu)
    description = content["modelDescription.xml"].replace(f'name="{old}'.encode(), f'name="{new}'.encode())
    archive.write(path, {**content, "modelDescription.xml": description})
    return path


def mapped(tmp_path, text):
    path = tmp_path / "map.toml"
    path.write_text(text)
    return path


def test_a_wrapped_fmu_with_other_names_is_checked_by_a_map(fmus, tmp_path):
    path = renamed(fmus["adaptive_pd"], tmp_path / "wrapped.fmu", "eta_m.", "sensor.position_")
    with pytest.raises(CheckError, match=r"The FMU has no variable eta_m\.x"):
        verdict.judge(path)
    lines = "".join(f'"sensor.position_{a}" = "eta_m.{a}"\n' for a in POSE)
    for section in ("controller", "adaptive_pd", "mine"):
        assert verdict.judge(path, None, mapped(tmp_path, f"[{section}.variables]\n{lines}"))[1]


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
    lines, conforms = verdict.judge(of_another_make, "adaptive_pd", mapped(tmp_path, ITS_MAP))
    assert conforms, lines
    assert lines[-1] == "All 40 signals conform in 9 reference runs of adaptive_pd."
    its = mapped(tmp_path, ITS_MAP.removeprefix("[rov_plant]\n"))
    swap = ["run", "bluerov2", "--swap", f"controller={of_another_make}", "--map", its, "--stop-time", 0.3]
    done = typed.call(*swap, "--output", tmp_path)
    assert done.exit_code == 0, done.output


def test_a_wrong_sign_in_the_map_is_told_as_one(of_another_make, tmp_path):
    right, wrong = (f'error_y = {{ ours = "e.y", z_down = {word} }}' for word in ("true", "false"))
    assert right in ITS_MAP
    lines, conforms = verdict.judge(of_another_make, "adaptive_pd", mapped(tmp_path, ITS_MAP.replace(right, wrong)))
    assert not conforms
    (departed,) = (line for line in lines if " departs " in line)
    assert departed.startswith("e.y ")
    assert departed.endswith("; the sign is flipped")


def test_an_angle_whose_unit_nobody_tells_is_told(of_another_make, tmp_path):
    text = ITS_MAP.replace('error_psi = { ours = "e.psi", z_down = true, unit = "deg" }', 'error_psi = "e.psi"')
    lines, conforms = verdict.judge(of_another_make, "adaptive_pd", mapped(tmp_path, text))
    assert not conforms
    assert "The FMU declares no unit for error_psi: taken as rad." in lines


def test_what_the_map_leaves_out_is_told_and_does_not_fail(fmus, tmp_path):
    text = '[controller]\nwithout = ["nu_m", "disable"]\n[controller.constants]\ndisturbance = 0.0\n'
    lines, conforms = verdict.judge(fmus["adaptive_pd"], None, mapped(tmp_path, text))
    assert conforms, lines
    assert "disturbance.Z".ljust(15) + "  not there, by the map" in lines
    assert "left out: disable, for which the FMU has no place for disable." in lines
    assert "left out: measured_velocity, for which the FMU has no place for nu_m.*." in lines
    assert lines[-1] == "All 34 signals that are there conform in 7 of 9 reference runs of adaptive_pd."


def test_an_fmu_with_a_switch_built_in_follows_the_runs_that_leave_it_as_it_is(tmp_path):
    inputs = tuple(replace(s, start=1.0) if s.key == "eta_m_valid" else s for s in CONTROLLER.inputs)
    native_export.export(replace(CONTROLLER, inputs=inputs), tmp_path / "valid.fmu")
    text = '[controller]\nwithout = ["eta_m_valid"]\n'
    lines, conforms = verdict.judge(tmp_path / "valid.fmu", None, mapped(tmp_path, text))
    assert conforms, lines
    assert "left out: loss_of_measurement, for which the FMU has no place for eta_m_valid." in lines
    assert lines[-1] == "All 40 signals conform in 8 of 9 reference runs of adaptive_pd."


def test_a_parameter_without_a_place_leaves_out_the_runs_that_set_it(fmus, tmp_path):
    path = renamed(fmus["adaptive_pd"], tmp_path / "other.fmu", "thrust_max", "limit")
    lines, conforms = verdict.judge(path, None, mapped(tmp_path, "[controller]\n"))
    assert conforms
    assert "left out: saturation, for which the FMU has no place for thrust_max." in lines
    assert lines[-1].startswith("All 40 signals conform in 7 of 9 ")


@pytest.mark.parametrize(
    "left_out",
    [
        '[controller]\nwithout = ["eta_m", "eta_d"]',
        "[controller.constants]\n" + "\n".join(f"{signal.key} = false" for signal in CONTROLLER.outputs),
    ],
    ids=["inputs", "outputs"],
)
def test_a_check_that_compares_nothing_does_not_pass(fmus, tmp_path, left_out):
    lines, conforms = verdict.judge(fmus["adaptive_pd"], None, mapped(tmp_path, left_out))
    assert not conforms
    assert lines[-1] == "Nothing could be compared in the reference runs of adaptive_pd."
    assert not [line for line in lines if line.endswith("conforms")]


WRONG_MAPS = {
    '"eta_m.x" = "eta_m.x"': "eta_m.x stands in no section: expected [ELEMENT.variables], for example [controller.var",
    '[controller.variables]\n"eta_m.x" = "scenario.eta_d.x"': "The map feeds eta_m.x from scenario.eta_d.x, which is "
    "no variable of adaptive_pd: its reference runs have no such signal to replay.",
    '[controller.variables]\n"eta_m.x" = "eta_m.w"': "The map names eta_m.w, which is neither a variable of controller",
    "[a]\n[b]": "has the sections a, b; expected [controller] or [adaptive_pd] for adaptive_pd",
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
        verdict.judge(fmus["adaptive_pd"], None, mapped(tmp_path, text))
    assert WRONG_MAPS[text] in str(caught.value)


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


def one_line(done):
    """Return what a command that failed says, which is a line, after click's own about the usage."""
    assert done.exit_code in (1, 2)
    assert isinstance(done.exception, SystemExit)
    (line,) = (text for text in done.output.splitlines() if text and not text.startswith(("Usage: ", "Try ")))
    return line


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
        ([broken], "The FMU cannot be loaded: "),
        ([named], "is no component of this project"),
        ([plain_gain], "PlainGain is no component of this project"),
        ([ours, "--map", tmp_path], "is a directory"),
        ([ours, "--map", tmp_path / "no.toml"], "is not TOML"),
        ([ours, "--map", tmp_path / "no.fmu"], "is not TOML"),
        ([ours, "--map", tmp_path / "vain.toml"], "eta_m.w, which is neither a variable of controller"),
        ([ours, "--map", tmp_path / "long.toml"], f"{LONG}, which the FMU has not"),
    ):
        assert reason in one_line(typed.call("handover", "check", *arguments))
    done = typed.call("handover", "check", plain_gain, "--component", "rov_plant")
    assert done.exit_code == 1
    assert done.output.startswith("Error: The FMU has no variable u[1].")


def test_a_kit_that_cannot_be_written_ends_with_a_reason(tmp_path):
    (tmp_path / "file").write_text("")
    for folder, reason in (
        ("/proc/none", "/proc/none"),
        (tmp_path / "file", "is a file"),
        (tmp_path / "file" / "below", "Not a directory"),
        (tmp_path / (LONG + LONG), "File name too long"),
    ):
        assert reason in one_line(typed.call("handover", "scenario", "--this-platform", "--output", folder))


@pytest.mark.parametrize("name", NAMES)
def test_the_guides_map_is_one(kits, fmus, tmp_path, name):
    """It is applied to an FMU whose variables have the names that the guide makes up."""
    (text,) = re.findall(r"```toml\n(.*?)```", (kits[name] / "guide.md").read_text(), re.S)
    (maps,) = swap_map.read(mapped(tmp_path, text)).values()
    content = archive.read(fmus[name])
    description = content["modelDescription.xml"].decode()
    for theirs, entry in maps.variables.items():
        description = re.sub(rf'name="{re.escape(entry.ours)}(?=["\[.])', f'name="{theirs}', description)
    archive.write(tmp_path / "theirs.fmu", {**content, "modelDescription.xml": description.encode()})
    text = text.replace(', z_down = true, unit = "deg"', "")
    lines, conforms = verdict.judge(tmp_path / "theirs.fmu", None, mapped(tmp_path, text))
    assert conforms, lines


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")
@pytest.mark.parametrize("name", NAMES)
def test_the_guides_commands_for_the_c_host_reproduce_the_reference(kits, name):
    guide = (kits[name] / "guide.md").read_text(encoding="utf-8")
    block = re.search(r"```sh\n(unzip.*?)```", guide, re.S).group(1)
    for case in cases_of(COMPONENTS[name]):
        commands = block.replace(f"reference/{cases_of(COMPONENTS[name])[0].name}/", f"reference/{case.name}/")
        commands = commands.replace("unzip -q", "unzip -qo")
        done = subprocess.run(["sh", "-ec", commands], cwd=kits[name], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        assert float(re.search(r"largest deviation (\S+)", done.stdout).group(1)) < 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_the_guides_script_for_ecos_reproduces_the_reference(kits, name):
    if find_spec("ecospy") is None:
        pytest.skip("ecospy is not installed; it is part of the test extra on Linux")
    guide = (kits[name] / "guide.md").read_text(encoding="utf-8")
    script, first = re.search(r"python (replay_ecos\.py) (\S+)", guide).groups()
    for run in (first, "reference/every_parameter"):
        command = [sys.executable, script, run]
        done = subprocess.run(command, cwd=kits[name], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        assert float(re.search(r"largest deviation (\S+)", done.stdout).group(1)) < 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_the_guides_command_for_fmpy_reproduces_the_reference(kits, name, tmp_path):
    command = re.search(r"```sh\nfmpy (.*)\n```", (kits[name] / "guide.md").read_text(encoding="utf-8")).group(1)
    fmpy = [sys.executable, "-m", "fmpy", *command.replace("out.csv", str(tmp_path / "out.csv")).split()]
    subprocess.run(fmpy, cwd=kits[name], check=True)
    theirs = np.genfromtxt(tmp_path / "out.csv", delimiter=",", names=True, deletechars="", dtype=None, encoding=None)
    ours = read_csv(kits[name] / "reference" / cases_of(COMPONENTS[name])[0].name / f"{name}_ref.csv")
    assert len(theirs) == len(ours)
    for signal in ours.dtype.names:
        assert theirs[signal].astype(float) == pytest.approx(ours[signal], abs=1e-9), signal


def test_every_input_and_parameter_shows_in_some_reference_run():
    # thruster_d cannot change alone, the depth of a vertical thruster has no lever, and steps of 10 ms leave no error.
    idle = {"sample_time", "thruster_d", "max_step"}
    for name, component in COMPONENTS.items():
        for signal in component.inputs:
            seen = np.concatenate([case.input_values(component) for case in cases_of(component)])
            columns = [component.u.names.index(scalar) for scalar in signal.names]
            assert (np.ptp(seen[:, columns], axis=0) > 0).all(), (name, signal.key)
        changed = {scalar for case in cases_of(component) for scalar in case.parameters}
        for signal in component.parameters:
            if signal.type == "Real" and signal.key not in idle:
                assert set(signal.names) <= changed, (name, signal.key)


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


def test_what_is_zero_or_a_switch_gets_no_false_explanation(tmp_path):
    def offset(sample, x, u, p, w):
        state, outputs = sample(x, u, p, w)
        return state, {**outputs, "e": outputs["e"] + 0.5, "saturated": 1.0 - outputs["saturated"]}

    lines, _ = verdict.judge(wrong_controller(tmp_path / "adaptive_pd.fmu", offset))
    departed = [line for line in lines if "departs" in line]
    assert len(departed) == 7
    assert not [line for line in departed if ";" in line]


def test_the_host_does_not_take_a_cut_script_for_a_run(kits, tmp_path):
    if shutil.which("cc") is None:
        pytest.skip("there is no C compiler")
    folder = kits["passive_arm"]
    subprocess.run(
        ["cc", "-std=c99", "-Iheaders", "host.c", "-o", tmp_path / "host", "-ldl", "-lm"], cwd=folder, check=True
    )
    subprocess.run(["unzip", "-qo", "passive_arm.fmu", "-d", tmp_path / "fmu"], cwd=folder, check=True)
    guid = read_model_description(str(folder / "passive_arm.fmu")).guid
    library = tmp_path / "fmu" / "binaries" / zig.host_platform() / f"passive_arm{zig.SUFFIXES[zig.host_platform()]}"
    whole = (folder / "reference" / "noise" / "passive_arm_host.txt").read_text(encoding="utf-8")
    wrong = whole.replace("= 6 ", "= 6 1", 1)
    for text, status in ((whole, 0), (whole[: len(whole) // 2], 1), ("", 1), (wrong, 1)):
        (tmp_path / "script.txt").write_text(text, encoding="utf-8")
        done = subprocess.run(
            [tmp_path / "host", library, guid, tmp_path / "script.txt"], capture_output=True, check=False
        )
        assert done.returncode == status, (status, done.stdout, done.stderr)


ROWS = """
| `eta_m.x/y/z/phi/theta/psi` | m, rad | 0.0 | + - - + - - |
| `theta_hat.dB/F_C.x/F_C.y/F_C.z/F_A.x/F_A.y/F_A.z` | N | + + - - + - - |
| `K_P.x/y/z/phi/theta/psi` | N/m, N.m/rad | 80.0 80.0 100.0 30.0 30.0 30.0 | + |
| `nu.u/v/w/p/q/r` | m/s, rad/s | + - - + - - |
| `I.xx/yy/zz/xy/xz/yz` | kg.m2 | 3.7 6.3 5.9 0.0 0.0 0.0 | + + + - - + |
| `dB/F_C.x/F_C.y/F_C.z/F_A.x/F_A.y/F_A.z` | N | 0.0 | + + - - + - - |
| `q[1..6]` | rad | + |
| `current_mean.x/y/z` | m/s | 0.0 | + - - |
| `current_std.x/y/z` | m/s | 0.0 | + |
| `preload.x/y/z` | N | 0.0 | + - - |
| `attachment.x/y/z/phi/theta/psi` | m, rad | 0.7 0.5 0.4 0.0 0.0 0.0 | + - - + - - |
"""


def test_the_guides_tell_the_sign_of_every_port_and_parameter(kits):
    guides = "".join((kit / "guide.md").read_text(encoding="utf-8") for kit in kits.values())
    for row in ROWS.strip().splitlines():
        assert row in guides, row


def test_the_kits_parameter_sets_are_those_of_the_systems(kits):
    values = {
        p.name: p.value for p in read_ssv(str(kits["adaptive_pd"] / "parameters" / "paper_simulation.ssv")).parameters
    }
    expected = SYSTEMS["paper_simulation"].parameters["controller"]
    assert {name: float(values[name]) for name in expected if isinstance(expected[name], float)} == {
        name: value for name, value in expected.items() if isinstance(value, float)
    }
    assert set(values) == set(CONTROLLER.p.names)


def test_gains_changed_during_a_run_do_not_jump_the_estimate(native):
    one, unchanged = native("adaptive_pd"), native("adaptive_pd")
    estimate = [name for name in CONTROLLER.y.names if name.startswith("theta_hat")]
    for fmu in (one, unchanged):
        fmu.set({"eta_m_valid": True, "eta_d.x": 0.3, "eta_d.z": -0.2})
        fmu.start()
        for n in range(100):
            fmu.step(n)
    one.set({"Gamma.dB": 80.0, "Gamma.F_C.x": 0.0, "K_P.x": 200.0, "K_D.z": 10.0, "epsilon_0": 0.9, "alpha": 0.1})
    for fmu in (one, unchanged):
        fmu.step(100)
    assert [one[name] for name in estimate] == [unchanged[name] for name in estimate]
    before = one["theta_hat.dB"]
    one.step(101)
    assert 0 < abs(one["theta_hat.dB"] - before) < 80.0 * 0.9 * 0.4 * 0.03  # what the new gains adapt in a sample
    tunable = {v.name for v in one.variables.values() if v.variability == "tunable"}
    assert {"Gamma.dB", "K_P.x", "K_D.z", "epsilon_0", "alpha", "adaptation"} <= tunable
