"""Where a run keeps its results and tells where it is: in this process, or in files that another reads along."""

import json
import mmap
from ctypes import Structure, c_int, c_size_t
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import numpy as np
from numpy.typing import NDArray

_DTYPE = "dtype.json"
LARGEST = 256_000_000
"""Bytes of results beyond which they are kept in a temporary file, not in memory."""


class Watch(Structure):
    """Where a run is, and the word for it to stop; as in c/loop.h, and by which other letters `slave.CALLS` tells.

    Of `call` besides: ``l`` the library is loaded, ``u`` unloaded, ``i`` instantiated, ``F`` freed.
    """

    _fields_ = (
        ("step", c_size_t),
        ("recorded", c_size_t),
        ("slave", c_size_t),
        ("type", c_size_t),
        ("variable", c_size_t),
        ("call", c_int),
        ("status", c_int),
        ("stop", c_int),
    )


class Memory:
    """The memory of one run; in files of a folder if it is given, where another process sees it."""

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder
        self.watch = Watch()
        if folder:
            self.watch = Watch.from_buffer(_mapped(folder / "watch", np.dtype(Watch).itemsize))

    def rows(self, n: int, dtype: np.dtype[Any]) -> NDArray[Any]:
        """Return room for so many rows."""
        size = n * dtype.itemsize
        if self._folder:
            (self._folder / _DTYPE).write_text(json.dumps(dtype.descr), encoding="utf-8")
            return np.frombuffer(_mapped(self._folder / "rows", max(size, 1)), dtype, n)
        if size <= LARGEST:
            return np.zeros(n, dtype)
        with TemporaryFile(prefix="rov_cosim_") as file:
            file.truncate(size)
            return np.frombuffer(mmap.mmap(file.fileno(), size), dtype, n)


def seen_watch(folder: Path) -> Watch:
    """Return where the run is that keeps its memory in a folder; FileNotFoundError or ValueError before it began."""
    return Watch.from_buffer(_mapped(folder / "watch", 0))


def seen_rows(folder: Path) -> NDArray[Any]:
    """Return all rows of the run that keeps its memory in a folder, those to come too."""
    try:
        fields = json.loads((folder / _DTYPE).read_text(encoding="utf-8"))
        return np.frombuffer(_mapped(folder / "rows", 0), [tuple(field) for field in fields])
    except (FileNotFoundError, ValueError):  # not there yet, or not whole
        return np.zeros(0, [("time", np.float64)])


def _mapped(path: Path, size: int) -> mmap.mmap:
    """Return a file's memory; of an existing one all of it, if no size is given."""
    with path.open("r+b" if not size else "w+b") as file:
        if size:
            file.truncate(size)
        mapped = mmap.mmap(file.fileno(), size)
    if size and hasattr(mmap, "MADV_DONTFORK"):  # an FMU that forks would write each row twice
        mapped.madvise(mmap.MADV_DONTFORK)
    return mapped
