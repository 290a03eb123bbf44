"""Elements as C to be linked into one binary: the sources in their FMUs, every global name marked as their own."""

import re
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from hashlib import sha256

from ..exporters import archive, zig
from ..exporters.build import project_root
from ..exporters.model_description import GENERATION_TOOL
from ..ssp.wiring import Element

_SYSTEM_HEADERS = ("math", "stdarg", "stddef", "stdint", "stdio", "stdlib", "string")
_DECLARED = re.compile(r"^(?!typedef|enum|struct|static|return|else)[A-Za-z][\w *]*[ *](\w+)(?:\(|\[|;| =)", re.M)
_MACRO = re.compile(r"^ *# *define (\w+)", re.M)
_ENTRY = "#define fmi2FullName(name) name"
_EXPORTED = re.compile(r"#define FMI2_Export .+")


def units(elements: Iterable[Element]) -> dict[str, dict[str, bytes]] | None:
    """Return the sources of each component among the elements, a C file and what it includes, by its name.

    None if some element is not a native FMU of this very version of the project, or two differ under one name.
    """
    found: dict[str, dict[str, bytes]] = {}
    for element in elements:
        made = _unit(element)
        name = element.description.coSimulation.modelIdentifier
        if made is None or found.setdefault(name, made) != made:
            return None
    return found


def table(elements: Iterable[Element]) -> bytes:
    """Return linked.h, which names the functions of each element."""
    names = [element.description.coSimulation.modelIdentifier for element in elements]
    text = "/* The functions of the elements, under the names of their components. */\n"
    for name in dict.fromkeys(names):
        text += f"\n#define DECLARE(function) fmi2##function##TYPE {name}_fmi2##function;\nEACH_FUNCTION(DECLARE)\n"
        text += f"#undef DECLARE\n#define NAME(function) {name}_fmi2##function,\n"
        text += f"static const Functions of_{name} = {{EACH_FUNCTION(NAME)}};\n#undef NAME\n"
    listed = ", ".join(f"&of_{name}" for name in names)
    return f"{text}\nstatic const Functions *const linked[] = {{{listed}}};\n".encode()


def _unit(element: Element) -> dict[str, bytes] | None:
    if element.description.generationTool != GENERATION_TOOL:
        return None
    content = archive.read(element.fmu)
    if content.get("sources/recipe.txt") != zig.recipe().encode() or "sources/fmi2Functions.h" not in content:
        return None  # of another compiler, or of a whole system
    name = element.description.coSimulation.modelIdentifier
    code = {
        place.removeprefix("sources/"): data
        for place, data in content.items()
        if place.startswith("sources/") and place.endswith((".c", ".h"))
    }
    own = {file: text for file, text in code.items() if not file.startswith("fmi2") or file.endswith(".c")}
    words = {word for text in own.values() for word in _DECLARED.findall(text.decode())}
    macros = {word for text in own.values() for word in _MACRO.findall(text.decode())}
    renamed = sorted(word for word in words - macros if not word.startswith("fmi2"))
    header = code["fmi2Functions.h"].decode()
    assert _ENTRY in header
    # The header's own way to a prefix, which FMPy's copy has taken out; and the functions are not for outside.
    header = _EXPORTED.sub("#define FMI2_Export", header.replace(_ENTRY, f"#define fmi2FullName(name) {name}_##name"))
    code["fmi2Functions.h"] = header.encode()
    marks = ["#define CASADI_CODEGEN_PREFIX", f"#define CODEGEN_PREFIX {name}_model_"]
    marks += [f"#define {word} {name}_{word}" for word in renamed]
    files = sorted(file for file in code if file.endswith(".c"))
    return unit(name, name, files, code, f"{name}, whole: every global name in it is marked as its own.", marks)


def unit(
    name: str, folder: str, files: Iterable[str], code: Mapping[str, bytes], title: str, before: Iterable[str] = ()
) -> dict[str, bytes]:
    """Return sources to be compiled as one: NAME.c, which includes these files of `code`, and all of it in a folder."""
    lines = [
        f"/* {title} */",
        *(f"#include <{header}.h>" for header in _SYSTEM_HEADERS),
        "",
        *before,
        *(f'#include "{folder}/{file}"' for file in files),
    ]
    return {f"{name}.c": "\n".join([*lines, ""]).encode(), **{f"{folder}/{file}": text for file, text in code.items()}}


def objects(
    units: Mapping[str, Mapping[str, bytes]], target: str, progress: Callable[[str], object] = lambda line: None
) -> dict[str, bytes]:
    """Return the object of each unit for a target, by file name; they are kept, for all systems share them.

    Raises
    ------
    BuildError : the compiler fails.
    """
    folder = project_root() / "build" / "objects"

    def made(name: str) -> bytes:
        unit = units[name]
        made_of = sha256(
            b"\0".join(
                [
                    zig.recipe().encode(),
                    repr(zig.arguments(target, name, zig.OBJECT, ())).encode(),
                    *(part for file in unit.items() for part in _bytes(file)),
                ]
            )
        )
        kept = folder / f"{name}-{target}-{made_of.hexdigest()[:16]}.o"
        if not kept.is_file():
            progress(f"compiling {name} to be linked, for {target}")
            archive.put(kept, zig.compiled(unit, target, f"{name}.o", zig.OBJECT))
        return kept.read_bytes()

    with ThreadPoolExecutor(zig.JOBS) as pool:
        return {f"{name}.o": content for name, content in zip(units, pool.map(made, units), strict=True)}


def _bytes(file: tuple[str, bytes]) -> tuple[bytes, bytes]:
    return file[0].encode(), file[1]
