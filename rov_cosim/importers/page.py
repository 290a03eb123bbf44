"""Which tools import the FMUs, and how far their results are from ours: the page IMPORTERS.md.

    python -m rov_cosim.importers.page NAME PART PATH STOP_TIME OUT

measures one of them, for `measure`.
"""

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from pathlib import Path
from typing import Literal

from ..components.cases import cases_of
from ..exporters.build import components, fmu_path, project_root
from ..handover import reference
from ..handover.check import CheckError
from ..handover.reference import Reference
from ..master.simulation import simulate
from ..ssp import reader as ssp_reader
from ..study import archives
from ..systems.catalogue import SYSTEMS
from . import masters, programs
from .driving import Loop

CONTROLLER, SYSTEM = "adaptive_pd", "station_keeping"
Part = Literal["controller", "loop"]


@dataclass(frozen=True)
class Importer:
    """A tool that imports the FMUs.

    Parameters
    ----------
    title : what the table calls it.
    packages : what it needs installed; the version told is that of the first.
    controller, loop : its drivers, see `masters` and `programs`; they return the largest absolute difference.
    tolerance : how far the tool may differ.
    note : what to know.
    """

    title: str
    packages: tuple[str, ...]
    controller: Callable[[Path, Reference, Path], float]
    loop: Callable[[Loop, Path], float]
    tolerance: float
    note: str

    def version(self) -> str | None:
        """Return the version of the tool, or None if anything that it needs is not installed."""
        try:
            versions = [version(package) for package in self.packages]
        except PackageNotFoundError:
            return None
        return versions[0]


_TBB = ("tbb",) if sys.platform == "linux" else ()
IMPORTERS = {
    "fmpy_command": Importer(
        "FMPy, `fmpy simulate`",
        ("fmpy",),
        programs.fmpy_command_controller,
        programs.fmpy_command_loop,
        1e-12,
        "runs the archive as an FMU",
    ),
    "fmpy": Importer(
        "FMPy, `simulate_fmu`",
        ("fmpy",),
        programs.fmpy_controller,
        programs.fmpy_loop,
        1e-12,
        "runs the archive as an FMU",
    ),
    "ecos": Importer(
        "Ecos, `ecospy`",
        ("ecospy", *_TBB),
        masters.ecos_controller,
        masters.ecos_loop,
        1e-12,
        "reads the SSP; compared from the first step on: at the start it hands values on once",
    ),
    "libcosim": Importer(
        "libcosim, `libcosimpy`",
        ("libcosimpy",),
        masters.libcosim_controller,
        masters.libcosim_loop,
        1e-11,
        "reads the SSP; counts time in nanoseconds, so that steps differ in the last digit; shows nothing at the start",
    ),
    "toolbox": Importer(
        "FMU Manipulation Toolbox",
        ("fmu-manipulation-toolbox",),
        programs.toolbox_controller,
        programs.toolbox_loop,
        1e-12,
        "`fmutool -check` passes for each FMU; a container by `fmucontainer`, run by FMPy, the vehicle listed first;"
        " compared from the first step on",
    ),
    "sofirpy": Importer(
        "sofirpy",
        ("sofirpy",),
        masters.sofirpy_controller,
        masters.sofirpy_loop,
        1e-12,
        "hands nothing on before the first step: connected inputs get their start values by hand",
    ),
    "host": Importer(
        "C host, `host.c`, by ziglang",
        ("ziglang",),
        programs.host_controller,
        programs.host_loop,
        1e-12,
        "drives one FMU, so the loop is each FMU with the inputs of our run; above 1 the difference is relative",
    ),
}


TIME_LIMIT = 120.0
"""Time in s in which a tool has to come to an end; it takes some seconds."""


class ImporterError(CheckError):
    """A tool does not run; the message has what it said."""


def measure(name: str, part: Part, path: Path, stop_time: float | None = None) -> float:
    """Return the largest absolute difference of a tool's results to ours, measured in a process of its own.

    Parameters
    ----------
    name : a key of `IMPORTERS`.
    part : the controller through all its reference runs, or the loop of an archive beside the Jacobi master.
    path : the FMU of the controller, or the archive.
    stop_time : end of the loop's run in s; the archive's own if left out.

    Raises
    ------
    ImporterError : the tool fails.
    """
    with tempfile.TemporaryDirectory(prefix="rov_cosim_") as folder:
        out = Path(folder) / "deviation.txt"
        command = [sys.executable, "-m", __spec__.name, name, part, str(path.resolve()), str(stop_time or ""), str(out)]
        temporary = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), folder)  # not all tools clean up after themselves
        environment = {**os.environ, **temporary}
        done = _run(command, environment) or _run(command, environment)
        if done is None:
            raise ImporterError(f"{name} does not come to an end with the {part}, in {TIME_LIMIT:g} s, twice.")
        if done.returncode or not out.is_file():
            said = (done.stdout + done.stderr)[-2000:]
            raise ImporterError(f"{name} fails with the {part}, status {done.returncode}:\n{said}")
        return float(out.read_text(encoding="utf-8"))


