"""Every registered tool imports the controller and the loop and agrees with ours; the page's examples run."""

import os
import re
import shutil
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from rov_cosim.cli.commands import handover as handover_command
from rov_cosim.handover.kit import importing_page
from rov_cosim.importers import page
from rov_cosim.importers.driving import deviation
from rov_cosim.importers.measuring import CONTROLLER, SYSTEM, ImporterError, measure
from rov_cosim.importers.page import measured
from rov_cosim.importers.tools import IMPORTERS, Importer
from typed import call
from typical import typical

ROOT = Path(__file__).parent.parent
QUICK = {("fmpy", "controller"), ("ecos", "loop")}
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
        pytest.param(name, part, marks=() if (name, part) in QUICK else pytest.mark.slow)
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


@pytest.mark.parametrize("title", typical(SECTIONS, "FMPy"))
def test_the_examples_of_a_tool_run(fmus, archives, tmp_path, title):
    skip_unless_installed(SECTIONS[title])
    text = importing_page()
    (section,) = re.findall(rf"^## {title} \(run by the tests\)$(.*?)^## ", text, re.M | re.S)
    blocks = re.findall(r"^```(\w+)\n(.*?)^```$", section, re.M | re.S)
    assert blocks
    for path in (*fmus.values(), archives[SYSTEM]):
        shutil.copy(path, tmp_path)
    tbb = "from rov_cosim.importers.masters import ecos; ecos()\n" if title == "Ecos" else ""
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    for language, text in blocks:
        command = [sys.executable, "-c", tbb + text] if language == "python" else ["sh", "-ec", text]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr


def test_the_page_says_of_every_tool_who_ran_its_blocks():
    for section in importing_page().split("\n## ")[1:]:
        heading, _, text = section.partition("\n")
        by_tests = heading.endswith("(run by the tests)")
        assert not by_tests or heading.removesuffix(" (run by the tests)") in {*SECTIONS, "C host"}, heading
        assert "```" not in text or by_tests or "not run" in heading, heading
    committed = (ROOT / "docs" / "IMPORTERS.md").read_text(encoding="utf-8")
    assert committed.endswith(importing_page())


def test_the_committed_page_has_a_measurement_of_every_tool():
    rows = measured((ROOT / "docs" / "IMPORTERS.md").read_text())
    assert set(rows) == {tool.title for tool in IMPORTERS.values()}
    for version, date, *deviations in rows.values():
        assert re.fullmatch(r"\d[\w.]*", version)
        assert re.fullmatch(r"20\d\d-\d\d-\d\d", date)
        assert all(float(deviation) <= 1e-9 for deviation in deviations)


@pytest.fixture
def importers(monkeypatch, archives):
    """Return tools that cost nothing: one that is not installed, one that fails, one that departs, one that agrees."""

    def measured_(name, part, path):
        if name == "fails":
            raise ImporterError("fails fails with the controller, status 1")
        return {"departs": 1.0, "agrees": 2e-13}[name]

    def tool(title, package):
        return Importer(title, (package,), None, None, 1e-12, f"note on {title}")

    tools = {name: tool(f"The {name}", "numpy") for name in ("fails", "departs", "agrees")}
    tools["absent"] = tool("The absent", "no-such-distribution")
    monkeypatch.setattr(page, "IMPORTERS", tools)
    monkeypatch.setattr(page, "measure", measured_)
    return tools


OLD = ("0.9", "2020-02-29", "1.0e-14", "0")


def test_the_page_never_loses_a_measurement(importers, tmp_path):
    path = tmp_path / "docs" / "PAGE.md"
    path.parent.mkdir()
    path.write_text(page.table({tool.title: OLD for tool in importers.values()}))
    failures = page.write_page(path, lambda steps, what: steps)
    rows = measured(path.read_text())
    today = f"{datetime.now(UTC):%Y-%m-%d}"
    assert rows["The agrees"] == (np.__version__, today, "2.0e-13", "2.0e-13")
    assert rows["The absent"] == rows["The fails"] == rows["The departs"] == OLD
    assert failures == [
        "fails fails with the controller, status 1",
        "The departs departs by 1, more than 1e-12.",
    ]
    assert "rov-cosim handover importers\n" in path.read_text()
    written = path.read_text()
    page.write_page(path, lambda steps, what: steps)
    assert path.read_text() == written


def test_a_tool_that_was_never_measured_has_a_row_without_numbers(importers, tmp_path):
    page.write_page(tmp_path / "docs" / "PAGE.md", lambda steps, what: steps)
    text = (tmp_path / "docs" / "PAGE.md").read_text()
    assert "| The absent | not installed when this was written |" in text
    assert list(measured(text)) == ["The agrees"]


def test_the_command_writes_the_page_and_then_tells_what_failed(importers, tmp_path, monkeypatch):
    monkeypatch.setattr(handover_command, "project_root", lambda: tmp_path)
    done = call("handover", "importers")
    assert done.exit_code == 1
    assert "Error: fails fails with the controller, status 1\nThe departs departs by 1" in done.output
    assert list(measured((tmp_path / "docs" / "IMPORTERS.md").read_text())) == ["The agrees"]
