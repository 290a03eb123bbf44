"""The tools that import the FMUs: what they need, their drivers, how far they may differ."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ..handover.reference import Reference
from . import masters, programs
from .driving import Loop


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
