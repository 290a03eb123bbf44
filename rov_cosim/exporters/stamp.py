"""A stamp beside each FMU, of all that it was made of, so that one that is current is known without making it again."""

import re
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, distribution, requires, version
from io import BytesIO
from pathlib import Path
from zipfile import ZipFile

from .. import loaded
from ..components import __path__ as components_path

_COMPONENTS, _EXPORTERS = Path(components_path[0]), Path(__file__).parent


def inputs(names: Iterable[str]) -> dict[str, str]:
    """Return for each component a hash of all that its FMUs are made of: sources, pages, and packages."""
    shared = [*_environment(), *_hashes(_EXPORTERS, "**/*"), *_hashes(_COMPONENTS, "*")]
    return {name: _hash("\n".join([*shared, name, *_hashes(_COMPONENTS / name, "**/*")]).encode()) for name in names}


def of(content: Mapping[str, bytes], folders: Iterable[Path]) -> str:
    """Return a hash of what is made of some content by the code in these folders and this one."""
    code = [line for folder in (_EXPORTERS, *folders) for line in _hashes(folder, "**/*")]
    made_of = [f"{name} {_hash(data)}" for name, data in sorted(content.items())]
    return _hash("\n".join([*_environment(), *code, *made_of]).encode())


def holds(path: Path, made_of: str, platforms: Iterable[str]) -> bool:
    """Tell whether `path` is the very FMU that was stamped as made of this, and has binaries for the platforms."""
    try:
        fmu, stamp = path.read_bytes(), _beside(path).read_bytes()
    except OSError:
        return False
    if stamp != _stamp(made_of, fmu):
        return False
    with ZipFile(BytesIO(fmu)) as archive:
        present = {name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")}
    return present.issuperset(platforms)


def put(path: Path, made_of: str, folders: Iterable[Path] = (_COMPONENTS,)) -> None:
    """Stamp the FMU at `path` as made of this, unless that is not certain or there is no place for a stamp.

    `folders` have the code that made it, besides this one.
    """
    # What was edited or installed after this process loaded it may not be what the FMU was made of.
    installed = [Path(str(distribution(name).locate_file(""))) for name in _packages() if _version(name)]
    sources = [file for folder in (_EXPORTERS, *folders) for file in _files(folder, "**/*")]
    if all(_changed(place) < loaded.AT for place in {*installed, *sources}):
        with suppress(OSError):
            _beside(path).write_bytes(_stamp(made_of, path.read_bytes()))


def _beside(path: Path) -> Path:
    return path.with_name(f"{path.name}.stamp")


def _stamp(made_of: str, fmu: bytes) -> bytes:
    return _hash(made_of.encode() + fmu).encode()


@cache  # `put` stamps nothing once a package has changed
def _environment() -> tuple[str, ...]:
    licences = [file for file in distribution("rov-cosim").files or () if file.name == "LICENSE"]
    versions = [f"{name} {_version(name)}" for name in _packages()]
    return (sys.version, *versions, *(_hash(file.read_binary()) for file in licences))


def _packages() -> list[str]:
    """Return this package and those that it requires for both exports."""
    used = [text for text in requires("rov-cosim") or () if not re.search(r"extra == .(?!native)", text)]
    return ["rov-cosim", *(re.split(r"[^\w.-]", text, maxsplit=1)[0] for text in used)]


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _hashes(folder: Path, pattern: str) -> list[str]:
    return [f"{file.relative_to(folder)} {_hash(file.read_bytes())}" for file in _files(folder, pattern)]


def _files(folder: Path, pattern: str) -> list[Path]:
    return sorted(file for file in folder.glob(pattern) if file.is_file() and file.parent.name != "__pycache__")


def _changed(place: Path) -> float:
    """Return when a file or folder changed last; by its inode too, for a copy may bring an old time along."""
    status = place.stat()
    return max(status.st_mtime, status.st_ctime)


def _hash(data: bytes) -> str:
    return sha256(data).hexdigest()
