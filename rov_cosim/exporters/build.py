"""Building the FMUs of all components, in one of the exports."""

import pkgutil
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from threading import Lock

from ..components import __name__ as components_name
from ..components import __path__ as components_path
from ..components.interface import Component
from . import stamp
from .zig import CURE, JOBS, BuildError, host_platform

EXPORTS = ("native", "pythonfmu")
"""The exports whose FMUs this project's master runs."""

FMI3 = "fmi3"
"""The native export for FMI 3.0: its FMUs are for other tools."""

_VERSIONS = {"native": 2, FMI3: 3}


_LOADING = Lock()
"""A module that cannot be loaded vanishes from under another thread that loads it too: another error."""


class LackingError(BuildError):
    """What the native export takes is not installed; the other export is there all the same."""


def components() -> dict[str, Component]:
    """Return every component by name: a folder of `components` that declares a COMPONENT.

    Raises
    ------
    BuildError : a component has not the name of its folder.
    """
    folders = [module.name for module in pkgutil.iter_modules(components_path) if module.ispkg]
    found = {folder: import_module(f"{components_name}.{folder}").COMPONENT for folder in folders}
    for folder, component in found.items():
        if component.name != folder:
            raise BuildError(f"components/{folder} declares the component {component.name}: name it as its folder.")
    return found


def build_fmus(
    root: Path,
    export: str = "native",
    platforms: Iterable[str] = (),
    names: Iterable[str] | None = None,
    progress: Callable[[str], object] = lambda line: None,
) -> dict[Path, bool]:
    """Build the FMUs below `root`; return for each path whether it was written or was current.

    Parameters
    ----------
    export : one of `EXPORTS`, or `FMI3`.
    platforms : those that a native FMU is for; this machine's if left out. A pythonfmu FMU has all that pythonfmu has.
    names : the components; all if left out.
    progress : is told in a line what begins, before all that takes long.

    Raises
    ------
    BuildError : a package is not installed, or a component does not compile.
    OSError : an FMU cannot be written.
    """
    needed = (set(platforms) or {host_platform(_VERSIONS[export])}) if export in _VERSIONS else set()
    known = components()
    made_of = stamp.inputs(known if names is None else names)

    def build(name: str) -> tuple[Path, bool]:
        path, written = fmu_path(root, name, export), False
        if not stamp.holds(path, made_of[name], needed):
            written = _export(known[name], path, export, needed, progress)
            stamp.put(path, made_of[name])
        return path, written

    with ThreadPoolExecutor(JOBS) as pool:  # the compiler is a process of its own
        return dict(pool.map(build, made_of))


def built(
    names: Iterable[str], export: str = "native", progress: Callable[[str], object] = lambda line: None
) -> dict[str, Path]:
    """Return the FMUs of components by name, built below `project_root` if they are not current.

    Names of which there is no component are passed over; the rest is as in `build_fmus`.
    """
    root, known = project_root(), components()
    wanted = [name for name in dict.fromkeys(names) if name in known]
    build_fmus(root, export, names=wanted, progress=progress)
    return {name: fmu_path(root, name, export) for name in wanted}


def _export(
    component: Component, path: Path, export: str, platforms: set[str], progress: Callable[[str], object]
) -> bool:
    # Imported here: what an export needs takes longer to load than the check that nothing is to be built.
    if export == "pythonfmu":
        from . import pythonfmu_export

        return pythonfmu_export.export(component, path)
    try:
        with _LOADING:
            from . import native_export

        return native_export.export(component, path, platforms, progress, _VERSIONS[export])
    except ModuleNotFoundError as error:
        kind = LackingError if export in EXPORTS else BuildError
        raise kind(f"The native export needs {error.name}, which is not installed: {CURE}") from None


def project_root() -> Path:
    """Return the checkout that holds this package, or the current folder for an installed copy."""
    checkout = Path(__file__).resolve().parents[2]
    return checkout if (checkout / "pyproject.toml").is_file() else Path.cwd()


def fmu_path(root: Path, name: str, export: str = "native") -> Path:
    """Return where the FMU of a component lies below `root`."""
    return root / "build" / export / f"{name}.fmu"
