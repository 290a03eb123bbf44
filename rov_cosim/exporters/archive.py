"""Reproducible archives: the same entries give the same bytes, and an archive that is current is not written again."""

import glob
import os
import tempfile
import time
from collections.abc import Mapping
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

RELEASED = (2026, 11, 21)
"""Date of every entry and of every generated description, so that a rebuild differs in nothing."""

_ABANDONED = 60.0
"""Age in s of an unfinished file that nobody is writing any more: all its content goes into it in one call."""


def write(path: Path, entries: Mapping[str, bytes]) -> bool:
    """Write a zip archive of `entries`, name to content, unless `path` holds just these; tell whether it did.

    Raises
    ------
    OSError : it cannot be written; the message names `path` and the reason.
    """
    if present(path) == dict(entries):
        return False
    put(path, _zipped(entries))
    return True


def put(path: Path, content: bytes) -> None:
    """Write a file as a whole: whoever reads meanwhile sees what was there before, or all of it.

    Raises
    ------
    OSError : it cannot be written; the message names `path` and the reason.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _clear_abandoned(path)
        _replace(path, content)
    except OSError as error:
        raise OSError(f"{path} cannot be written: {error.strerror}") from error


def _zipped(entries: Mapping[str, bytes]) -> bytes:
    zipped = BytesIO()
    with ZipFile(zipped, "w", ZIP_DEFLATED) as archive:
        for name in sorted(entries):
            info = ZipInfo(name, date_time=(*RELEASED, 0, 0, 0))
            info.compress_type = ZIP_DEFLATED
            info.external_attr = 0o644 << 16
            archive.writestr(info, entries[name])
    return zipped.getvalue()


def _replace(path: Path, content: bytes) -> None:
    # Written beside and renamed, so that whoever reads meanwhile never sees half an archive.
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".part")
    unfinished = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        unfinished.chmod(0o644)
        unfinished.replace(path)
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise


def _clear_abandoned(path: Path) -> None:
    """Remove what killed processes left of `path`; the unfinished file of one at work is younger."""
    for unfinished in path.parent.glob(f".{glob.escape(path.name)}.*.part"):
        with suppress(OSError):  # another process may clear as well
            if unfinished.stat().st_mtime < time.time() - _ABANDONED:
                unfinished.unlink()


def read(path: Path) -> dict[str, bytes]:
    """Return all entries of an archive, name to content."""
    with ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist() if not name.endswith("/")}


def names(path: Path) -> list[str]:
    """Return the names of all entries of an archive."""
    with ZipFile(path) as archive:
        return archive.namelist()


def present(path: Path) -> dict[str, bytes]:
    """Return what `read` does, or nothing if there is no sound archive.

    Raises
    ------
    IsADirectoryError : a folder is in the place.
    """
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a folder, where a file belongs; remove it")
    try:
        return read(path)
    except Exception:  # a damaged zip raises nearly anything
        return {}
