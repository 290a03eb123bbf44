"""Building the FMUs of all components, in one of the exports."""

import pkgutil
from collections.abc import Iterable
from importlib import import_module
from pathlib import Path

from ..components import __name__ as components_name
from ..components import __path__ as components_path
from ..components.interface import Component
from .zig import BuildError

EXPORTS = ("native", "pythonfmu")


def components() -> dict[str, Component]:
    """Return every component by name: a folder of `components` that declares a COMPONENT."""
    folders = [module.name for module in pkgutil.iter_modules(components_path) if module.ispkg]
    found = [import_module(f"{components_name}.{folder}").COMPONENT for folder in folders]
    return {component.name: component for component in found}


def build_fmus(root: Path, export: str = "native", platforms: Iterable[str] = ()) -> dict[Path, bool]:
    """Build the FMUs below `root`; return for each path whether it was written or was current.

    Parameters
    ----------
    export : one of `EXPORTS`.
    platforms : those that a native FMU is for; this machine's if left out. A pythonfmu FMU has all that pythonfmu has.

    Raises
    ------
    BuildError : a package is not installed, or a component does not compile.
    """
    paths = {fmu_path(root, name, export): component for name, component in components().items()}
    if export == "pythonfmu":
        from . import pythonfmu_export

        return {path: pythonfmu_export.export(component, path) for path, component in paths.items()}
    try:
        from . import native_export

        return {path: native_export.export(component, path, platforms) for path, component in paths.items()}
    except ModuleNotFoundError as error:
        raise BuildError(
            f"The native export needs {error.name}: pip install 'rov-cosim[native]', or take --export pythonfmu."
        ) from None


def fmu_path(root: Path, name: str, export: str = "native") -> Path:
    """Return where the FMU of a component lies below `root`."""
    return root / "build" / export / f"{name}.fmu"


def project_root() -> Path:
    """Return the checkout that holds this package, or the current folder for an installed copy."""
    checkout = Path(__file__).resolve().parents[2]
    return checkout if (checkout / "pyproject.toml").is_file() else Path.cwd()
