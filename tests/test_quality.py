"""The code is formatted, linted and typed; the docs say what is so."""

import re
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from zipfile import ZipFile

import pytest

from rov_cosim.cli.main import main
from rov_cosim.exporters.build import components
from rov_cosim.release import source
from rov_cosim.systems.catalogue import SYSTEMS
from rov_cosim.systems.fleet import LOOPS, VEHICLES, WIRED, named

ROOT = Path(__file__).parent.parent
PAGES = sorted(
    p for p in ROOT.rglob("*.md") if not {".venv", ".pytest_cache", "build"} & set(p.relative_to(ROOT).parts)
)

UNNEEDED = shutil.ignore_patterns(".*", "build", "*.egg-info", "*.ssp")


def run(*command, **options):
    done = subprocess.run([sys.executable, "-m", *command], capture_output=True, text=True, check=False, **options)
    assert done.returncode == 0, done.stdout + done.stderr


def test_ruff_finds_nothing():
    run("ruff", "check", "--no-cache", ROOT)
    run("ruff", "format", "--no-cache", "--check", ROOT)


@pytest.mark.slow
def test_mypy_finds_nothing(tmp_path):
    run("mypy", "--cache-dir", tmp_path / "cache", cwd=ROOT)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    for target, anchor in re.findall(r"\]\(([^)#:]*)#?([^):]*)\)", page.read_text(encoding="utf-8")):
        file = page.parent / target if target else page
        assert file.exists(), target
        assert not anchor or file.suffix != ".md" or anchor in anchors(file), f"{target}#{anchor}"


