"""The steps of the master in C: the copies and calls of `exchange` over the same memory, without Python between."""

import ctypes
from ctypes import POINTER, Structure, byref, c_double, c_int, c_size_t, c_void_p, cast
from functools import cache
from hashlib import sha256
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import UserError
from ..exporters import archive, zig
from ..exporters.build import project_root
from .exchange import Advance, Coupling, Exchange, gauss_seidel, jacobi
from .slave import TYPES, Block, SlaveError

_COUPLINGS: dict[Coupling, int] = {jacobi: 0, gauss_seidel: 1}
_CALLS = {"g": "fmi2Get{}", "s": "fmi2Set{}", "d": "fmi2DoStep"}


class _Block(Structure):
    _fields_ = (("n", c_size_t), ("references", c_void_p), ("values", c_void_p))


class _Slave(Structure):
    _fields_ = (
        ("component", c_void_p),
        ("do_step", c_void_p),
        ("get", c_void_p * 3),
        ("set", c_void_p * 3),
        ("outputs", _Block * 3),
        ("inputs", _Block * 3),
    )


class _Copy(Structure):
    _fields_ = (
        ("receiver", c_size_t),
        ("type", c_size_t),
        ("n", c_size_t),
        ("from_", c_void_p),
        ("to", c_void_p),
        ("factors", c_void_p),
        ("source", c_void_p),
        ("target", c_void_p),
    )


class _Loop(Structure):
    _fields_ = (
        ("n_slaves", c_size_t),
        ("n_copies", c_size_t),
        ("coupling", c_size_t),
        ("slaves", POINTER(_Slave)),
        ("copies", POINTER(_Copy)),
        ("start_time", c_double),
        ("step", c_double),
    )


class _Failure(Structure):
    _fields_ = (("slave", c_size_t), ("step", c_size_t), ("type", c_size_t), ("call", c_int), ("status", c_int))


def in_c(exchange: Exchange, coupling: Coupling, start_time: float, step: float) -> Advance | None:
    """Return what `exchange.in_python` does, in C; None for another coupling, or where there is no compiler."""
    library = _library() if coupling in _COUPLINGS else None
    if library is None:
        return None
    slaves = (_Slave * len(exchange.slaves))()
    for entry, slave in zip(slaves, exchange.slaves, strict=True):
        entry.component = slave.fmu.component
        entry.do_step = _address(slave.fmu.dll, "fmi2DoStep")
        for i, type_ in enumerate(TYPES):
            entry.get[i], entry.set[i] = (_address(slave.fmu.dll, f"fmi2{way}{type_}") for way in ("Get", "Set"))
            entry.outputs[i], entry.inputs[i] = _block(slave.outputs.get(type_)), _block(slave.inputs.get(type_))
    copies, kept = (_Copy * len(exchange.copies))(), []
    for entry, copy in zip(copies, exchange.copies, strict=True):
        places = [np.ascontiguousarray(indices, dtype=np.uintp) for indices in (copy.from_, copy.to)]
        entry.receiver, entry.type, entry.n = copy.receiver, TYPES.index(copy.type), len(copy.to)
        entry.from_, entry.to = (indices.ctypes.data for indices in places)
        entry.factors, entry.source, entry.target = (a.ctypes.data for a in (copy.factors, copy.source, copy.target))
        kept.append(places)
    loop = _Loop(len(slaves), len(copies), _COUPLINGS[coupling], slaves, copies, start_time, step)

    def advance(first: int, rows: NDArray[np.float64], kept: object = kept) -> None:
        failure = _Failure()
        done = library.run(byref(loop), first, len(rows), rows.ctypes.data, byref(failure))
        if done < len(rows):
            call = _CALLS[chr(failure.call)].format(TYPES[failure.type])
            raise SlaveError(exchange.slaves[failure.slave], call, failure.status, first + done)

    return advance


def _built(source: bytes) -> Path:
    """Return the shared library of the loop, named by what it is made of, so that it is never replaced while in use."""
    made_of = sha256(source + zig.recipe().encode()).hexdigest()[:12]
    path = project_root() / "build" / "native" / f"loop-{made_of}{zig.SUFFIXES[zig.host_platform()]}"
    if not path.is_file():
        sources = {"loop.c": source, **zig.standard_headers()}
        archive.put(path, zig.compiled(sources, zig.host_target(), path.name, zig.SHARED))
    return path


def _block(block: Block | None) -> _Block:
    if block is None:
        return _Block()
    return _Block(len(block.names), cast(block.references, c_void_p), block.values.ctypes.data)


def _address(library: ctypes.CDLL, function: str) -> int | None:
    return cast(library[function], c_void_p).value


@cache
def _library() -> ctypes.CDLL | None:
    """Return the compiled loop, or None where there is no compiler for this machine."""
    source = (files(__package__) / "c" / "loop.c").read_bytes()
    try:
        path = _built(source)
    except (UserError, ModuleNotFoundError, OSError):
        return None
    library = ctypes.CDLL(str(path))
    library.run.restype = c_size_t
    library.run.argtypes = (c_void_p, c_size_t, c_size_t, c_void_p, c_void_p)
    return library
