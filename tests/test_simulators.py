"""The kit's examples hold a vehicle in real simulators, within the limits that they state, in less than 60 lines."""

import re
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from test_kit_examples import EXAMPLES, compiled, errors, folder, library, run

import typed
from rov_cosim.cli.commands import handover as handover_command
from rov_cosim.importers import simulators

__all__ = ["folder"]
ROOT = Path(__file__).parent.parent
pytestmark = pytest.mark.slow
NEEDS = {one.file[:-3]: one.package for one in simulators.EXAMPLES[:3]}


def on_the_page(file):
    """Return position and yaw in the row of an example, in mm and deg."""
    (row,) = re.findall(rf"^\| `{file}` .*$", (ROOT / "docs" / simulators.PAGE).read_text(encoding="utf-8"), re.M)
    return [float(text) for text in re.findall(r"(\d+\.\d) (?:mm|deg)\b", row)]


@pytest.mark.parametrize("name", NEEDS)
def test_a_vehicle_is_held_as_the_page_tells(folder, name):
    if find_spec(NEEDS[name]) is None:
        pytest.skip(f"{NEEDS[name]} is not installed; the extra `simulators` has it")
    status, said = run(sys.executable, f"examples/{name}.py", cwd=folder)
    assert status == 0, said
    position, yaw = errors(said)
    assert position < 10
    assert yaw < 1
    assert [position, yaw] == pytest.approx(on_the_page(f"{name}.py"), abs=0.5)  # in any version of the simulator
    way = np.genfromtxt(folder / f"{name}.csv", delimiter=",", names=True)
    assert way["time"][-1] == pytest.approx(84.0, abs=0.031)
    assert abs(way["y"][0]) == pytest.approx(0.5, abs=0.01)  # it had to come a way
    assert np.abs(way["z"]).max() > 0.03  # and was pressed upwards


def test_a_host_in_cpp_holds(folder, tmp_path):
    host = compiled(tmp_path / "host", "examples/host.cpp", folder, "-std=c++17")
    status, said = run(host, library(folder), cwd=folder)
    assert status == 0, said
    position, yaw = errors(said)
    assert position < 5
    assert yaw < 0.5
    assert subprocess.run([host, "none.so"], capture_output=True, check=False).returncode != 0


def test_the_command_writes_page_and_picture(tmp_path, monkeypatch):
    monkeypatch.setattr(handover_command, "project_root", lambda: tmp_path)
    monkeypatch.setattr(simulators, "EXAMPLES", simulators.EXAMPLES[3:])  # those that need no simulator
    done = typed.call("handover", "simulators")
    assert done.exit_code == 0, done.output
    page, committed = ((root / "docs" / simulators.PAGE).read_text(encoding="utf-8") for root in (tmp_path, ROOT))
    assert page == "".join(line for line in committed.splitlines(True) if not re.search(r"mujoco_|drake_|z_down", line))
    for root, titles in ((tmp_path, ("NumPy",)), (ROOT, ("MuJoCo", "Drake", "SciPy", "NumPy"))):
        drawn = (root / "docs" / simulators.PICTURE).read_text(encoding="utf-8")
        assert all(f">{title}<" in drawn for title in titles)
        assert len(drawn) < 40_000


def test_what_is_not_installed_and_what_is_lost_are_told(monkeypatch):
    absent = replace(simulators.EXAMPLES[0], title="The absent", package="no_such_package")
    monkeypatch.setattr(simulators, "EXAMPLES", (absent,))
    assert "The absent not installed: pip install" in typed.call("handover", "simulators").output
    monkeypatch.setattr(simulators, "EXAMPLES", (replace(absent, file="none.py", package="numpy"),))
    assert "examples/none.py ends with 2" in typed.call("handover", "simulators").output


def test_the_examples_are_short():
    for name in ("mujoco_rov.py", "drake_rov.py", "z_down.py", "host.cpp", "closed_loop.py"):
        lines = (EXAMPLES / name).read_text(encoding="utf-8").splitlines()
        assert len([line for line in lines if line.strip()]) < 60, name
