"""The kit's examples hold a vehicle in real simulators, within the limits that they state, in less than 60 lines."""

import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from test_kit_examples import EXAMPLES, compiled, errors, folder, library, run

__all__ = ["folder"]
pytestmark = pytest.mark.slow
NEEDS = {"mujoco_rov": "mujoco", "drake_rov": "pydrake", "z_down": "scipy"}


@pytest.mark.parametrize("name", NEEDS)
def test_a_vehicle_is_held(folder, tmp_path, name):
    if find_spec(NEEDS[name]) is None:
        pytest.skip(f"{NEEDS[name]} is not installed; the extra `simulators` has it")
    status, said = run(sys.executable, f"examples/{name}.py", cwd=folder)
    assert status == 0, said
    position, yaw = errors(said)
    assert position < 10
    assert yaw < 1
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


def test_the_examples_are_short():
    for name in ("mujoco_rov.py", "drake_rov.py", "z_down.py", "host.cpp", "closed_loop.py"):
        lines = (EXAMPLES / name).read_text(encoding="utf-8").splitlines()
        assert len([line for line in lines if line.strip()]) < 60, name
