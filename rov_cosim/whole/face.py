"""The content of a system's FMU: description, page, sources, and a binary for each platform of its elements."""

import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib.resources import files
from urllib.parse import quote

from fmpy.model_description import ModelVariable

from ..errors import UserError
from ..exporters import archive, c_tables, documentation, model_description, zig
from ..exporters.native_export import CHECKSUMS, binary_place, checksums, entries_of_3, hand_written, kept_binaries
from ..ssp.wiring import Element, Wiring
from . import linking, page, tables
from .arrays import arrays, size, terminals
from .description import describe, describe_3
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

Units = Mapping[str, Mapping[str, bytes]]
"""What can be compiled apart, by name: sources by file name."""

_MASTER = f"{__package__.rsplit('.', 1)[0]}.master"


class FaceError(UserError):
    """A system cannot be an FMU here; the message tells why."""


def entries(
    wiring: Wiring,
    present: Mapping[str, bytes],
    progress: Callable[[str], object] = lambda line: None,
    fmi: int = 2,
) -> dict[str, bytes]:
    """Return the content of the FMU of a system, name to bytes.

    The elements, FMUs of FMI 2.0, are linked into its binary where all are native FMUs of this project; else they lie
    in its resources, which FMI 3.0 has no URL of.

    Parameters
    ----------
    wiring : the system.
    present : what the file holds by now; its binaries are taken over if they are of just this content.
    progress : is told in a line what begins.
    fmi : its version of FMI, 2 or 3.

    Raises
    ------
    FaceError : there is no platform for which all elements have binaries, or no compiler, or FMI 3.0 is asked for with
        elements that cannot be linked.
    BuildError : the compiler fails.
    """
    if not zig.is_installed():
        raise FaceError(f"{wiring.name}: one FMU takes a compiler: {zig.CURE}.")
    name, units = identifier(wiring.name), linking.units(wiring.elements)
    layout = laid_out(wiring)
    if fmi == 2:
        content, own, kept = _of_2(layout, name, units)
    elif units is None:
        raise FaceError(f"{wiring.name}: an FMU of FMI 3.0 takes native FMUs of this project alone, of this version.")
    else:
        content, own, kept = _of_3(layout, name, units)
    binaries = kept_binaries(present, content, name, fmi)
    for platform in platforms(wiring, fmi):
        place = binary_place(name, platform)
        if place not in binaries:
            progress(f"compiling {wiring.name} for {platform}")
            objects = partial(linking.objects, kept, progress=progress)
            binaries[place] = zig.shared_library(name, own, platform, objects)
    return {**content, **binaries, CHECKSUMS: checksums(binaries)}


def _of_2(layout: Layout, name: str, units: Units | None) -> tuple[dict[str, bytes], dict[str, bytes], Units]:
    """Return the content but for the binaries, the system's own C, and what it shares with others, by unit."""
    description = describe(layout, name, can_save=units is not None)
    own, kept = sources(layout, description.guid, units)
    code = all_of(own, kept)
    listed = sorted(file for file in code if file.endswith(".c") and "/" not in file)
    content = {
        "modelDescription.xml": model_description.to_xml(description, listed),
        **{f"sources/{file}": text for file, text in code.items()},
        "sources/recipe.txt": zig.recipe().encode(),
        **_pages(layout, [shown.variable for shown in layout.variables], units),
    }
    if units is None:
        elements = {element.name: archive.read(element.fmu) for element in layout.wiring.elements}
        content |= {f"resources/{e}/{file}": data for e, entries in elements.items() for file, data in entries.items()}
    return content, own, kept


def _of_3(layout: Layout, name: str, units: Units) -> tuple[dict[str, bytes], dict[str, bytes], Units]:
    """Return the same for FMI 3.0."""
    variables = arrays(layout)
    description = describe_3(layout, variables, name)
    own, kept = sources(layout, description.guid, units, variables)
    pages = _pages(layout, variables, units)
    return entries_of_3(description, all_of(own, kept), pages, terminals(layout, variables)), own, kept


def sources(
    layout: Layout, guid: str, units: Units | None, variables: Sequence[ModelVariable] | None = None
) -> tuple[dict[str, bytes], Units]:
    """Return all C of a system by file name: what is its own, and what it shares with others, by unit.

    `units` are its elements' of `linking.units`; None if they are to be loaded. `variables` are `arrays` for FMI 3.0.
    """
    code = _written(layout, guid, units is not None, variables)
    functions = "loaded.c" if units is None else "linked.c"
    elements = ("elements.c", "links.c")
    rest = [file for file in sorted(code) if file.endswith(".c") and file not in (functions, *elements, *_LOOP)]
    own = linking.unit("system", "system", rest, code, "The shell of the components around a system.")
    own |= linking.unit("elements", "system", elements, code, "The elements of the system.")
    own |= linking.unit("functions", "system", [functions], code, "Where their functions are.")
    loop = {file: text for file, text in code.items() if file in _LOOP or file in _LOOP_HEADERS}
    return own, {**(units or {}), "loop": linking.unit("loop", "system", _LOOP, loop, "The loop of the master.")}


def all_of(own: Mapping[str, bytes], kept: Units) -> dict[str, bytes]:
    """Return the C of `sources` in one folder."""
    return {**own, **{file: text for unit in kept.values() for file, text in unit.items()}}


def platforms(wiring: Wiring, fmi: int = 2) -> list[str]:
    """Return the platforms of a version of FMI for which all elements have binaries; FaceError if there is none."""
    present = [archive.names(element.fmu) for element in wiring.elements]
    found = [p for p in zig.TARGETS if all(any(n.startswith(f"binaries/{p}/") for n in names) for names in present)]
    if not found:
        known = ", ".join(zig.TARGETS)
        raise FaceError(f"{wiring.name}: there is no platform, of {known}, for which all elements have binaries.")
    return zig.platforms_of(fmi, found)


def identifier(name: str) -> str:
    """Return a system's name as an identifier of C, which the name of a binary has to be."""
    safe = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return safe if safe[:1].isalpha() else f"system_{safe}"


def _written(layout: Layout, guid: str, linked: bool, variables: Sequence[ModelVariable] | None) -> dict[str, bytes]:
    """Return all C of a system but that of its elements, by file name."""
    folder = files(__package__) / "c"
    code = {
        file: text for file, text in hand_written(2 if variables is None else 3).items() if file not in _OF_COMPONENTS
    }
    code |= {file: text for file, text in zig.standard_headers().items() if file in _LOOP_HEADERS}  # of the elements
    if variables is not None:
        sizes = [(variable.name, size(variable)) for variable in variables]
        code["arrays.c"] = c_tables.arrays(layout.wiring.name, sizes).encode()
    code |= {file.name: file.read_bytes() for file in folder.iterdir()}
    code |= {file: (files(_MASTER) / "c" / file).read_bytes() for file in ("loop.c", "loop.h")}
    code |= tables.sources(layout, guid, [_library(element) for element in layout.wiring.elements])
    if linked:
        code["linked.h"] = linking.table(layout.wiring.elements)
    del code["loaded.c" if linked else "linked.c"]
    return code


def _pages(layout: Layout, variables: Sequence[ModelVariable], units: Units | None) -> dict[str, bytes]:
    return documentation.around(page.page(layout, variables, linked=units is not None), "SYS", ["rov-cosim"])


def _library(element: Element) -> tuple[str, str]:
    return element.description.coSimulation.modelIdentifier, quote(element.name)
