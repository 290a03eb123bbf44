"""The native export: an FMU of C traced from the component's functions; it needs nothing on the target."""

from collections.abc import Iterable, Mapping
from importlib.resources import files
from pathlib import Path

from fmpy.model_description import ModelDescription

from ..components.interface import Component, Continuous, Sampled
from . import archive, c_tables, documentation, model_description, tracing, zig

_STANDARD_HEADERS = ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h")
_SAMPLED_ONLY = {"sampled.c", "noise.c", "noise.h"}
_CONTINUOUS_ONLY = {"continuous.c"}


def export(component: Component, path: Path, platforms: Iterable[str] = ()) -> bool:
    """Write the FMU of a component to `path` unless it is current; tell whether it was written.

    platforms are some of `zig.TARGETS`, or this machine's if left out. Binaries for others stay in while current.

    Raises
    ------
    BuildError : the C compiler fails, or has no target for this machine.
    """
    content = entries(component)
    places = {platform: _place(component, platform) for platform in zig.TARGETS}
    kept = _kept_binaries(path, content, places.values())
    wanted = set(platforms) or {platform for platform, targets in zig.TARGETS.items() if zig.host_target() in targets}
    new = {
        place: zig.shared_library(component.name, sources(component), platform)
        for platform, place in places.items()
        if platform in wanted and place not in kept
    }
    return bool(new) and archive.write(path, {**content, **kept, **new})


def entries(component: Component) -> dict[str, bytes]:
    """Return the content of a component's FMU but for its binaries, name to bytes."""
    code = sources(component)
    description = model_description.to_xml(
        _description(component), [name for name in sorted(code) if name[-2:] == ".c"]
    )
    content = {"modelDescription.xml": description, **documentation.entries(component, ["rov-cosim"])}
    content.update({f"sources/{name}": text for name, text in code.items()})
    content["sources/recipe.txt"] = zig.recipe().encode()
    return content


def sources(component: Component) -> dict[str, bytes]:
    """Return all that the binary is made of, by file name: generated, hand-written, and the standard's headers."""
    omitted = _CONTINUOUS_ONLY if isinstance(component, Sampled) else _SAMPLED_ONLY
    hand_written = files(__package__) / "c"
    code = {file.name: file.read_bytes() for file in hand_written.iterdir() if file.name not in omitted}
    code.update({name: (files("fmpy") / "c-code" / name).read_bytes() for name in _STANDARD_HEADERS})
    guid = _description(component).guid
    code["component.h"] = c_tables.header(component, tracing.work_size(component)).encode()
    code["component.c"] = c_tables.source(component, guid).encode()
    code["model.c"] = tracing.source(component).encode()
    return code


def _description(component: Component) -> ModelDescription:
    return model_description.describe(
        component, providesDirectionalDerivative=True, canInterpolateInputs=isinstance(component, Continuous)
    )


def _place(component: Component, platform: str) -> str:
    return f"binaries/{platform}/{component.name}{zig.SUFFIXES[platform]}"


def _kept_binaries(path: Path, content: Mapping[str, bytes], places: Iterable[str]) -> dict[str, bytes]:
    """Return the binaries of the FMU at `path` if they were made of just this content, else none."""
    present = archive.present(path)
    binaries = {place: present.pop(place) for place in places if place in present}
    return binaries if present == content else {}
