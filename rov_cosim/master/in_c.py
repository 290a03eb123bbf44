"""The steps of the master in C: what `exchange` does, over the same memory, without Python between."""

import ctypes
from ctypes import POINTER, Structure, byref, c_double, c_int, c_size_t, c_void_p, cast
from functools import cache
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ..errors import UserError
from ..exporters import archive, zig
from ..exporters.build import project_root
from .exchange import PASSES, Coupling, Exchange, GivenRows, Steps, differing, gauss_seidel, jacobi
from .memory import Watch
from .slave import TYPES, Block, SlaveError

_COUPLINGS: dict[Coupling, int] = {jacobi: 0, gauss_seidel: 1}
_CALLS = {"g": "fmi2Get{}", "s": "fmi2Set{}", "d": "fmi2DoStep"}
_OPTIONS = (*zig.SHARED, "-DLOOP_LIBRARY")


class _Block(Structure):
    _fields_ = (
        ("n", c_size_t),
        ("n_recorded", c_size_t),
        ("recorded", c_void_p),
        ("references", c_void_p),
        ("values", c_void_p),
    )


class _Slave(Structure):
    _fields_ = (
        ("component", c_void_p),
        ("do_step", c_void_p),
        ("get", c_void_p * 4),
        ("set", c_void_p * 3),
        ("outputs", _Block * 4),
        ("inputs", _Block * 4),
        ("parts", c_size_t),
        ("every", c_size_t),
    )


class _Copy(Structure):
    _fields_ = (
        ("sender", c_size_t),
        ("receiver", c_size_t),
        ("type", c_size_t),
        ("n", c_size_t),
        ("from_", c_void_p),
        ("to", c_void_p),
        ("factors", c_void_p),
    )


class _Feed(Structure):
    _fields_ = (("receiver", c_size_t), ("type", c_size_t), ("to", c_size_t))


class _Loop(Structure):
    _fields_ = (
        ("n_slaves", c_size_t),
        ("n_copies", c_size_t),
        ("n_feeds", c_size_t),
        ("coupling", c_size_t),
        ("slaves", POINTER(_Slave)),
        ("copies", POINTER(_Copy)),
        ("feeds", POINTER(_Feed)),
        ("start_time", c_double),
        ("step", c_double),
        ("must_be_finite", c_int),
    )


class _Tables:
    """What goes on between the slaves of an exchange, whatever instances of theirs there are."""

    def __init__(self, exchange: Exchange) -> None:
        self.slaves = (_Slave * len(exchange.slaves))()
        for entry, slave in zip(self.slaves, exchange.slaves, strict=True):
            entry.do_step = _address(slave.fmu.dll, "fmi2DoStep")
            for i, type_ in enumerate(TYPES):
                entry.get[i] = _address(slave.fmu.dll, f"fmi2Get{type_}")
                if i < len(entry.set):
                    entry.set[i] = _address(slave.fmu.dll, f"fmi2Set{type_}")
                entry.outputs[i], entry.inputs[i] = _block(slave.outputs.get(type_)), _block(slave.inputs.get(type_))
        self.copies, self.feeds = (_Copy * len(exchange.copies))(), (_Feed * len(exchange.feeds))()
        for entry, copy in zip(self.copies, exchange.copies, strict=True):
            entry.sender, entry.receiver, entry.type = copy.sender, copy.receiver, TYPES.index(copy.type)
            entry.n = len(copy.to)
            entry.from_, entry.to, entry.factors = (a.ctypes.data for a in (copy.from_, copy.to, copy.factors))
        for entry, feed in zip(self.feeds, exchange.feeds, strict=True):
            entry.receiver, entry.type, entry.to = feed.receiver, TYPES.index(feed.type), feed.to


_TABLES: WeakKeyDictionary[Exchange, _Tables] = WeakKeyDictionary()


