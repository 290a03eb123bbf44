"""Drivers of FMPy, of the FMU Manipulation Toolbox, whose containers FMPy runs, and of the C host.

Each runs the controller through a reference run, or the loop of an archive, and returns the largest absolute difference
to this project's own numbers. Call it in a process of its own (`importers.measure`).
"""

import csv
import re
import shutil
import sys
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.util import write_csv
from numpy.typing import NDArray

from ..components.cases import Case
from ..components.interface import SAMPLE_TIME
from ..exporters import zig
from ..exporters.build import components
from ..handover.reference import Reference, script
from .driving import Loop, deviation, parameters, signals, tool


def _fmpy(path: Path, folder: Path, ours: NDArray[Any], *options: object) -> float:
    out = folder / "out.csv"
    times = ("--stop-time", ours["time"][-1], "--output-interval", SAMPLE_TIME)
    tool(sys.executable, "-m", "fmpy", "simulate", path, "--output-file", out, *times, *options, cwd=folder)
    return deviation(np.genfromtxt(out, delimiter=",", names=True, deletechars="", dtype=None, encoding=None), ours)


def fmpy_command_controller(fmu: Path, reference: Reference, folder: Path) -> float:
    """`fmpy simulate` with an input file and start values."""
    write_csv(folder / "in.csv", reference.inputs)
    values = [part for pair in parameters(reference).items() for part in pair]
    start = ["--start-values", *(str(part).lower() if isinstance(part, bool) else part for part in values)]
    return _fmpy(fmu, folder, reference.outputs, "--input-file", "in.csv", *(start if values else []))


def fmpy_command_loop(loop: Loop, folder: Path) -> float:
    """`fmpy simulate` of the archive, which is an FMU too."""
    return _fmpy(loop.archive, folder, loop.results)


def _simulated(path: Path, ours: NDArray[Any], **options: Any) -> NDArray[Any]:
    names, stop = signals(ours), ours["time"][-1]
    found: NDArray[Any] = simulate_fmu(path, stop_time=stop, output_interval=SAMPLE_TIME, output=names, **options)
    return found


def fmpy_controller(fmu: Path, reference: Reference, folder: Path) -> float:
    """`fmpy.simulate_fmu` with an input array and start values."""
    found = _simulated(fmu, reference.outputs, input=reference.inputs, start_values=parameters(reference))
    return deviation(found, reference.outputs)


def fmpy_loop(loop: Loop, folder: Path) -> float:
    """`fmpy.simulate_fmu` of the archive."""
    return deviation(_simulated(loop.archive, loop.results), loop.results)


