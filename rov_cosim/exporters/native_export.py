"""The native export: an FMU of C traced from the component's functions; it needs nothing on the target.

The versions of FMI differ in the description, in the files that begin with fmi2 or fmi3, and in the names of platforms.
"""

from collections.abc import Callable, Iterable, Mapping
from hashlib import sha256
from importlib.resources import files
from pathlib import Path

from fmpy.model_description import ModelDescription

from ..components.interface import Component, Continuous, Sampled
from . import archive, c_tables, documentation, fmi3_description, model_description, tracing, zig

CHECKSUMS = "sources/binaries.sha256"
_SAMPLED_ONLY = {"sampled.c", "noise.c", "noise.h"}
_CONTINUOUS_ONLY = {"continuous.c"}


def export(
    component: Component,
    path: Path,
    platforms: Iterable[str] = (),
    progress: Callable[[str], object] = lambda line: None,
    fmi: int = 2,
) -> bool:
    """Write the FMU of a component to `path` unless it is current; tell whether it was written.

    Parameters
    ----------
    platforms : some of `zig.PLATFORMS`, or this machine's if left out. Binaries for others stay in while current.
    progress : is told in a line what begins: the tracing, and each compilation.
    fmi : the version of FMI, 2 or 3.

    Raises
    ------
    BuildError : the C compiler fails, or has no target for this machine.
    """
    with tracing.ALONE:
        progress(f"tracing {component.name}")
        code = sources(component, fmi)
    content = _entries(component, code) if fmi == 2 else _entries_of_3(component, code)
    kept = kept_binaries(archive.present(path), content, component.name, fmi)
    wanted = set(platforms) or {zig.host_platform(fmi)}
    new = {}
    for platform in zig.PLATFORMS[fmi]:
        place = binary_place(component.name, platform)
        if platform in wanted and place not in kept:
            progress(f"compiling {component.name} for {platform}")
            new[place] = zig.shared_library(component.name, code, platform)
    if not new:
        return False
    binaries = kept | new
    return archive.write(path, {**content, **binaries, CHECKSUMS: checksums(binaries)})


def sources(component: Component, fmi: int = 2) -> dict[str, bytes]:
    """Return all that the binary is made of, by file name: generated, hand-written, and the standard's headers."""
    omitted = _CONTINUOUS_ONLY if isinstance(component, Sampled) else _SAMPLED_ONLY
    code = {name: text for name, text in hand_written(fmi).items() if name not in omitted}
    guid = description(component).guid if fmi == 2 else fmi3_description.describe(component).guid
    traced = tracing.functions(component)
    code["component.h"] = c_tables.header(component, tracing.n_constants(traced)).encode()
    code["component.c"] = c_tables.source(component, guid).encode()
    code["model.c"] = tracing.source(component, traced).encode()
    if fmi == 3:
        declared = component.inputs + component.outputs + component.parameters
        code["arrays.c"] = c_tables.arrays(component.name, [(s.name, s.size) for s in declared]).encode()
    return code


def hand_written(fmi: int = 2) -> dict[str, bytes]:
    """Return the shell of all components for a version of FMI by file name, and the standard's headers."""
    others = tuple(f"fmi{other}" for other in zig.PLATFORMS if other != fmi)
    shell = [file for file in (files(__package__) / "c").iterdir() if file.name.endswith((".c", ".h"))]
    code = {file.name: file.read_bytes() for file in shell if not file.name.startswith(others)}
    return {**code, **zig.standard_headers(fmi)}


def description(component: Component) -> ModelDescription:
    """Return FMPy's description object of the native FMU."""
    return model_description.describe(
        component, providesDirectionalDerivative=True, canInterpolateInputs=isinstance(component, Continuous)
    )


def _entries(component: Component, code: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the content of a component's FMU but for its binaries, name to bytes."""
    files = sorted(name for name in code if name.endswith(".c"))
    content = {"modelDescription.xml": model_description.to_xml(description(component), files)}
    content.update({f"sources/{name}": text for name, text in code.items()})
    content["sources/recipe.txt"] = zig.recipe().encode()
    return {**content, **documentation.entries(component, ["rov-cosim"])}


def _entries_of_3(component: Component, code: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the same for FMI 3.0."""
    pages = documentation.entries(component, ["rov-cosim"], documentation.array)
    made = fmi3_description.terminals(component.inputs + component.outputs)
    return entries_of_3(fmi3_description.describe(component), code, pages, made)


def entries_of_3(
    description: ModelDescription,
    code: Mapping[str, bytes],
    pages: Mapping[str, bytes],
    terminals: Mapping[str, Mapping[str, str]],
) -> dict[str, bytes]:
    """Return the content of an FMU of FMI 3.0 but for its binaries: of its sources, pages with icon, and terminals."""
    listed = sorted(name for name in code if name.endswith(".c") and "/" not in name)
    rest = dict(pages)
    return {
        "modelDescription.xml": fmi3_description.to_xml(description),
        "terminalsAndIcons/terminalsAndIcons.xml": fmi3_description.terminals_and_icons(terminals),
        "terminalsAndIcons/icon.png": rest.pop("model.png"),
        "sources/buildDescription.xml": fmi3_description.build(description.coSimulation.modelIdentifier, listed),
        "sources/recipe.txt": zig.recipe(3).encode(),
        **{f"sources/{name}": text for name, text in code.items()},
        **rest,
    }


def binary_place(name: str, platform: str) -> str:
    """Return where the binary of an FMU for a platform lies in it."""
    return f"binaries/{platform}/{name}{zig.SUFFIXES[platform]}"


def kept_binaries(
    present: Mapping[str, bytes], content: Mapping[str, bytes], name: str, fmi: int = 2
) -> dict[str, bytes]:
    """Return the binaries of an FMU `present` if this project made them of just this content, else none."""
    places = [place for platform in zig.PLATFORMS[fmi] if (place := binary_place(name, platform)) in present]
    binaries = {place: present[place] for place in places}
    ours = {**content, **binaries, CHECKSUMS: checksums(binaries)}
    return binaries if present == ours else {}


def checksums(binaries: Mapping[str, bytes]) -> bytes:
    """Return the list that `sha256sum --check` takes: another compiler's binary must not pass for one of ours."""
    return "".join(f"{sha256(data).hexdigest()}  {name}\n" for name, data in sorted(binaries.items())).encode()
