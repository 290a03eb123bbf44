"""A whole system as a module of WebAssembly: the C of its FMU, behind a few functions for a page."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from hashlib import sha256
from importlib.resources import files

from ..errors import UserError
from ..exporters import archive, zig
from ..exporters.build import project_root
from ..ssp.wiring import Wiring
from ..whole import face, linking
from ..whole.description import describe
from ..whole.layout import Layout, laid_out
from . import terms

TARGET = "wasm32-wasi"
OPTIONS = ("-mexec-model=reactor", "-s")
"""It has functions to be called, in the place of a main, and no names for a debugger."""


def modules(
    wirings: Sequence[Wiring], progress: Callable[[str], object] = lambda line: None
) -> list[tuple[Layout, bytes]]:
    """Return each system's variables and its module, which imports nothing; it is kept until its sources change.

    A module exports `memory` and the functions of c/live.c.

    Raises
    ------
    UserError : an element is no native FMU of this project.
    BuildError : the compiler fails.
    """
    layouts = {wiring.name: laid_out(wiring) for wiring in wirings}
    made_of = {wiring.name: sources(wiring, layouts[wiring.name]) for wiring in wirings}
    shared = {name: unit for _, units in made_of.values() for name, unit in units.items()}
    objects = linking.objects(shared, TARGET, progress)

    def linked(name: str) -> tuple[Layout, bytes]:
        own, units = made_of[name]
        parts = own | {f"{unit}.o": objects[f"{unit}.o"] for unit in units}
        made = [zig.recipe(), *zig.arguments(TARGET, "live.wasm", OPTIONS, ())]
        made += [f"{file} {sha256(data).hexdigest()}" for file, data in parts.items()]
        digest = sha256("\n".join(made).encode()).hexdigest()[:16]
        kept = project_root() / "build" / "objects" / f"live-{digest}.wasm"
        if not kept.is_file():
            progress(f"linking {name} for {TARGET}")
            archive.put(kept, zig.compiled(parts, TARGET, "live.wasm", OPTIONS))
        return layouts[name], kept.read_bytes()

    with ThreadPoolExecutor(zig.JOBS) as pool:
        return list(pool.map(linked, made_of))


def sources(wiring: Wiring, layout: Layout) -> tuple[dict[str, bytes], face.Units]:
    """Return all C of a module as `face.sources` does; UserError if an element is no native FMU of this project."""
    units = linking.units(wiring.elements)
    if units is None:
        raise UserError(f"{wiring.name}: only systems of this project's native FMUs run in a page.")
    guid = describe(layout, face.identifier(wiring.name), can_save=True).guid
    own, shared = face.sources(layout, guid, units)
    live = {"live.c": (files(__package__) / "c" / "live.c").read_bytes()}
    code = {**live, "lyapunov.h": terms.table(layout)}
    own |= linking.unit("live", "system", live, code, "The system behind a few functions.")
    return own, {**shared, "lyapunov": terms.unit()}
