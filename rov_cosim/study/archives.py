"""The archives and FMUs of this project's systems: where they lie, and building them."""

from collections.abc import Callable, Iterable
from pathlib import Path

from ..exporters.build import build_fmus, components, fmu_path, project_root
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
