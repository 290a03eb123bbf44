"""The kit holds what its guide promises, and what the guide says works."""

import re
import shutil
import subprocess
import sys
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.ssp.ssd import read_ssv
from fmpy.util import read_csv
from lxml import etree

import typed
from rov_cosim.components.cases import cases_of
from rov_cosim.exporters import archive, native_export, zig
from rov_cosim.exporters.build import components
from rov_cosim.handover import kit, live, verdict
from rov_cosim.handover.guide import guide
from rov_cosim.report import bundle
from rov_cosim.ssp import swap_map
from rov_cosim.systems.catalogue import SYSTEMS
from typical import typical

COMPONENTS = components()
NAMES = typical(COMPONENTS, "adaptive_pd")
CONTROLLER = COMPONENTS["adaptive_pd"]

pytestmark = pytest.mark.usefixtures("references")


class Kits(dict[str, Path]):
    """The kits' folders by component, each written when it is asked for, with the binaries that are built."""

    def __init__(self, folder: Path, built: dict[int, dict[str, Path]]) -> None:
        self._folder, self._built = folder, built

    def __missing__(self, name: str) -> Path:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(native_export, "export", self._copy)
            return self.setdefault(name, kit.write(COMPONENTS[name], self._folder, [zig.host_platform()])[0])

    def _copy(self, component, path, platforms, fmi=2):
        path.parent.mkdir(exist_ok=True)
        shutil.copyfile(self._built[fmi][component.name], path)


@pytest.fixture(scope="module")
def kits(tmp_path_factory, references, fmus, fmi3_fmus) -> dict[str, Path]:
    """Return the kits' folders by component, with binaries for this machine."""
    return Kits(tmp_path_factory.mktemp("kits"), {2: fmus, 3: fmi3_fmus})


@pytest.mark.parametrize("name", NAMES)
def test_the_kit_holds_what_its_guide_promises(kits, name):
    folder = kits[name]
    guide = (folder / "guide.md").read_text()
    for target in re.findall(r"\]\(([^):#]+)\)", guide):
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
    fmus = [folder / f"{name}.fmu", folder / "fmi3" / f"{name}.fmu"]
    assert [read_model_description(str(fmu)).fmiVersion for fmu in fmus] == ["2.0", "3.0"]
    names = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert set(archive.read(folder.with_name(f"{folder.name}.zip"))) == {f"{folder.name}/{n}" for n in names}


@pytest.mark.slow
def test_the_long_steps_of_a_kit_are_told_as_they_come(tmp_path):
    told = []

    def progress(steps, what):
        for step in steps:
            told.append(f"{what} {step}")
            yield step

    kit.write(COMPONENTS["scenario"], tmp_path, [zig.host_platform()], progress)
    runs = [f"reference run {case.name}" for case in cases_of(COMPONENTS["scenario"])]
    assert told == [f"binary {zig.host_platform()}", f"binary of FMI 3.0 {zig.host_platform(3)}", *runs]


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


def test_a_kit_has_a_page_where_it_can_be_made_and_its_guide_tells_of_it(monkeypatch, tmp_path):
    written = []
    monkeypatch.setattr(kit, "write", lambda component, *given: written.append((component.name, given[-1])) or ())
    monkeypatch.setattr(bundle, "find_spec", lambda name: None)
    monkeypatch.setattr(bundle, "project_root", lambda: tmp_path)  # where nothing is bundled yet
    done = typed.call("handover", "pid")
    assert (
        "The kit is without live.html: A page takes npm: pip install 'rov-cosim[report]'." in done.stderr.splitlines()
    )
    assert typed.call("handover", "rov_plant").exit_code == done.exit_code == 0
    assert written == [("pid", None), ("rov_plant", None)]
    told = [guide(COMPONENTS["pid"], cases_of(COMPONENTS["pid"]), ["linux64"], has_page=page) for page in (True, False)]
    assert [live.NAME in text for text in told] == [True, False]
    assert all(live.systems(COMPONENTS[name]) == {} for name in ("rov_plant", "passive_arm", "scenario", "taut_wire"))


LONG = "a" * 240


def test_a_kit_that_cannot_be_written_ends_with_a_reason(tmp_path):
    (tmp_path / "file").write_text("")
    for folder, reason in (
        ("/proc/none", "/proc/none"),
        (tmp_path / "file", "is a file"),
        (tmp_path / "file" / "below", "cannot be written (Not a directory): name one where you may write."),
        (tmp_path / (LONG + LONG), "File name too long"),
    ):
        assert reason in typed.one_line(typed.call("handover", "scenario", "--this-platform", "--output", folder))


@pytest.mark.parametrize("name", NAMES)
def test_the_guides_map_is_one(kits, fmus, tmp_path, name):
    """It is applied to an FMU whose variables have the names that the guide makes up."""
    (text,) = re.findall(r"```toml\n(.*?)```", (kits[name] / "guide.md").read_text(), re.S)
    (maps,) = swap_map.read(typed.mapped(tmp_path, text)).values()
    content = archive.read(fmus[name])
    description = content["modelDescription.xml"].decode()
    for theirs, entry in maps.variables.items():
        description = re.sub(rf'name="{re.escape(entry.ours)}(?=["\[.])', f'name="{theirs}', description)
    archive.write(tmp_path / "theirs.fmu", {**content, "modelDescription.xml": description.encode()})
    text = text.replace(', z_down = true, unit = "deg"', "")
    lines, conforms = verdict.judge(tmp_path / "theirs.fmu", None, typed.mapped(tmp_path, text))
    assert conforms, lines


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")
@pytest.mark.parametrize("name", NAMES)
def test_the_guides_commands_for_the_c_host_reproduce_the_reference(kits, name):
    guide = (kits[name] / "guide.md").read_text(encoding="utf-8")
    block = re.search(r"```sh\n(unzip[^`]* host\.c .*?)```", guide, re.S).group(1)
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


@pytest.mark.slow
def test_the_guides_tell_the_sign_of_every_port_and_parameter(kits):
    guides = "".join((kits[name] / "guide.md").read_text(encoding="utf-8") for name in COMPONENTS)
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