class InC:
    """Advances the slaves of an exchange in C, as `exchange.InPython` does in Python."""

    def __init__(self, library: ctypes.CDLL, exchange: Exchange, steps: Steps, watch: Watch) -> None:
        self._library, self._exchange, self._watch = library, exchange, watch
        if (tables := _TABLES.get(exchange)) is None:
            tables = _TABLES[exchange] = _Tables(exchange)
        for entry, slave in zip(tables.slaves, exchange.slaves, strict=True):
            entry.component = slave.fmu.component
            entry.parts, entry.every = slave.rate
        self._loop = _Loop(
            len(tables.slaves),
            len(tables.copies),
            len(tables.feeds),
            _COUPLINGS[steps.coupling],
            tables.slaves,
            tables.copies,
            tables.feeds,
            steps.start_time,
            steps.step,
            steps.must_be_finite,
        )

    def settle(self, given: GivenRows) -> list[str]:
        """As `InPython.settle`."""
        rows = np.zeros(2, self._exchange.whole)
        how = PASSES + self._exchange.n_links, _data(given), rows.itemsize
        found = self._library.settle(byref(self._loop), *how, rows.ctypes.data, byref(self._watch))
        if found < 0:
            raise self._error(None)
        return [] if found else differing(rows)

    def begin(self, row: NDArray[Any]) -> None:
        """As `InPython.begin`."""
        if not self._library.begin(byref(self._loop), row.ctypes.data, byref(self._watch)):
            raise self._error(None)

    def run(self, first: int, count: int, given: GivenRows, spacing: float, rows: NDArray[Any]) -> None:
        """As `InPython.run`."""
        done = self._library.run(
            byref(self._loop), first, count, _data(given), spacing, rows.ctypes.data, byref(self._watch)
        )
        if done < count:
            if not self._watch.call:
                raise KeyboardInterrupt
            raise self._error(first + done)

    def _error(self, step: int | None) -> SlaveError:
        slave, call = self._exchange.slaves[self._watch.slave], chr(self._watch.call)
        type_ = TYPES[self._watch.type]
        if call in _CALLS:
            error: SlaveError = slave.failed(_CALLS[call].format(type_), self._watch.status)
        else:
            error = slave.not_finite({"n": slave.outputs, "f": slave.inputs}[call]["Real"], self._watch.variable)
        error.step = step
        return error


@cache
def _library() -> ctypes.CDLL | None:
    """Return the compiled loop, or None where there is no compiler for this machine; BuildError if it fails."""
    source = {name: (files(__package__) / "c" / name).read_bytes() for name in ("loop.c", "loop.h")}
    try:
        zig.host_target()
        recipe = f"{zig.recipe()}{_OPTIONS}"
    except (UserError, ModuleNotFoundError):
        return None
    try:
        path = _built(source, recipe)
    except OSError:  # there is no place for it
        return None
    loaded = ctypes.CDLL(str(path))
    loaded.settle.restype = loaded.begin.restype = c_int
    loaded.settle.argtypes = (c_void_p, c_size_t, c_void_p, c_size_t, c_void_p, c_void_p)
    loaded.begin.argtypes = (c_void_p, c_void_p, c_void_p)
    loaded.run.restype = c_size_t
    loaded.run.argtypes = (c_void_p, c_size_t, c_size_t, c_void_p, c_double, c_void_p, c_void_p)
    return loaded


def in_c(exchange: Exchange, steps: Steps, watch: Watch) -> InC | None:
    """Return what steps in C; None for a coupling that it does not know, or where there is no compiler."""
    library = _library() if steps.coupling in _COUPLINGS else None
    return InC(library, exchange, steps, watch) if library else None


def _built(source: dict[str, bytes], recipe: str) -> Path:
    """Return the shared library of the loop, named by what it is made of, so that it is never replaced while in use."""
    made_of = sha256(b"".join([*source.values(), recipe.encode()])).hexdigest()[:12]
    path = project_root() / "build" / "native" / f"loop-{made_of}{zig.SUFFIXES[zig.host_platform()]}"
    if not path.is_file():
        sources = {**source, **zig.standard_headers()}
        archive.put(path, zig.compiled(sources, zig.host_target(), path.name, _OPTIONS))
    return path


def _block(block: Block | None) -> _Block:
    if block is None:
        return _Block()
    references, places = cast(block.references, c_void_p), block.recorded
    return _Block(len(block.names), len(places), places.ctypes.data, references, block.values.ctypes.data)


def _data(array: NDArray[np.float64] | None) -> int | None:
    return None if array is None else array.ctypes.data


def _address(dll: ctypes.CDLL, function: str) -> int | None:
    return cast(dll[function], c_void_p).value
