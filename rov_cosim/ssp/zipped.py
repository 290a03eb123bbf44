"""Zip archives from anywhere, SSP or FMU: opened and unpacked, with what is wrong with one said in a line."""

import shutil
import zlib
from collections.abc import Container, Iterator
from contextlib import contextmanager
from lzma import LZMAError
from pathlib import Path, PurePosixPath
from zipfile import BadZipFile, ZipFile, ZipInfo, is_zipfile

from ..errors import UserError

MOST_ENTRIES = 100_000
MOST_RATIO = 100
"""Unpacked over packed, beyond which an archive of more than `_SMALL` is a bomb."""
_SMALL = 2**28
_LONGEST_NAME = 200
"""Bytes of a part of a path; most file systems take 255."""
_LFS_POINTER = b"version https://git-lfs"


class ZipError(UserError):
    """An archive that cannot be used; the message goes on from its name, for example: is encrypted."""


@contextmanager
def opened(path: Path) -> Iterator[ZipFile]:
    """Yield an archive whose entries are plain; an error while it is read is a ZipError as well.

    Raises
    ------
    ZipError : it is none, is encrypted or a bomb, is damaged, or has names that lead out of a folder.
    """
    if not path.exists():
        raise ZipError("does not exist.")
    if path.is_dir():
        raise ZipError("is a folder; expected a zip archive of what such a folder holds.")
    try:
        if not is_zipfile(path):
            raise ZipError(_no_zip(path))
        with ZipFile(path) as archive:
            if problem := _problem(archive):
                raise ZipError(problem)
            yield archive
    except UserError:
        raise
    except OSError as error:
        raise ZipError(f"cannot be read: {error.strerror or error}.") from None
    except (BadZipFile, EOFError, LZMAError, RuntimeError, ValueError, zlib.error) as error:
        said = " ".join(str(error).split()) or type(error).__name__
        raise ZipError(f"is damaged, or packed as it cannot be read here ({said}): copy or zip it again.") from None


def unpack(path: Path, folder: Path, without: Container[str] = ()) -> None:
    """Unpack an archive into a folder, without some of its own; backslashes in names part folders, as some tools mean.

    Raises
    ------
    ZipError : as in `opened`, or the disk has no place for it.
    """
    with opened(path) as archive:
        size = sum(info.file_size for info in archive.infolist())
        folder.mkdir(parents=True, exist_ok=True)
        if size > shutil.disk_usage(folder).free:
            gigabytes = f"{size / 2**30:.3g} GB"
            raise ZipError(f"holds {gigabytes}, more than is free in the temporary folder: set TMPDIR to another.")
        for info in archive.infolist():
            where = place(info)
            if where.parts[:1] and where.parts[0] in without:
                continue
            target = folder / where
            if info.is_dir() or info.filename.endswith("\\"):
                target.mkdir(parents=True, exist_ok=True)
                continue
            target.parent.mkdir(parents=True, exist_ok=True)
            with archive.open(info) as source, target.open("wb") as file:
                shutil.copyfileobj(source, file)


def place(info: ZipInfo) -> PurePosixPath:
    """Return where an entry belongs in the folder that its archive stands for."""
    return PurePosixPath(info.filename.replace("\\", "/"))


def _problem(archive: ZipFile) -> str:
    """Return what keeps an archive from being used, or nothing."""
    entries = archive.infolist()
    size, packed = (sum(getattr(info, of) for info in entries) for of in ("file_size", "compress_size"))
    if any(info.flag_bits & 1 for info in entries):
        return "is encrypted: unpack it with its password, and zip what it holds without one."
    if len(entries) > MOST_ENTRIES:
        return f"has {len(entries)} entries; expected at most {MOST_ENTRIES}."
    if size > _SMALL and size > MOST_RATIO * packed:
        return (
            f"unpacks {packed / 2**20:.3g} MB to {size / 2**20:.3g} MB, as zip bombs do: "
            "unpack what you trust by hand, and zip it without compression."
        )
    for info in entries:
        path = place(info)
        if path.is_absolute() or ".." in path.parts or ":" in "".join(path.parts[:1]):
            return f"holds {info.filename!r:.80}, which leads out of its folder: zip it anew."
        if any(len(part.encode("utf-8", "replace")) > _LONGEST_NAME for part in path.parts):
            return f"holds a name of {len(info.filename)} characters, {info.filename[:40]}...: shorten it."
    return ""


def _no_zip(path: Path) -> str:
    with path.open("rb") as file:
        begin = file.read(len(_LFS_POINTER))
    if begin == _LFS_POINTER:
        return "is a pointer of Git LFS, not the file itself: get that by `git lfs pull`."
    return "is empty: copy it again." if not begin else "is not a zip archive: build or copy it again."
