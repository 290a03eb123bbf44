"""How far a tool's results are from ours, measured in a process of its own.

    python -m rov_cosim.importers.measuring NAME PART PATH STOP_TIME OUT

measures one of them, for `measure`.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from ..components.cases import cases_of
from ..exporters.build import components
from ..handover import reference
from ..handover.check import CheckError
from ..master.simulation import simulate
from ..ssp import reader
from .driving import Loop
from .tools import IMPORTERS, Importer

CONTROLLER, SYSTEM = "adaptive_pd", "station_keeping"
"""The component and the system that are measured."""

Part = Literal["controller", "loop"]

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
    return apart(__spec__.name, name, part, str(path.resolve()), str(stop_time or ""))


def apart(module: str, name: str, part: str, *words: str) -> float:
    """Return the number that a module writes into the file of its last argument, run in a process of its own.

    Parameters
    ----------
    module : is run with all the other arguments, and the path of that file.
    name, part : the tool, and what it does.

    Raises
    ------
    ImporterError : the tool fails.
    """
    with tempfile.TemporaryDirectory(prefix="rov_cosim_") as folder:
        out = Path(folder) / "number.txt"
        command = [sys.executable, "-m", module, name, part, *words, str(out)]
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
    """Run a command; None if it does not end in time, as libcosim was once seen to do, for a reason not found."""
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
    with reader.opened(archive) as wiring, tempfile.TemporaryDirectory() as folder:
        return importer.loop(Loop(archive, wiring, simulate(wiring, stop_time=stop_time)), Path(folder))


def _main(name: str, part: str, path: str, stop_time: str, out: str) -> None:
    importer = IMPORTERS[name]
    if part == "controller":
        found = _controller(importer, Path(path))
    else:
        found = _loop(importer, Path(path), float(stop_time) if stop_time else None)
    Path(out).write_text(repr(found), encoding="utf-8")


if __name__ == "__main__":
    _main(*sys.argv[1:])