def _run(command: list[str], environment: Mapping[str, str]) -> subprocess.CompletedProcess[str] | None:
    """Run a command; None if it hangs, as libcosim does once in a while: its threads wait for each other."""
    try:
        return subprocess.run(
            command,
            env=environment,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            check=False,
            timeout=TIME_LIMIT,
        )
    except subprocess.TimeoutExpired:
        return None


def _controller(importer: Importer, fmu: Path) -> float:
    component = components()[CONTROLLER]
    worst = 0.0
    for case in cases_of(component):
        with tempfile.TemporaryDirectory() as folder:
            worst = max(worst, importer.controller(fmu, reference.run(component, case), Path(folder)))
    return worst


def _loop(importer: Importer, archive: Path, stop_time: float | None) -> float:
    with ssp_reader.opened(archive) as wiring, tempfile.TemporaryDirectory() as folder:
        return importer.loop(Loop(archive, wiring, simulate(wiring, stop_time=stop_time)), Path(folder))


Rows = dict[str, tuple[str, ...]]
"""What was measured of tools by their titles: version, date, deviation of the controller and of the system."""

_COLUMNS = (
    *("tool", "version", "measured", "controller: largest deviation", "system: largest deviation"),
    *("stated tolerance", "note"),
)
_NOTHING = ("not installed when this was written", "", "", "")


def write_page(page: Path, progress: Callable[[Iterable[str], str], Iterable[str]]) -> list[str]:
    """Write IMPORTERS.md with the tools that are installed measured anew, and return what keeps others from it.

    A tool that is not installed, fails, or departs by more than its tolerance keeps the row that the page has.

    Parameters
    ----------
    page : the page, which may be there.
    progress : hands the names of the tools on and shows them.

    Raises
    ------
    BuildError : the FMUs cannot be built.
    """
    rows = measured(page.read_text(encoding="utf-8")) if page.is_file() else {}
    archives.build(SYSTEMS[SYSTEM])
    failures = []
    installed = [name for name, importer in IMPORTERS.items() if importer.version()]
    for name in progress(installed, "tool"):
        try:
            rows[IMPORTERS[name].title] = _measured_anew(name)
        except ImporterError as error:
            failures.append(str(error))
    page.parent.mkdir(exist_ok=True)
    text = (files(__package__) / "importing.md.in").read_text(encoding="utf-8")
    page.write_text(text.replace("{table}", table(rows)), encoding="utf-8")
    return failures


def table(rows: Rows) -> str:
    """Return the table of all tools in Markdown."""
    lines = [_COLUMNS, ("---",) * len(_COLUMNS)]
    for tool in IMPORTERS.values():
        lines.append((tool.title, *rows.get(tool.title, _NOTHING), f"{tool.tolerance:g}", tool.note))
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def measured(page: str) -> Rows:
    """Return what the table of a page holds."""
    lines = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| ")]
    dated = (cells for cells in lines if len(cells) == len(_COLUMNS) and re.fullmatch(r"\d{4}-\d\d-\d\d", cells[2]))
    return {cells[0]: tuple(cells[1:5]) for cells in dated}


def _measured_anew(name: str) -> tuple[str, ...]:
    importer = IMPORTERS[name]
    fmu, archive = fmu_path(project_root(), CONTROLLER), archives.ssp_path(SYSTEM)
    found = [measure(name, "controller", fmu), measure(name, "loop", archive)]
    if not max(found) <= importer.tolerance:
        raise ImporterError(f"{importer.title} departs by {max(found):g}, more than {importer.tolerance:g}.")
    deviations = (f"{value:.1e}" if value else "0" for value in found)
    return (str(importer.version()), f"{datetime.now(UTC):%Y-%m-%d}", *deviations)


def _main(name: str, part: str, path: str, stop_time: str, out: str) -> None:
    importer = IMPORTERS[name]
    if part == "controller":
        found = _controller(importer, Path(path))
    else:
        found = _loop(importer, Path(path), float(stop_time) if stop_time else None)
    Path(out).write_text(repr(found), encoding="utf-8")


if __name__ == "__main__":
    _main(*sys.argv[1:])
