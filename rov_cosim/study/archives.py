"""The archives of this project's systems: where they lie, and building them."""

from collections.abc import Callable, Iterable
from pathlib import Path

from ..exporters.build import build_fmus, components, fmu_path, project_root
from ..ssp.declaration import System, wire
from ..ssp.writer import write


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

    Raises
    ------
    BuildError : an FMU cannot be built.
    WiringError : a system is wrong.
    """
    root = project_root()
    written = build_fmus(root, export, platforms, progress=progress)
    fmus = {name: fmu_path(root, name, export) for name in components()}
    for system in systems:
        path = ssp_path(system.name, export)
        written[path] = write(wire(system, fmus), path, plain)
    return written
