"""The page docs/SIMULATORS.md: how far off the kit's examples hold a vehicle in the simulators of others."""

import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from importlib.util import find_spec
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import extract
from matplotlib.axes import Axes
from numpy.typing import NDArray

from ..errors import UserError
from ..exporters import zig
from ..exporters.build import build_fmus, components, fmu_path, project_root
from ..handover import kit
from ..report.drawing import LINES, STYLES, drawn
from .measuring import CONTROLLER

PAGE, PICTURE = "SIMULATORS.md", "simulators.svg"


@dataclass(frozen=True)
class Example:
    """A file of the kit's examples, the package that it runs in, if not NumPy alone, and what is said of it."""

    file: str
    title: str
    package: str
    plant: str
    presses: str


_WATER = "20 N of buoyancy, a current of 0.13 m/s"
_CONSTANT = "25 N upwards, 8 N to starboard, a moment of -2 N m"
EXAMPLES = (
    Example("mujoco_rov.py", "MuJoCo", "mujoco", "free body, thrusters as sites, drag of an ellipsoid", _WATER),
    Example("drake_rov.py", "Drake", "pydrake", "free body, the FMU as a system with a periodic update", _WATER),
    Example("z_down.py", "SciPy", "scipy", "`solve_ivp`, six degrees of freedom, axes with z down", _WATER),
    Example("closed_loop.py", "NumPy", "numpy", "four degrees of freedom, the paper's vehicle", _CONSTANT),
    Example("host.cpp", "C++17", "ziglang", "a mass with linear drag", _CONSTANT),
)


class SimulatorError(UserError):
    """An example cannot be run, or its vehicle is not held."""


def write_page(folder: Path, progress: Callable[[Iterable[str], str], Iterable[str]]) -> Path:
    """Run all examples, write the page and its picture into a folder, and return the page.

    Raises
    ------
    SimulatorError : a simulator is not installed, or a vehicle is not held.
    BuildError : the FMU cannot be built.
    """
    if lacking := [example.title for example in EXAMPLES if find_spec(example.package) is None]:
        raise SimulatorError(f"{', '.join(lacking)} not installed: pip install 'rov-cosim[simulators,native]'.")
    by_file = {example.file: example for example in EXAMPLES}
    with tempfile.TemporaryDirectory() as temporary:
        place = Path(temporary)
        _write_kit(place)
        told = {file: _run(place, file) for file in progress(by_file, "example")}
        in_python = {place / f"{file[:-3]}.csv": one.title for file, one in by_file.items() if file.endswith(".py")}
        ways = {title: np.genfromtxt(path, delimiter=",", names=True) for path, title in in_python.items()}
    lines = [("example", "plant", "what presses", "worst in the last fifth"), ("---",) * 4]
    lines += [(f"`{f}`", f"{e.title}: {e.plant}", e.presses, told[f]) for f, e in by_file.items()]
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    text = (files(__package__) / "simulators.md.in").read_text(encoding="utf-8")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / PICTURE).write_text(picture(ways), encoding="utf-8")
    (folder / PAGE).write_text(text.format(table=table), encoding="utf-8")
    return folder / PAGE


def picture(ways: Mapping[str, NDArray[Any]]) -> str:
    """Return the distances from the set-point over time as SVG, a point each 0.6 s.

    Parameters
    ----------
    ways : by what stands beside the line; columns time, x, y, z in s and m.
    """

    def draw(axes: Axes) -> None:
        looks = cycle(zip(LINES, STYLES, strict=True))
        for (title, way), (colour, style) in zip(ways.items(), looks, strict=False):
            shown = way[::20]
            distance = 1e3 * np.linalg.norm([shown[axis] for axis in "xyz"], axis=0)
            axes.semilogy(shown["time"], distance, style, color=colour, label=title)
        axes.axhline(10.0, linewidth=0.8, color=LINES[1])
        axes.minorticks_off()
        axes.set(xlim=(0, 84), ylim=(0.1, 1e3), ylabel="distance [mm]")
        axes.legend(ncols=2)

    return drawn(draw)


def _write_kit(place: Path) -> None:
    build_fmus(project_root())
    fmu = fmu_path(project_root(), CONTROLLER)
    for name, data in {fmu.name: fmu.read_bytes(), **kit.beside(components()[CONTROLLER], fmu)}.items():
        (place / name).parent.mkdir(exist_ok=True)
        (place / name).write_bytes(data)


def _run(place: Path, file: str) -> str:
    """Run an example in the kit's folder and return how far off its vehicle was."""
    command = [sys.executable, f"examples/{file}"]
    if file.endswith(".cpp"):
        platform = zig.host_platform()
        compiler = [sys.executable, "-m", "ziglang", "c++", "-std=c++17", "-O2", "-Iheaders", command[1]]
        _checked(place, [*compiler, "-o", "host", "-ldl", "-lm"])
        unpacked = Path(extract(str(place / f"{CONTROLLER}.fmu"), str(place / "unpacked")))
        command = ["./host", f"{unpacked}/binaries/{platform}/{CONTROLLER}{zig.SUFFIXES[platform]}"]
    return _checked(place, command).strip().removeprefix("held: ")


def _checked(place: Path, command: list[str]) -> str:
    done = subprocess.run(command, cwd=place, capture_output=True, encoding="utf-8", errors="replace", check=False)
    if done.returncode:
        raise SimulatorError(f"{' '.join(command[1:])} ends with {done.returncode}: {done.stdout}{done.stderr}".strip())
    return done.stdout