def anchors(page):
    """Return the names of a page's headings in links, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_what_a_page_imports_is_there(page):
    text = page.read_text(encoding="utf-8")
    for module, names in re.findall(r"from (rov_cosim[\w.]*) import ([\w, ]+)", text):
        for name in names.split(","):
            assert hasattr(import_module(module), name.strip()), f"{module} has no {name}"


def test_the_index_leads_to_every_page():
    index = (ROOT / "docs" / "README.md").resolve()
    led_to = {(index.parent / target).resolve() for target in re.findall(r"\]\(([^)#:]+)", index.read_text())}
    # Forms and caches, in folders with a dot, are no pages.
    pages = {p.resolve() for p in PAGES if not any(part.startswith(".") for part in p.relative_to(ROOT).parts)}
    assert pages - {index} <= led_to, pages - {index} - led_to


def test_the_readme_names_every_component_and_command():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    expected = {*components(), *(f"rov-cosim {command}" for command in main.list_commands(None))}
    assert {name for name in expected if name in text} == expected
    rows = [
        re.findall(
            r"^\| `(\w+)` \|", (ROOT / "systems" / page).read_text(encoding="utf-8").partition("\n## Rules")[0], re.M
        )
        for page in ("README.md", "FLEET.md")
    ]
    assert set(rows[1]) <= {*VEHICLES, *WIRED}
    assert [*rows[0], *(named(*pair) for pair in LOOPS)] == list(SYSTEMS)


CODE_LINK = r"\[`(\w+)` in ([\w.]+)]\(([^)]*)\)"


@pytest.mark.parametrize("name", components())
def test_a_components_page_leads_from_its_equations_to_the_code(name):
    folder = ROOT / "components" / name
    page = (folder / "README.md").read_text()
    for section in page.split("\n## ")[1:]:
        assert "$$" not in section or re.search(CODE_LINK, section), section
    for function, file, target in re.findall(CODE_LINK, page):
        assert Path(target).name == file, target
        assert f"\ndef {function}(" in (folder / target).read_text(), (function, target)


@pytest.mark.parametrize("name", components())
def test_a_components_page_knows_its_names(name):
    # Every backticked name on the page that looks like a variable is one.
    component = components()[name]
    known = {scalar for s in component.inputs + component.outputs + component.parameters for scalar in s.names}
    stems = known | {re.split(r"[.\[]", scalar)[0] for scalar in known}
    page = re.sub(CODE_LINK, "", (ROOT / "components" / name / "README.md").read_text())
    for quoted in re.findall(r"`([A-Za-z_]\w*(?:[.\[][^`]*)?)`", page):
        assert quoted.replace("[i]", "[1]").removesuffix(".*") in stems | {
            re.sub(r"\.\w+$", "", scalar) for scalar in known
        }, quoted


SITE = str(Path(pytest.__file__).parent.parent)
COMMAND = """
import site, sys
sys.path.insert(0, sys.argv.pop(1))
site.addsitedir(sys.path[0])
sys.modules.update(dict.fromkeys(sys.argv.pop(1).split(",")))
from rov_cosim.cli.main import main
main()
"""


def run_installed(target, work, *arguments, without=""):
    """Run the command that is installed in a folder, as if packages were not there."""
    done = subprocess.run(
        # -S keeps the editable install of the checkout away; the dependencies come by path.
        [sys.executable, "-S", "-c", COMMAND, target, without, *arguments],
        cwd=work,
        env={"PYTHONPATH": SITE, "PATH": "", "HOME": str(Path.home())},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


INSTALLED = (
    ("list",),
    ("troubles",),
    ("run", "station_keeping", "--stop-time", "0.3", "--archive", "ran.ssp"),
    ("run", "ran.ssp", "--stop-time", "0.3"),
    ("build", "station_keeping"),
    ("show", "station_keeping", "--picture", "wiring.svg"),
    ("compare", "station_keeping", "bluerov2", "--stop-time", "0.3"),
    ("matrix", "--vehicle", "bluerov2", "--controller", "pid", "--trouble", "bias"),
    ("handover", "pid", "--this-platform"),
    ("tune", "bluerov2", "--controller", "pid", "--alone", "mine.ssv"),
)
EXTRAS = "casadi,distributed,pyarrow,ziglang"
DATA = {
    *(f"rov_cosim/systems/vehicles/{vehicle}.ssv" for vehicle in VEHICLES),
    *(f"rov_cosim/{file.relative_to(ROOT)}" for file in (ROOT / "systems" / "gates").iterdir() if file.suffix != ".md"),
    *(str(file.relative_to(ROOT)) for file in (ROOT / "rov_cosim" / "handover" / "examples").glob("*.*")),
}


@pytest.mark.slow
def test_an_installed_copy_works_outside_the_checkout(tmp_path):
    wheel = source.wheel(ROOT, tmp_path)
    with ZipFile(wheel) as archive:
        assert set(archive.namelist()) >= DATA
    target = tmp_path / "site"
    run("pip", "install", "--no-deps", "-q", "--target", target, wheel)
    work = tmp_path / "work"
    work.mkdir()
    for command in INSTALLED:
        run_installed(target, work, *command)
    assert (work / "systems" / "station_keeping.ssp").is_file()
    assert (work / "build" / "results" / "station_keeping+0.3s.csv").is_file()
    assert (work / "build" / "handover" / "pid-0.1.0.zip").is_file()
    assert (work / "wiring.svg").is_file()
    run_installed(target, tmp_path, "handover", "check", next(work.rglob("pid-0.1.0/pid.fmu")), without=EXTRAS)


@pytest.mark.slow
def test_an_editable_install_does_without_links(tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(ROOT, copy, symlinks=True, ignore=UNNEEDED)
    links = [path for path in (copy / "rov_cosim").iterdir() if path.is_symlink()]
    assert {link.name for link in links} == {"components", "systems"}
    for link in links:  # as git leaves them where there are none, on Windows
        text = str(link.readlink())
        link.unlink()
        link.write_text(text, encoding="utf-8")
    target = tmp_path / "site"
    run("pip", "install", "--no-deps", "-q", "--target", target, "-e", copy)
    for export in ("native", "pythonfmu"):
        run_installed(target, tmp_path, "run", "station_keeping", "--stop-time", "0.3", "--export", export)
        assert (copy / "build" / export / "rov_plant.fmu").is_file()
