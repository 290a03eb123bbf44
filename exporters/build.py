"""Building the FMUs of all components."""

import pkgutil
from importlib import import_module
from pathlib import Path

from ..components import __name__ as components_name
from ..components import __path__ as components_path
from ..components.interface import Component
from .pythonfmu_export import export


def components() -> dict[str, Component]:
    """Return every component by name: a folder of `components` that declares a COMPONENT."""
    folders = [module.name for module in pkgutil.iter_modules(components_path) if module.ispkg]
    found = [import_module(f"{components_name}.{folder}").COMPONENT for folder in folders]
    return {component.name: component for component in found}


def build_fmus(root: Path) -> dict[Path, bool]:
    """Build the FMUs below `root`; return for each path whether it was written or was current."""
    paths = {fmu_path(root, name): component for name, component in components().items()}
    return {path: export(component, path) for path, component in paths.items()}


def fmu_path(root: Path, name: str) -> Path:
    """Return where the FMU of a component lies below `root`."""
    return root / "build" / "pythonfmu" / f"{name}.fmu"
