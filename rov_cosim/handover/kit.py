"""The kit of a component: a folder, and a zip of it, with all that another team needs."""

import tempfile
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from importlib.metadata import distribution, version
from importlib.resources import files
from pathlib import Path

from fmpy import read_model_description

from ..components.cases import cases_of
from ..components.interface import Component
from ..exporters import archive, documentation, native_export, zig
from ..exporters.build import FMI3
from ..ssp.wiring import Element
from ..ssp.writer import parameter_set
from ..systems import fleet
from ..systems.catalogue import SYSTEMS
from ..systems.loop import CONTROLLER, element_of
from . import live, reference
from .diagram import wiring_diagram
from .guide import guide
from .header import header

Progress = Callable[[Iterable[str], str], Iterable[str]]
"""What hands the names of steps on, each when the one before is done, and shows them; the second is what they are."""


def write(
    component: Component,
    folder: Path,
    platforms: Collection[str] = zig.TARGETS,
    progress: Progress | None = None,
    page: bytes | None = None,
) -> tuple[Path, Path]:
    """Write the kit of a component below a folder; return the kit's folder and its zip.

    `platforms` are some of `zig.TARGETS`; the FMU of FMI 3.0 is for the same. `page` is its live page, if it has one.

    Raises
    ------
    BuildError : the FMU cannot be built.
    OSError : the folder cannot be written.
    """
    kit, progress = folder / called(component), progress or _silent
    kit.mkdir(parents=True, exist_ok=True)  # before the work, which takes long
    with tempfile.TemporaryDirectory() as temporary:
        fmus = {fmi: Path(temporary) / str(fmi) / f"{component.name}.fmu" for fmi in (2, 3)}
        for platform in progress(platforms, "binary"):
            native_export.export(component, fmus[2], [platform])  # those of before stay in
        for platform in progress(zig.platforms_of(3, platforms), "binary of FMI 3.0"):
            native_export.export(component, fmus[3], [platform], fmi=3)
        content = entries(component, fmus, platforms, progress, page)
    for name, data in content.items():
        path = kit / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    zipped = kit.with_name(f"{kit.name}.zip")
    archive.write(zipped, zipped_entries(component, content))
    return kit, zipped


def called(component: Component) -> str:
    """Return the name of a kit, which is its folder's and its zip's."""
    return f"{component.name}-{version('rov-cosim')}"


def zipped_entries(component: Component, content: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the content of a kit as its zip has it: in a folder of its name."""
    return {f"{called(component)}/{name}": data for name, data in content.items()}


def entries(
    component: Component,
    fmus: Mapping[int, Path],
    platforms: Collection[str],
    progress: Progress,
    page: bytes | None = None,
) -> dict[str, bytes]:
    """Return the content of the kit, name to bytes, with its FMUs by version of FMI, which are for some platforms."""
    cases = cases_of(component)
    places = {2: f"{component.name}.fmu", 3: f"{FMI3}/{component.name}.fmu"}
    content = {places[fmi]: fmu.read_bytes() for fmi, fmu in fmus.items()} | beside(component, fmus[2])
    by_name = {case.name: case for case in cases}
    with tempfile.TemporaryDirectory() as temporary:
        for case in map(by_name.__getitem__, progress(by_name, "reference run")):
            folder = Path(temporary) / case.name
            reference.write(reference.run(component, case), folder)
            content |= {f"reference/{case.name}/{file.name}": file.read_bytes() for file in folder.iterdir()}
    if page:
        content[live.NAME] = page
    text = guide(component, cases, platforms, has_page=page is not None)
    content["guide.md"] = text.encode()
    content["guide.html"] = documentation.html(component.title, text).encode()
    content["wiring.svg"] = wiring_diagram(component).encode()
    content["host.c"] = (files(__package__) / "host.c").read_bytes()
    signals = component.inputs + component.outputs + component.parameters
    types = {name: signal.type for signal in signals if signal.type != "Real" for name in signal.names}
    script = (files(__package__) / "replay_ecos.py.in").read_text(encoding="utf-8")
    content["replay_ecos.py"] = script.format(name=component.name, first=cases[0].name, types=types).encode()
    importing = importing_page()
    content["importing.md"] = importing.encode()
    content["importing.html"] = documentation.html("How to import", importing).encode()
    (licence,) = (file for file in distribution("rov-cosim").files or () if file.name == "LICENSE")
    return {**content, "LICENSE": licence.read_text(encoding="utf-8").encode()}


def beside(component: Component, fmu: Path) -> dict[str, bytes]:
    """Return what a host takes beside the FMU: parameter sets, headers, examples."""
    headers = {**zig.standard_headers(), f"{component.name}.h": header(component).encode()}
    content = {f"headers/{name}": data for name, data in headers.items()}
    return {**_parameter_sets(component, fmu), **content, **_examples(component)}


def importing_page() -> str:
    """Return how to import the FMUs into the tools of others, in Markdown."""
    return (files(__package__) / "importing.md.in").read_text(encoding="utf-8")


def _examples(component: Component) -> dict[str, bytes]:
    """Return what runs as it is: for a controller with plants to hold, and the fleet's vehicles to begin with."""
    texts = {
        file.name: file.read_text(encoding="utf-8")
        for file in (files(__package__) / "examples").iterdir()
        if file.name.endswith((".py", ".c", ".cpp", ".xml"))
    }
    if element_of(component.name) != CONTROLLER:
        return {f"examples/{name}": texts[name].encode() for name in ("check.py", "fmu.py")}
    content = {}
    for name, text in sorted(texts.items()):
        own = text.replace("adaptive_pd", component.name).replace("ADAPTIVE_PD", component.name.upper())
        content[f"examples/{name}"] = own.encode()
    vehicles = {f"vehicles/{name}.ssv": fleet.file_of(name).read_bytes() for name in fleet.VEHICLES}
    return {**content, **vehicles}


def _silent(steps: Iterable[str], what: str) -> Iterable[str]:
    return steps


def _parameter_sets(component: Component, fmu: Path) -> dict[str, bytes]:
    """Return the values of all parameters: at their start, and in each system that has the component."""
    description = read_model_description(str(fmu))
    parameters = [v for v in description.modelVariables if v.causality == "parameter"]
    start = Element(component.name, fmu, description)
    defaults = {variable.name: start.value(variable.name) for variable in parameters}
    sets = {"parameters/start_values.ssv": parameter_set(replace(start, start_values=defaults))}
    for system in SYSTEMS.values():
        for name in [name for name, used in system.elements.items() if used == component.name]:
            values = {**defaults, **system.parameters.get(name, {})}
            sets[f"parameters/{system.name}.ssv"] = parameter_set(replace(start, start_values=values))
    return sets
