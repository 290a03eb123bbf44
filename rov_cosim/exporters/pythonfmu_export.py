"""The pythonfmu export: an FMU that carries the component's Python source and pythonfmu's loader."""

from hashlib import sha256
from pathlib import Path

import pythonfmu

from ..components import __path__ as components_path
from ..components.interface import Component
from . import archive, documentation, model_description

_COMPONENTS, _EXPORTERS = Path(components_path[0]), Path(__file__).parent
_PYTHONFMU = Path(pythonfmu.__file__).parent

# pythonfmu's loader runs this module anew at each instantiation and each time drops a reference to its globals that it
# does not own: without one more for each run, the second instance of a process would crash.
_MAIN = """\
from {package}.components.{name}.interface import COMPONENT
from {package}.exporters.pythonfmu_slave import ComponentSlave, held

held.append(globals())


class Slave(ComponentSlave):
    component = COMPONENT
"""


def export(component: Component, path: Path) -> bool:
    """Write the FMU of a component to `path` unless it is current; tell whether it was written."""
    return archive.write(path, entries(component))


def entries(component: Component) -> dict[str, bytes]:
    """Return the content of a component's FMU, name to bytes."""
    sources = _sources(component)
    # All FMUs of a process share one module cache: a name with the content's hash keeps every version apart.
    digest = sha256(b"".join(name.encode() + content for name, content in sorted(sources.items())))
    package = f"{component.name}_{digest.hexdigest()[:12]}"
    main = f"{package}_main"
    description = model_description.to_xml(model_description.describe(component))
    content = {"modelDescription.xml": description, **documentation.entries(component, ["rov-cosim", "pythonfmu"])}
    content[f"resources/{main}.py"] = _MAIN.format(package=package, name=component.name).encode()
    content["resources/slavemodule.txt"] = main.encode()
    for name, source in sources.items():
        content[f"resources/{package}/{name}"] = source
    for file in sorted(_PYTHONFMU.glob("*.py")):
        content[f"resources/pythonfmu/{file.name}"] = file.read_bytes()
    for binary in sorted((_PYTHONFMU / "resources" / "binaries").glob("*/*")):
        content[f"binaries/{binary.parent.name}/{component.name}{binary.suffix}"] = binary.read_bytes()
    return content


def _sources(component: Component) -> dict[str, bytes]:
    """Return the modules that the component needs to run, by their path below the package."""
    places = {"components": _COMPONENTS, f"components/{component.name}": _COMPONENTS / component.name}
    files = {f"{place}/{file.name}": file for place, folder in places.items() for file in folder.glob("*.py")}
    files |= {f"exporters/{name}": _EXPORTERS / name for name in ("__init__.py", "pythonfmu_slave.py")}
    return {place: file.read_bytes() for place, file in sorted(files.items()) if not place.endswith("cases.py")}
