"""What a kit brings to run: its examples hold their plants, its header and its module have the FMU's variables."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from fmpy import extract, read_model_description

import typed
from rov_cosim.exporters import archive, fmi3_description, zig
from rov_cosim.exporters.build import components
from rov_cosim.handover import kit, reference
from rov_cosim.handover.guide import guide
from rov_cosim.handover.header import header
from rov_cosim.systems import fleet
from rov_cosim.systems.loop import CONTROLLER_COMPONENTS
from typical import typical

COMPONENTS = components()
CONTROLLER = COMPONENTS["adaptive_pd"]
HANDOVER = Path(kit.__file__).parent
EXAMPLES = HANDOVER / "examples"
HELD = re.compile(r"held: (\d+\.\d) mm, (\d+\.\d) deg")


def written(name, folder, fmu):
    """Write a kit without its pages and runs."""
    for place, data in {fmu.name: fmu.read_bytes(), **kit.beside(COMPONENTS[name], fmu)}.items():
        (folder / place).parent.mkdir(exist_ok=True)
        (folder / place).write_bytes(data)
    return folder


@pytest.fixture(scope="module")
def folder(fmus, tmp_path_factory) -> Path:
    return written("adaptive_pd", tmp_path_factory.mktemp("kit"), fmus["adaptive_pd"])


@pytest.fixture(scope="module")
def fmu_module(folder):
    """Return the kit's module."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder / "examples")
        patch.delitem(sys.modules, "fmu", raising=False)
        import fmu

        yield fmu
        patch.delitem(sys.modules, "fmu", raising=False)


def run(*command, cwd):
    done = subprocess.run(
        [str(part) for part in command], cwd=cwd, capture_output=True, encoding="utf-8", errors="replace", check=False
    )
    return done.returncode, done.stdout + done.stderr


def compiled(program, source, folder, *options):
    """Compile a program as a user would, with all warnings."""
    warnings = ("-Wall", "-Wextra", "-Wpedantic", "-Werror")
    command = [sys.executable, "-m", "ziglang", "c++" if str(source).endswith(".cpp") else "cc", *warnings, *options]
    status, said = run(*command, "-O2", "-Iheaders", source, "-o", program, "-ldl", "-lm", cwd=folder)
    assert status == 0, said
    return program


def library(folder, name="adaptive_pd"):
    unpacked = Path(extract(str(folder / f"{name}.fmu"), str(folder / name)))
    platform = zig.host_platform()
    return unpacked / "binaries" / platform / f"{name}{zig.SUFFIXES[platform]}"


def errors(said):
    found = HELD.search(said)
    assert found, said
    return float(found[1]), float(found[2])


def test_the_closed_loop_holds_as_the_guide_tells(folder):
    status, said = run(sys.executable, "examples/closed_loop.py", cwd=folder)
    assert status == 0, said
    position, yaw = errors(said)
    assert position < 5
    assert yaw < 0.5
    assert f"`{said.strip()}`" in (HANDOVER / "holding.md.in").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("name", CONTROLLER_COMPONENTS)
def test_the_loops_of_every_controllers_kit_hold_and_agree(fmus, tmp_path, name):
    folder = written(name, tmp_path, fmus[name])
    status, in_python = run(sys.executable, "examples/closed_loop.py", cwd=folder)
    assert status == 0, in_python
    host = compiled(tmp_path / "closed_loop", "examples/closed_loop.c", folder, "-std=c99")
    assert run(host, library(folder, name), cwd=folder) == (0, in_python)
    host = compiled(tmp_path / "host", "examples/host.cpp", folder, "-std=c++17")
    status, said = run(host, library(folder, name), cwd=folder)
    assert status == 0, said
    assert max(*errors(in_python), *errors(said)) < 5


@pytest.mark.slow
@pytest.mark.parametrize("name", ["adaptive_pd", "pid"])
def test_the_guides_gains_are_those_of_the_command(name):
    table = (
        guide(COMPONENTS[name], kit.cases_of(COMPONENTS[name]), ["linux64"])
        .split("## Gains for your vehicle")[1]
        .split("\n\n| ")[1]
    )
    vehicles, _, *rows = (line.strip(" |").split(" | ") for line in table.split("\n\n")[0].splitlines())
    told = typed.call("tune", "bluerov2", "--controller", name).output  # its thrusters have no lag
    gains = {row[0].strip("`"): row[1 + vehicles.index("`bluerov2`")] for row in rows if row[0].startswith("`")}
    assert {"K_P.x", "K_P.psi", "K_D.z"} <= set(gains)
    for gain, value in gains.items():
        assert f"controller.{gain} = {value}\n" in told