def _container(folder: Path, fmus: Sequence[Path], rules: Sequence[Sequence[object]]) -> Path:
    """Return the FMU that `fmucontainer` makes of FMUs by rules; `fmutool` has checked each."""
    for fmu in fmus:
        tool(sys.executable, "-m", "fmu_manipulation_toolbox.cli.fmutool", "-input", fmu, "-check", cwd=folder)
        shutil.copy(fmu, folder)
    with (folder / "made.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, delimiter=";")
        writer.writerow(["rule", "from_fmu", "from_port", "to_fmu", "to_port"])
        writer.writerows([*([("FMU", fmu.name, "", "", "") for fmu in fmus]), *rules])
    explicit = ("-no-auto-input", "-no-auto-output", "-no-auto-link", "-fmu-directory", folder)
    made = ("-container", f"made.csv:{SAMPLE_TIME}", *explicit)
    tool(sys.executable, "-m", "fmu_manipulation_toolbox.cli.fmucontainer", *made, cwd=folder)
    return folder / "made.fmu"


def toolbox_controller(fmu: Path, reference: Reference, folder: Path) -> float:
    """`fmutool -check`, and a container of the controller alone, run by FMPy."""
    rules = [
        *(("INPUT", "", name, fmu.name, name) for name in reference.component.u.names),
        *(("OUTPUT", fmu.name, name, "", name) for name in reference.component.y.names),
        *(("START", fmu.name, name, value, "") for name, value in reference.case.parameters.items()),
    ]
    found = _simulated(_container(folder, [fmu], rules), reference.outputs, input=reference.inputs)
    return deviation(found, reference.outputs)


def container(loop: Loop, folder: Path) -> Path:
    """Return the FMU that `fmucontainer` makes in a folder of all FMUs of a loop; `fmutool` has checked each."""
    fmus, elements = loop.fmus(), [element.name for element in loop.wiring.elements]
    order = [elements[-1], *elements[:-1]]  # it cuts the loop before its first FMU: the vehicle knows its pose alone
    name, values = {element: fmu.name for element, fmu in fmus.items()}, loop.start_values()
    links = loop.wiring.links
    sources = {source for source, _, _ in links}  # the container has these as local variables of the same names
    free = [end for end in loop.outputs() if end not in sources]
    rules = [
        *(("OUTPUT", name[element], variable, "", f"{element}.{variable}") for element, variable in free),
        *(("LINK", name[a.element], a.variable, name[b.element], b.variable) for a, b, _ in links),
        *(("START", name[element], end, f"{v:.17g}", "") for element, vs in values.items() for end, v in vs.items()),
    ]
    return _container(folder, [fmus[element] for element in order], rules)


def toolbox_loop(loop: Loop, folder: Path) -> float:
    """`fmutool -check`, and a container of all FMUs, run by FMPy."""
    found = _simulated(container(loop, folder), loop.results)
    return deviation(found[1:], loop.results)  # what it cut shows at the start, in the feed-through to tau


def _hosted(unpacked: Path, reference: Reference, folder: Path) -> float:
    """Return what host.c, compiled by zig, says of a reference run."""
    host = folder / "host"
    if not host.is_file():
        sources = {"host.c": (files("rov_cosim.handover") / "host.c").read_bytes(), **zig.standard_headers()}
        host.write_bytes(zig.compiled(sources, zig.host_target(), "host", ["-ldl"]))
        host.chmod(0o755)
    description, platform = read_model_description(str(unpacked)), zig.host_platform()
    library = f"{description.coSimulation.modelIdentifier}{zig.SUFFIXES[platform]}"
    (folder / "script.txt").write_text(script(reference), encoding="utf-8")
    printed = tool(host, unpacked / "binaries" / platform / library, description.guid, "script.txt", cwd=folder)
    found = re.match(r"(\d+) steps, largest deviation (\S+)", printed)
    if not found or int(found[1]) != reference.case.steps:
        raise RuntimeError(f"The host took not {reference.case.steps} steps: {printed}")
    return float(found[2])


def host_controller(fmu: Path, reference: Reference, folder: Path) -> float:
    """`host.c`, by the script of the run."""
    return _hosted(Path(extract(fmu, folder / "fmu")), reference, folder)


def host_loop(loop: Loop, folder: Path) -> float:
    """`host.c` for each FMU of the loop, its inputs those of our run."""
    worst = 0.0
    for element in loop.wiring.elements:
        component = components()[element.description.modelName]
        fed = {target.variable: str(source) for source, target, _ in loop.wiring.links if target[0] == element.name}
        inputs = {
            name: loop.results[fed[name]] if name in fed else np.full(len(loop.results), element.value(name))
            for name in component.u.names
        }
        outputs = {name: loop.results[f"{element.name}.{name}"] for name in component.y.names}
        values = {name: float(value) for name, value in element.start_values.items()}
        case = Case(element.name, "", len(loop.results) - 1, lambda t: {}, values)
        run = Reference(component, case, _table(loop, inputs), _table(loop, outputs))
        unpacked = Path(extract(str(element.fmu), str(folder / element.name)))
        worst = max(worst, _hosted(unpacked, run, folder))
    return worst


def _table(loop: Loop, columns: Mapping[str, NDArray[Any]]) -> NDArray[Any]:
    columns = {"time": loop.results["time"], **columns}
    return np.array(list(zip(*columns.values(), strict=True)), dtype=[(name, float) for name in columns])
