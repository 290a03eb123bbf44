"""What a release consists of and was made by: checksums, a bill of materials (CycloneDX), and pip's constraints."""

import platform
import zlib
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from hashlib import sha256
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path
from uuid import NAMESPACE_URL, uuid5

from cyclonedx.model import HashAlgorithm, HashType, Property
from cyclonedx.model.bom import Bom, BomMetaData
from cyclonedx.model.component import Component, ComponentScope, ComponentType
from cyclonedx.model.license import LicenseExpression
from cyclonedx.model.tool import ToolRepository
from cyclonedx.output.json import JsonV1Dot6
from packageurl import PackageURL
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from ..exporters.archive import RELEASED
from ..report.bundle import Library, libraries
from ..systems.fleet import CONTROLLERS
from .source import ReleaseError

CHECKSUMS, BILL, CONSTRAINTS = "SHA256SUMS", "sbom.cdx.json", "constraints.txt"
_OURS = "rov-cosim"


def write(folder: Path, commit: str) -> None:
    """Write checksums, bill and constraints of what lies in a folder.

    Raises
    ------
    ReleaseError : a package is not installed.
    """
    made_by = _closure(f"{_OURS}[native,release]")
    lines = sorted(f"{name}=={package.version}\n" for name, package in made_by.items() if name != _OURS)
    _put(folder / CONSTRAINTS, "".join(lines))
    _put(folder / BILL, _bill(checksums(folder), commit, made_by))
    _put(folder / CHECKSUMS, "".join(f"{digest}  {name}\n" for name, digest in checksums(folder).items()))


def checksums(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of every file below a folder by its name there, in order."""
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    return {file.relative_to(folder).as_posix(): sha256(file.read_bytes()).hexdigest() for file in files}


def _bill(files: Mapping[str, str], commit: str, made_by: Mapping[str, Distribution]) -> str:
    needed = _closure(_OURS)
    ours = _package(made_by[_OURS], ComponentType.APPLICATION)
    packages = [
        _package(package, scope=ComponentScope.REQUIRED if name in needed else ComponentScope.EXCLUDED)
        for name, package in made_by.items()
        if name != _OURS
    ]
    parts = [
        Component(
            name=name,
            type=ComponentType.FILE,
            bom_ref=name,
            hashes=[HashType(alg=HashAlgorithm.SHA_256, content=digest)],
        )
        for name, digest in files.items()
    ]
    with_page = tuple(f"kits/{component.name}-" for component in CONTROLLERS.values())
    held = [_library(library) for library in libraries() if any(name.startswith(with_page) for name in files)]
    tools = [
        Component(name="Python", type=ComponentType.APPLICATION, version=platform.python_version()),
        Component(name="zlib", type=ComponentType.LIBRARY, version=zlib.ZLIB_RUNTIME_VERSION),
    ]
    bom = Bom(
        components=[*parts, *packages, *held],
        serial_number=uuid5(NAMESPACE_URL, f"{_OURS} {commit} {files}"),
        metadata=BomMetaData(
            component=ours,
            timestamp=datetime(*RELEASED, tzinfo=UTC),
            tools=ToolRepository(components=tools),
            properties=[Property(name=f"{_OURS}:commit", value=commit)],
        ),
    )
    by_name = dict(zip((name for name in made_by if name != _OURS), packages, strict=True))
    bom.register_dependency(ours, [*parts, *(by_name[name] for name in _direct(made_by[_OURS], ())), *held])
    for name, component in by_name.items():
        bom.register_dependency(component, [by_name[n] for n in _direct(made_by[name], ()) if n in by_name])
    return JsonV1Dot6(bom).output_as_string(indent=2) + "\n"


def _package(
    package: Distribution, kind: ComponentType = ComponentType.LIBRARY, scope: ComponentScope | None = None
) -> Component:
    name, licence = canonicalize_name(package.name), package.metadata.json.get("license_expression")
    return Component(
        name=name,
        version=package.version,
        type=kind,
        scope=scope,
        bom_ref=name,
        purl=PackageURL("pypi", name=name, version=package.version),
        licenses=[LicenseExpression(str(licence))] if licence else (),
    )


def _library(library: Library) -> Component:
    """Return a library of npm that the pages hold."""
    purl = PackageURL("npm", name=library.name, version=library.version)
    return Component(
        name=library.name,
        version=library.version,
        type=ComponentType.LIBRARY,
        scope=ComponentScope.REQUIRED,
        bom_ref=str(purl),
        purl=purl,
        hashes=[HashType(alg=HashAlgorithm.SHA_512, content=library.sha512)],
        licenses=[LicenseExpression(library.licence)],
    )


def _closure(requirement: str) -> dict[str, Distribution]:
    """Return the installed packages that a requirement takes, itself among them, by their names in order."""
    found: dict[tuple[str, frozenset[str]], Distribution] = {}
    open_ = [Requirement(requirement)]
    while open_:
        one = open_.pop()
        key = (canonicalize_name(one.name), frozenset(one.extras))
        if key not in found:
            try:
                found[key] = distribution(one.name)
            except PackageNotFoundError:
                raise ReleaseError(f"A release takes {one.name}: pip install 'rov-cosim[release]'.") from None
            open_ += _required(found[key], one.extras)
    return {name: package for (name, _), package in sorted(found.items(), key=lambda item: item[0][0])}


def _required(package: Distribution, extras: Iterable[str]) -> list[Requirement]:
    """Return what a package takes here, with some of its extras."""
    all_ = [Requirement(text) for text in package.requires or ()]
    environments = [{"extra": extra} for extra in ("", *extras)]
    return [one for one in all_ if one.marker is None or any(one.marker.evaluate(e) for e in environments)]


def _direct(package: Distribution, extras: Iterable[str]) -> list[str]:
    return [canonicalize_name(one.name) for one in _required(package, extras)]


def _put(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")
