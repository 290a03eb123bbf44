"""The archives and FMUs of this project's systems: where they lie, and building them."""

from collections.abc import Callable, Iterable
from pathlib import Path

from ..exporters.build import FMI3, build_fmus, components, fmu_path, project_root
from ..exporters.zig import PLATFORMS
from ..ssp.declaration import System, wire
from ..whole.writer import write, write_fmu


def ssp_path(name: str, export: str = "native") -> Path:
    """Return where the archive of a system lies, with FMUs of an export."""
    folder = project_root() / ("systems" if export == "native" else f"build/{export}")
    return folder / f"{name}.ssp"


def build(
    *systems: System,
    export: str = "native",
    platforms: Iterable[str] = (),
    plain: bool = False,
    progress: Callable[[str], object] = lambda line: None,
) -> dict[Path, bool]:
    """Build all FMUs and the archives of systems; return for each path whether it was written or was current.

    With native FMUs each system is an FMU too, beside those of its components.

    Raises
    ------
    BuildError : an FMU cannot be built.
    WiringError : a system is wrong.
    """
    root = project_root()
    written = build_fmus(root, export, platforms, progress=progress)
    fmus = {name: fmu_path(root, name, export) for name in components()}
    for system in systems:
        wiring, path = wire(system, fmus), ssp_path(system.name, export)
        fmu = fmu_path(root, system.name) if export == "native" else None
        if fmu:
            written[fmu] = write_fmu(wiring, fmu, progress)
        written[path] = write(wiring, path, plain, fmu, progress=progress)
    return written


def build_fmi3(
    *systems: System, all_platforms: bool = False, progress: Callable[[str], object] = lambda line: None
) -> dict[Path, bool]:
    """Build the FMUs of FMI 3.0 of all components and of systems; return as `build` does.

    There are no archives of them: SSP 1.0 is for FMUs up to 2.0. A system is made of its elements' FMUs of 2.0.

    Raises
    ------
    BuildError : an FMU cannot be built.
    WiringError : a system is wrong.
    """
    root = project_root()
    platforms = {fmi: targets if all_platforms else () for fmi, targets in PLATFORMS.items()}
    written = build_fmus(root, FMI3, platforms[3], progress=progress)
    if systems:
        build_fmus(root, platforms=platforms[2], progress=progress)
    for system in systems:
        path = fmu_path(root, system.name, FMI3)
        written[path] = write_fmu(wire(system), path, progress, fmi=3)
    return written
