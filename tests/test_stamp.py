"""A current FMU is known by its stamp, at no cost, while neither what it is made of nor the FMU has changed."""

import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from rov_cosim.exporters import archive, stamp
from typical import typical

ROOT = Path(__file__).parent.parent
HEAVY = ["PIL", "casadi", "latex2mathml", "markdown_it", "matplotlib", "pythonfmu"]
BUILD = f"""
import json, sys
from pathlib import Path
from rov_cosim.exporters.build import build_fmus
root, export, meanwhile = sys.argv[1:]
exec(meanwhile)
(written,) = build_fmus(Path(root), export, names=["scenario"]).values()
ours = [name for name in sys.modules if name.startswith("rov_cosim.")]
print(json.dumps([written, sorted(set({HEAVY}) & set(sys.modules)), ours]))
"""


class Tree:
    """A copy of the sources, and what it builds, each time in a new process."""

    def __init__(self, folder: Path) -> None:
        self.root = folder
        shutil.copytree(ROOT / "rov_cosim", folder / "rov_cosim", ignore=shutil.ignore_patterns("__pycache__"))

    def build(self, export: str, meanwhile: str = "", packages: Path | None = None):
        """Build the FMU of the scenario, the quickest to compile.

        Return whether it was written, and the heavy packages and our modules then loaded.
        """
        path = os.pathsep.join(str(place) for place in (packages, self.root) if place)
        done = subprocess.run(
            [sys.executable, "-c", BUILD, self.root, export, meanwhile],
            env={**os.environ, "PYTHONPATH": path},
            cwd=self.root,
            stdout=subprocess.PIPE,
            check=True,
        )
        return json.loads(done.stdout)

    def fmu(self, export: str) -> Path:
        return self.root / "build" / export / "scenario.fmu"

    def replace(self, file: str, old: str, new: str) -> None:
        text = (self.root / file).read_text(encoding="utf-8")
        assert old in text
        (self.root / file).write_text(text.replace(old, new), encoding="utf-8")

    def state(self):
        return {path: path.stat().st_mtime_ns for path in self.root.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def built(tmp_path_factory) -> Tree:
    tree = Tree(tmp_path_factory.mktemp("built"))
    for export in ("native", "pythonfmu"):
        written, _, ours = tree.build(export)
        assert written
        # A stamp tells of two folders alone; nothing of an FMU comes from the others.
        assert {name.split(".")[1] for name in ours} == {"components", "exporters", "errors", "loaded"}
    return tree


@pytest.fixture
def tree(built, tmp_path) -> Tree:
    copy = tmp_path / "copy"
    shutil.copytree(built.root, copy)
    tree = Tree.__new__(Tree)
    tree.root = copy
    return tree


@pytest.mark.parametrize("export", ["native", "pythonfmu"])
def test_a_current_fmu_costs_no_tracing_and_nothing_is_written(built, export):
    before = built.state()
    assert built.build(export)[:2] == [False, []]
    assert built.state() == before


@pytest.mark.parametrize(
    ("export", "file", "old", "new"),
    [
        ("native", "rov_cosim/components/scenario/equations.py", "p.step +", "2 * p.step +"),
        pytest.param(*("native", "rov_cosim/components/scenario/README.md", "#", "# Another:"), marks=pytest.mark.slow),
        pytest.param(
            "native",
            "rov_cosim/exporters/c/slave.c",
            "#include <math.h>",
            "/* */\n#include <math.h>",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *("native", "rov_cosim/exporters/c_tables.py", "/* Sizes of", "/* The sizes of"), marks=pytest.mark.slow
        ),
        ("pythonfmu", "rov_cosim/components/scenario/equations.py", "p.step +", "2 * p.step +"),
        ("pythonfmu", "rov_cosim/components/noise.py", "from typ", "# Why.\nfrom typ"),
        pytest.param(
            *("pythonfmu", "rov_cosim/exporters/pythonfmu_slave.py", "from coll", "# Why.\nfrom coll"),
            marks=pytest.mark.slow,
        ),
        ("pythonfmu", "rov_cosim/exporters/documentation.py", "#0b3c5d", "#0b3c5e"),
    ],
)
def test_an_fmu_follows_its_sources(tree, export, file, old, new):
    before = tree.fmu(export).read_bytes()
    tree.replace(file, old, new)
    assert tree.build(export)[0]
    assert tree.fmu(export).read_bytes() != before
    assert tree.build(export)[:2] == [False, []]


@pytest.mark.parametrize("export", typical(["native", "pythonfmu"], "pythonfmu"))
def test_an_fmu_that_is_damaged_edited_or_gone_is_built_anew(tree, export):
    fmu = tree.fmu(export)
    sound = fmu.read_bytes()

    def edit():
        archive.write(fmu, {**archive.read(fmu), "resources/more.txt": b"by hand"})

    for harm in (fmu.unlink, lambda: fmu.write_bytes(sound[:-100]), edit):
        harm()
        assert tree.build(export)[0]
        assert fmu.read_bytes() == sound
        assert tree.build(export)[:2] == [False, []]


@pytest.mark.slow
def test_another_version_of_a_package_is_noticed(tree, tmp_path):
    packages = tmp_path / "packages"
    make = f"""
metadata = Path({str(packages)!r}) / "casadi-3.8.99.dist-info" / "METADATA"
metadata.parent.mkdir()
metadata.write_text("Metadata-Version: 2.1\\nName: casadi\\nVersion: 3.8.99\\n", encoding="utf-8")
"""
    packages.mkdir()
    # Installed while a process runs, which has loaded the old one: it builds, but cannot stamp.
    tree.fmu("native").unlink()
    assert tree.build("native", make, packages)[0]
    assert "casadi" in tree.build("native", packages=packages)[1]
    assert tree.build("native", packages=packages)[:2] == [False, []]
    shutil.rmtree(packages)
    assert tree.build("native")[0]


def test_an_edit_after_the_sources_were_loaded_reaches_the_next_build(tree):
    edit = """
from rov_cosim.components import scenario
file = Path(root) / "rov_cosim" / "components" / "scenario" / "interface.py"
text = file.read_text(encoding="utf-8")
file.write_text(text.replace("Scenario: ", "Another: "), encoding="utf-8")
"""
    before = tree.fmu("native").read_bytes()
    assert not tree.build("native", edit)[0]
    assert tree.fmu("native").read_bytes() == before
    assert tree.build("native")[0]


def test_without_its_stamp_an_fmu_is_checked_and_stamped_again(tree):
    (path,) = tree.fmu("native").parent.glob("*.stamp")
    seal = path.read_bytes()
    path.unlink()
    written, heavy, _ = tree.build("native")
    assert not written
    assert "casadi" in heavy
    assert path.read_bytes() == seal


def test_a_stamp_is_for_the_platforms_in_the_fmu(tmp_path, monkeypatch):
    monkeypatch.setattr(stamp.loaded, "AT", math.inf)  # whatever is edited or installed during the tests
    path = tmp_path / "a.fmu"
    archive.write(path, {"binaries/linux64/a.so": b"", "binaries/win64/a.dll": b""})
    stamp.put(path, "this")
    assert stamp.holds(path, "this", ["linux64"])
    assert stamp.holds(path, "this", ["win64", "linux64"])
    assert not stamp.holds(path, "this", ["linux64", "darwin64"])
    assert not stamp.holds(path, "that", ["linux64"])


def test_the_clock_of_what_is_loaded_starts_before_any_component_is():
    script = (
        "import rov_cosim.components.pid, time; before = time.time(); from rov_cosim.exporters import stamp;"
        " assert stamp.loaded.AT < before"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