def test_no_example_needs_a_file_of_this_project():
    for file in EXAMPLES.glob("*.*"):
        assert "rov_cosim" not in file.read_text(encoding="utf-8"), file


@pytest.mark.slow
def test_a_loop_without_estimate_is_told_as_lost(folder, tmp_path):
    shutil.copytree(folder / "examples", tmp_path, dirs_exist_ok=True)
    text = (tmp_path / "closed_loop.py").read_text(encoding="utf-8")
    without = text.replace("start_values.ssv", "station_keeping_pd.ssv")
    (tmp_path / "closed_loop.py").write_text(without, encoding="utf-8")
    status, said = run(sys.executable, tmp_path / "closed_loop.py", cwd=folder)
    assert status == 1
    assert said.startswith("lost: ")
    assert float(said.split()[1]) > 200  # 25 N on 100 N/m


@pytest.mark.parametrize("name", typical(COMPONENTS, "adaptive_pd"))
def test_the_header_has_the_references_of_the_fmu(fmus, tmp_path, name):
    component = COMPONENTS[name]
    (tmp_path / f"{name}.h").write_text(header(component), encoding="utf-8")
    lines = [f'#include "{name}.h"', "#include <stdio.h>", "int main(void) {"]
    for signal in component.inputs + component.outputs + component.parameters:
        group = f"{name}_{'thruster_loss' if 'thruster[1].loss' in signal.names else signal.key}"
        for i, scalar in enumerate(signal.names):
            element = re.sub(r"\W+", "_", scalar).strip("_")
            own = f"{name}_{element}" if signal.axes else f"{group}[0]"
            lines.append(f'printf("{scalar} %u %u\\n", {group}[{i}], (unsigned){own});')
        lines.append(f'printf("count {signal.size} %d\\n", {group}_count);')
    lines += [f"for (int i = 0; i < {name}_variable_count; i++)"]
    lines += [
        f'printf("%s %u %c\\n", {name}_variables[i].name, {name}_variables[i].reference, {name}_variables[i].type);'
    ]
    (tmp_path / "print.c").write_text(
        "\n".join([*lines, f"return puts({name.upper()}_GUID) < 0; }}"]), encoding="utf-8"
    )
    (tmp_path / "print.cpp").write_text(f'#include "{name}.h"\nint main() {{}}\n', encoding="utf-8")
    status, said = run(compiled(tmp_path / "print", "print.c", tmp_path, "-I.", "-std=c99"), cwd=tmp_path)
    assert status == 0
    description = read_model_description(str(fmus[name]))
    *rows, guid = (line.split() for line in said.splitlines())
    assert guid == [description.guid]
    count = len(description.modelVariables)
    assert rows[-count:] == [[v.name, str(v.valueReference), v.type[0]] for v in description.modelVariables]
    references = {v.name: str(v.valueReference) for v in description.modelVariables}
    for key, first, second in rows[:-count]:
        assert first == second == references.get(key, first)
    if name == "adaptive_pd":
        compiled(tmp_path / "in_cpp.o", "print.cpp", tmp_path, "-I.", "-std=c++17", "-c")  # no library of C++ to build


def test_the_module_sets_and_gets_by_name(folder, fmu_module):
    with fmu_module.Fmu(folder / "adaptive_pd.fmu", folder / "parameters" / "minerva.ssv") as it:
        expected = fleet.holding("minerva").parameters["controller"]
        assert {name: it[name] for name in expected} == expected
        assert it["thruster[8].enabled"] is False
        it["eta_m"] = range(6)
        assert [it[f"eta_m.{axis}"] for axis in ("x", "y", "z", "phi", "theta", "psi")] == [0, 1, 2, 3, 4, 5]
        it["eta_m_valid"] = True
        assert it["eta_m_valid"] is True
        with pytest.raises(KeyError, match=r"no variable eta_n; is it eta_"):
            it["eta_n"] = 0
        with pytest.raises(ValueError, match="eta_m has 6 elements, not 4"):
            it["eta_m"] = 0, 1, 2, 3


