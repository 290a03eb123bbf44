"""Every registered tool imports the controller and the loop and agrees with ours; the page's examples run."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rov_cosim.importers.driving import deviation
from rov_cosim.importers.page import CONTROLLER, IMPORTERS, SYSTEM, measure

ROOT = Path(__file__).parent.parent
SLOW = {("fmpy_command", "controller"), ("toolbox", "controller"), ("toolbox", "loop")}
SECTIONS = {
    "FMPy": "fmpy",
    "Ecos": "ecos",
    "libcosim": "libcosim",
    "FMU Manipulation Toolbox": "toolbox",
    "sofirpy": "sofirpy",
}


def skip_unless_installed(name):
    if IMPORTERS[name].version() is None:
        pytest.skip(f"{' or '.join(IMPORTERS[name].packages)} is not installed; the extra `importers` has it")


@pytest.mark.parametrize(
    ("name", "part"),
    [
        pytest.param(name, part, marks=pytest.mark.slow if (name, part) in SLOW else ())
        for name in IMPORTERS
        for part in ("controller", "loop")
    ],
)
def test_a_tool_agrees_with_ours(fmus, archives, name, part):
    skip_unless_installed(name)
    path = fmus[CONTROLLER] if part == "controller" else archives[SYSTEM]
    assert measure(name, part, path) <= IMPORTERS[name].tolerance


def test_a_deviation_misses_nothing():
    ours = np.array(
        [(0.0, 1.0, True), (0.1, 2.0, True), (0.2, 4.0, False)], dtype=[("time", float), ("a", float), ("b", bool)]
    )
    b = [True, False]
    assert deviation({"a": [2.0, 4.0], "b": b}, ours) == 0
    assert deviation({"a": [1.0, 2.0, 3.5], "b": b}, ours) == 0.5
    assert deviation({"a": [2.0, 4.0], "b": [False, False]}, ours) == 1
    assert np.isnan(deviation({"a": [np.nan, 4.0], "b": b}, ours))
    with pytest.raises(ValueError, match="a: 1 rows; expected 3"):
        deviation({"a": [4.0], "b": b}, ours)


@pytest.mark.parametrize("title", SECTIONS)
def test_the_examples_of_a_tool_run(fmus, archives, tmp_path, title):
    skip_unless_installed(SECTIONS[title])
    page = (ROOT / "rov_cosim" / "importers" / "importing.md.in").read_text(encoding="utf-8")
    (section,) = re.findall(rf"^## {title} \(run here\)$(.*?)^## ", page, re.M | re.S)
    blocks = re.findall(r"^```(\w+)\n(.*?)^```$", section, re.M | re.S)
    assert blocks
    for path in (*fmus.values(), archives[SYSTEM]):
        shutil.copy(path, tmp_path)
    tbb = "from rov_cosim.importers.masters import _ecos; _ecos()\n" if title == "Ecos" else ""
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    for language, text in blocks:
        command = [sys.executable, "-c", tbb + text] if language == "python" else ["sh", "-ec", text]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr


def test_the_committed_table_names_every_tool():
    page = (ROOT / "docs" / "IMPORTERS.md").read_text(encoding="utf-8")
    rows = [line.split(" | ")[0].removeprefix("| ") for line in page.splitlines() if line.startswith("| ")]
    assert {tool.title for tool in IMPORTERS.values()} <= set(rows)
