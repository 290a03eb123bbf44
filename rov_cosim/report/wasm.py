"""A whole system as a module of WebAssembly: the C of its FMU, behind a few functions for a page."""

from collections.abc import Callable, Mapping
from hashlib import sha256
from importlib.resources import files

from ..errors import UserError
from ..exporters import archive, zig
from ..exporters.build import project_root
from ..ssp.wiring import Wiring
from ..whole import face, linking
from ..whole.description import describe
from ..whole.layout import Layout, laid_out

TARGET = "wasm32-wasi"
OPTIONS = ("-mexec-model=reactor", "-s")
"""It has functions to be called, in the place of a main, and no names for a debugger."""


def module(wiring: Wiring, progress: Callable[[str], object] = lambda line: None) -> tuple[Layout, bytes]:
    """Return a system's variables and its module, which imports nothing; it is kept until its sources change.

    The module exports `memory` and the functions of c/live.c.

    Raises
    ------
    UserError : an element is no native FMU of this project.
    BuildError : the compiler fails.
    """
    layout = laid_out(wiring)
    own, shared = sources(wiring, layout)
    objects = linking.objects(shared, TARGET, progress)
    parts = [zig.recipe(), *zig.arguments(TARGET, "live.wasm", OPTIONS, ())]
    parts += [f"{name} {sha256(data).hexdigest()}" for name, data in {**own, **objects}.items()]
    digest = sha256("\n".join(parts).encode()).hexdigest()[:16]
    kept = project_root() / "build" / "objects" / f"live-{digest}.wasm"
    if not kept.is_file():
        progress(f"linking {wiring.name} for {TARGET}")
        archive.put(kept, zig.compiled({**own, **objects}, TARGET, "live.wasm", OPTIONS))
    return layout, kept.read_bytes()


def sources(wiring: Wiring, layout: Layout) -> tuple[dict[str, bytes], dict[str, Mapping[str, bytes]]]:
    """Return all C of a module as `face.sources` does; UserError if an element is no native FMU of this project."""
    units = linking.units(wiring.elements)
    if units is None:
        raise UserError(f"{wiring.name}: only systems of this project's native FMUs run in a page.")
    guid = describe(layout, face.identifier(wiring.name), can_save=True).guid
    own, shared = face.sources(layout, guid, units)
    live = {"live.c": (files(__package__) / "c" / "live.c").read_bytes()}
    return own | linking.unit("live", "system", live, live, "The system behind a few functions."), shared
