"""The content of a system's FMU: description, page, sources, and a binary for each platform of its elements."""

import re
from collections.abc import Callable, Mapping
from functools import partial
from importlib.resources import files
from urllib.parse import quote

from ..errors import UserError
from ..exporters import archive, documentation, model_description, zig
from ..exporters.native_export import CHECKSUMS, binary_place, checksums, hand_written, kept_binaries
from ..ssp.wiring import Element, Wiring
from . import linking, page, tables
from .description import describe
from .layout import Layout, laid_out

_OF_COMPONENTS = {
    "instance.c",
    "no_parts.c",
    "state.h",
    "sampled.c",
    "continuous.c",
    "stepping.h",
    "noise.c",
    "noise.h",
}
"""What of the components' shell is for them alone."""

_LOOP = ("loop.c", "message.c")
_LOOP_HEADERS = ("loop.h", "message.h", "hidden.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h")
"""What is the same in every system, and what that includes."""

_MASTER = f"{__package__.rsplit('.', 1)[0]}.master"


class FaceError(UserError):
    """A system cannot be an FMU here; the message tells why."""


def entries(
    wiring: Wiring, present: Mapping[str, bytes], progress: Callable[[str], object] = lambda line: None
) -> dict[str, bytes]:
    """Return the content of the FMU of a system, name to bytes.

    The elements are linked into its binary where all are native FMUs of this project; else they lie in its resources.

    Parameters
    ----------
    wiring : the system.
    present : what the file holds by now; its binaries are taken over if they are of just this content.
    progress : is told in a line what begins.

    Raises
    ------
    FaceError : there is no platform for which all elements have binaries, or no compiler.
    BuildError : the compiler fails.
    """
    if not zig.is_installed():
        raise FaceError(f"{wiring.name}: one FMU takes a compiler: pip install 'rov-cosim[native]'.")
    name, units = identifier(wiring.name), linking.units(wiring.elements)
    layout = laid_out(wiring)
    description = describe(layout, name, can_save=units is not None)
    own, kept = sources(layout, description.guid, units)
    code = {**own, **{file: text for unit in kept.values() for file, text in unit.items()}}
    listed = sorted(file for file in code if file.endswith(".c") and "/" not in file)
    content = {
        "modelDescription.xml": model_description.to_xml(description, listed),
        **{f"sources/{file}": text for file, text in code.items()},
        "sources/recipe.txt": zig.recipe().encode(),
        **documentation.around(page.page(layout, linked=units is not None), "SYS", ["rov-cosim"]),
    }
    if units is None:
        content |= {
            f"resources/{e.name}/{file}": data for e in wiring.elements for file, data in archive.read(e.fmu).items()
        }
    binaries = kept_binaries(present, content, name)
    for platform in platforms(wiring):
        place = binary_place(name, platform)
        if place not in binaries:
            progress(f"compiling {wiring.name} for {platform}")
            objects = partial(linking.objects, kept, progress=progress)
            binaries[place] = zig.shared_library(name, own, platform, objects)
    return {**content, **binaries, CHECKSUMS: checksums(binaries)}


def sources(
    layout: Layout, guid: str, units: Mapping[str, Mapping[str, bytes]] | None
) -> tuple[dict[str, bytes], dict[str, Mapping[str, bytes]]]:
    """Return all C of a system by file name: what is its own, and what it shares with others, by unit.

    `units` are its elements' of `linking.units`; None if they are to be loaded.
    """
    code = _written(layout, guid, linked=units is not None)
    functions = "loaded.c" if units is None else "linked.c"
    elements = ("elements.c", "links.c")
    rest = [file for file in sorted(code) if file.endswith(".c") and file not in (functions, *elements, *_LOOP)]
    own = linking.unit("system", "system", rest, code, "The shell of the components around a system.")
    own |= linking.unit("elements", "system", elements, code, "The elements of the system.")
    own |= linking.unit("functions", "system", [functions], code, "Where their functions are.")
    loop = {file: text for file, text in code.items() if file in _LOOP or file in _LOOP_HEADERS}
    return own, {**(units or {}), "loop": linking.unit("loop", "system", _LOOP, loop, "The loop of the master.")}


def platforms(wiring: Wiring) -> list[str]:
    """Return the platforms for which all elements have binaries; FaceError if there is none."""
    present = [archive.names(element.fmu) for element in wiring.elements]
    found = [p for p in zig.TARGETS if all(any(n.startswith(f"binaries/{p}/") for n in names) for names in present)]
    if not found:
        known = ", ".join(zig.TARGETS)
        raise FaceError(f"{wiring.name}: there is no platform, of {known}, for which all elements have binaries.")
    return found


def identifier(name: str) -> str:
    """Return a system's name as an identifier of C, which the name of a binary has to be."""
    safe = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return safe if safe[:1].isalpha() else f"system_{safe}"


def _written(layout: Layout, guid: str, linked: bool) -> dict[str, bytes]:
    """Return all C of a system but that of its elements, by file name."""
    folder = files(__package__) / "c"
    code = {file: text for file, text in hand_written().items() if file not in _OF_COMPONENTS}
    code |= {file.name: file.read_bytes() for file in folder.iterdir()}
    code |= {file: (files(_MASTER) / "c" / file).read_bytes() for file in ("loop.c", "loop.h")}
    code |= tables.sources(layout, guid, [_library(element) for element in layout.wiring.elements])
    if linked:
        code["linked.h"] = linking.table(layout.wiring.elements)
    del code["loaded.c" if linked else "linked.c"]
    return code


def _library(element: Element) -> tuple[str, str]:
    return element.description.coSimulation.modelIdentifier, quote(element.name)