@pytest.mark.slow
def test_the_set_of_a_tuned_vehicle_holds_it(folder, fmus, fmu_module, tmp_path):
    done = typed.call("tune", folder / "vehicles" / "bluerov2.ssv", "--alone", tmp_path / "mine.ssv")
    assert done.exit_code == 0, done.output
    vehicle, controller = fmus["rov_plant"], folder / "adaptive_pd.fmu"
    with (
        fmu_module.Fmu(vehicle, folder / "vehicles" / "bluerov2.ssv") as rov,
        fmu_module.Fmu(controller, tmp_path / "mine.ssv") as it,
    ):
        rov["eta_0.y"], rov["eta_0.psi"], rov["lock_roll_pitch"] = 0.5, 1.0, True
        rov["F_C.x"], rov["F_A.y"] = 0.5, -1.0
        rov.start()
        it["eta_m_valid"] = True
        for _ in range(2000):
            it["eta_m"] = rov["eta"]
            it.step()
            rov["u"] = it["u"]
            rov.step()
        assert np.abs(rov["eta"][:3]).max() < 0.005
        assert abs(rov["eta"][5]) < np.radians(1)


def test_what_the_kits_check_cannot_take_is_told_in_a_line(folder, fmus, tmp_path):
    shutil.copytree(folder / "examples", tmp_path / "examples")
    (tmp_path / "no.fmu").write_text("hello", encoding="utf-8")
    content = archive.read(fmus["adaptive_pd"])
    text = content["modelDescription.xml"].replace(b'name="eta_m.x"', b'name="measured.x"')
    archive.write(tmp_path / "other.fmu", {**content, "modelDescription.xml": text})
    broken = {name: b"none" if name.startswith("binaries/") else it for name, it in content.items()}
    archive.write(tmp_path / "broken.fmu", broken)
    archive.write(
        tmp_path / "three.fmu", {"modelDescription.xml": fmi3_description.to_xml(fmi3_description.describe(CONTROLLER))}
    )
    (tmp_path / "reference" / "one").mkdir(parents=True)
    for part in ("in", "ref"):
        (tmp_path / "reference" / "one" / f"a_{part}.csv").write_text("time,eta_m.x\n0,0\n", encoding="utf-8")
    for name, said in (
        ("nothere", "There is no file nothere.fmu."),
        ("no", "no.fmu cannot be checked here: "),
        ("broken", "broken.fmu cannot be checked here: "),
        ("other", "other.fmu cannot be checked here: the FMU has no variable eta_m.x; is it "),
        ("three", "three.fmu cannot be checked here: it is of FMI 3.0, and this is for FMI 2.0; `rov-cosim handover c"),
    ):
        status, told = run(sys.executable, "examples/check.py", f"{name}.fmu", cwd=tmp_path)
        assert status == 1
        assert told.startswith(said)
        assert told.count("\n") == 1


@pytest.mark.slow
@pytest.mark.usefixtures("references")
def test_the_kits_check_tells_what_departs(fmus, tmp_path):
    folder = written("passive_arm", tmp_path, fmus["passive_arm"])
    component = COMPONENTS["passive_arm"]
    for case in kit.cases_of(component)[:2]:
        reference.write(reference.run(component, case), folder / "reference" / case.name)
    assert run(sys.executable, "examples/check.py", cwd=folder) == (0, "2 reference runs, 0 departures\n")
    content = archive.read(fmus["passive_arm"])
    text = content["modelDescription.xml"].decode()
    x, y = (re.search(rf'name="eta_m\.{axis}" valueReference="(\d+)"', text)[1] for axis in "xy")
    text = text.replace(f'name="eta_m.x" valueReference="{x}"', f'name="eta_m.x" valueReference="{y}"')
    text = text.replace(f'name="eta_m.y" valueReference="{y}"', f'name="eta_m.y" valueReference="{x}"')
    archive.write(tmp_path / "wrong.fmu", {**content, "modelDescription.xml": text.encode()})
    status, said = run(sys.executable, "examples/check.py", "wrong.fmu", cwd=folder)
    assert status == 1
    assert re.search(r"eta_m\.x departs in \w+ at \S+ s: ", said)
