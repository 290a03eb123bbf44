"""Reproducible archives: the same entries give the same bytes, and an archive that is current is not written again."""

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

RELEASED = (2026, 11, 21)
"""Date of every entry and of every generated description, so that a rebuild differs in nothing."""


def write(path: Path, entries: Mapping[str, bytes]) -> bool:
    """Write a zip archive of `entries`, name to content, unless `path` holds just these; tell whether it did."""
    if present(path) == dict(entries):
        return False
    path.parent.mkdir(parents=True, exist_ok=True)
    # Written beside and renamed, so that whoever reads meanwhile never sees half an archive.
    handle, unfinished = tempfile.mkstemp(dir=path.parent, prefix=path.name)
    os.close(handle)
    try:
        with ZipFile(unfinished, "w", ZIP_DEFLATED) as archive:
            for name in sorted(entries):
                info = ZipInfo(name, date_time=(*RELEASED, 0, 0, 0))
                info.compress_type = ZIP_DEFLATED
                info.external_attr = 0o644 << 16
                archive.writestr(info, entries[name])
        os.chmod(unfinished, 0o644)
        os.replace(unfinished, path)
    except BaseException:
        os.unlink(unfinished)
        raise
    return True


def read(path: Path) -> dict[str, bytes]:
    """Return all entries of an archive, name to content."""
    with ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist() if not name.endswith("/")}


def present(path: Path) -> dict[str, bytes]:
    """Return what `read` does, or nothing if there is no sound archive."""
    try:
        return read(path)
    except Exception:  # a damaged zip raises nearly anything
        return {}
