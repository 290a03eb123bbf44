"""The source of a release: what git has of a clone, and the wheel of just that."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import ZipFile

from ..errors import UserError

_ALL_MAY_READ = 0o644


class ReleaseError(UserError):
    """There can be no release; the message tells why and the cure."""


def check_free(folder: Path) -> None:
    """Raise a ReleaseError if a folder holds something."""
    if folder.exists() and any(folder.iterdir()):
        raise ReleaseError(f"{folder} is not empty: remove it, or name another by --output.")


def commit(root: Path, uncommitted: bool = False) -> str:
    """Return the commit that a clone is at, with a plus after it if there are changes and `uncommitted` lets them be.

    Raises
    ------
    ReleaseError : it is no clone, or has changes.
    """
    if not (root / "setup.py").is_file() or _git(root, "rev-parse", "--show-prefix").strip():
        raise ReleaseError(f"A release is made in a clone of the repository, by its own installation; {root} is none.")
    changed = [line[3:] for line in _git(root, "status", "--porcelain").splitlines()]
    if changed and not uncommitted:
        more = f" and {len(changed) - 1} more" if changed[1:] else ""
        raise ReleaseError(f"{changed[0]}{more} differs from what is committed: commit it, or take --uncommitted.")
    return _git(root, "rev-parse", "HEAD").strip() + "+" * bool(changed)


def wheel(root: Path, folder: Path) -> Path:
    """Build the wheel of a clone into a folder, from the files that git has alone; return its path.

    Raises
    ------
    ReleaseError : it cannot be built, or has in it what it should not.
    """
    with TemporaryDirectory() as temporary:
        source = Path(temporary) / "source"
        listed = (root / name for name in _git(root, "ls-files", "-z").split("\0") if name)
        names = [file.relative_to(root).as_posix() for file in listed if file.is_file() and not file.is_symlink()]
        for name in names:
            copy = source / name
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(root / name, copy)
            copy.chmod(_ALL_MAY_READ)
        command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(source)]
        umask = 0o022 if os.name == "posix" else -1
        done = subprocess.run(command, cwd=temporary, capture_output=True, encoding="utf-8", umask=umask, check=False)
        if done.returncode:
            said = (done.stderr.strip() or done.stdout.strip()).splitlines()
            raise ReleaseError(f"The wheel cannot be built ({said[-1]}): pip install 'rov-cosim[release]'.")
    (path,) = folder.glob("*.whl")
    if wrong := strange(path, names):
        raise ReleaseError(f"The wheel has what no wheel should have: {', '.join(wrong)}.")
    return path


def strange(wheel: Path, names: list[str]) -> list[str]:
    """Return what of a wheel is neither one of the files `names` of the repository nor told of them, or is no text."""
    packaged = {*names, *(f"rov_cosim/{name}" for name in names)}
    with ZipFile(wheel) as archive:
        return [
            name
            for name in archive.namelist()
            if (name not in packaged and ".dist-info/" not in name) or not _is_text(archive.read(name))
        ]


def _is_text(content: bytes) -> bool:
    try:
        return "\0" not in content.decode("utf-8")
    except UnicodeDecodeError:
        return False


def _git(root: Path, *arguments: str) -> str:
    command = ["git", "-C", str(root), *arguments]
    try:
        done = subprocess.run(command, capture_output=True, encoding="utf-8", check=True)
    except FileNotFoundError:
        raise ReleaseError("A release takes git, which is not installed.") from None
    except subprocess.CalledProcessError as error:
        raise ReleaseError(f"A release is made in a clone of the repository: {error.stderr.strip()}.") from None
    return done.stdout
