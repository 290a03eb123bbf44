"""Compiling C for every platform by the PyPI package `ziglang`; no compiler of the system is used."""

import atexit
import os
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

import fmpy

from ..errors import UserError

_STANDARD_HEADERS = {
    2: ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
    3: ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h"),
}

TUPLES = {
    "x86_64-linux": ("x86_64-linux-gnu.2.17",),
    "aarch64-linux": ("aarch64-linux-gnu.2.17",),
    "x86_64-windows": ("x86_64-windows-gnu",),
    "aarch64-windows": ("aarch64-windows-gnu",),
    "x86_64-darwin": ("x86_64-macos.11.0",),
    "aarch64-darwin": ("aarch64-macos.11.0",),
}
"""What each platform of FMI 3.0 is compiled for."""

TARGETS = {
    "linux64": TUPLES["x86_64-linux"],
    "win64": TUPLES["x86_64-windows"],
    "darwin64": (*TUPLES["x86_64-darwin"], *TUPLES["aarch64-darwin"]),
    "aarch64-linux": TUPLES["aarch64-linux"],
    "aarch64-windows": TUPLES["aarch64-windows"],
}
"""What each platform of FMI 2.0 is compiled for, which calls others than those of x86 by the tuples of FMI 3.0.

Several targets go into one universal binary.
"""

PLATFORMS: Mapping[int, Mapping[str, tuple[str, ...]]] = {2: TARGETS, 3: TUPLES}
"""The platforms of each version of FMI."""

_SUFFIX = {"linux": ".so", "windows": ".dll", "macos": ".dylib"}
SUFFIXES = {
    platform: _SUFFIX[targets[0].split("-")[1].split(".")[0]]
    for names in PLATFORMS.values()
    for platform, targets in names.items()
}
"""How the name of a library ends on each platform."""
_MACOS = {"darwin": "macos"}

# Without contraction a product and a sum round twice on every machine, as they do in NumPy.
FLAGS = (
    "-std=c99",
    "-O2",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fvisibility=hidden",
    "-Wall",
    "-Wextra",
    "-Werror",
)

TIME_LIMIT = 1800.0
"""Time in s that a compilation may take; the first for a platform compiles zig's C library too, some minutes."""

JOBS = os.cpu_count() or 1
"""How many compilers run at a time."""

# Where zig looks for its cache, in its order, and the folder below; LOCALAPPDATA is set on Windows alone.
_CACHES = {"ZIG_GLOBAL_CACHE_DIR": "", "LOCALAPPDATA": "zig", "XDG_CACHE_HOME": "zig", "HOME": ".cache/zig"}

SHARED = ("-shared", "-fPIC", "-s")
OBJECT = ("-c", "-fPIC")
_FAT_MAGIC, _CPU_TYPES = 0xCAFEBABE, {"x86_64": (0x01000007, 3), "aarch64": (0x0100000C, 0)}
_FAT_ALIGNMENT = 14


CURE = "pip install casadi ziglang"
"""What brings all that the native export takes: the extra `native`, of which an index may have no copy."""


class BuildError(UserError):
    """FMUs cannot be built; the message tells why and the cure."""


def is_installed() -> bool:
    """Tell whether the compiler is installed."""
    return find_spec("ziglang") is not None


def recipe(fmi: int = 2) -> str:
    """Return how the binaries for a version of FMI are made: the compiler's version and its command lines."""
    lines = [f"ziglang {version('ziglang')}"]
    for platform, targets in PLATFORMS[fmi].items():
        for target in targets:
            lines.append(f"{platform}: {' '.join(arguments(target, f'NAME{SUFFIXES[platform]}', SHARED, ['*.c']))}")
    return "\n".join([*lines, ""])


def shared_library(
    name: str,
    sources: Mapping[str, bytes],
    platform: str,
    objects: Callable[[str], Mapping[str, bytes]] = lambda target: {},
) -> bytes:
    """Return the shared library `name` of C sources and headers, by file name, for a platform of any version of FMI.

    `objects` returns what else goes into it, compiled for a target.

    Raises
    ------
    BuildError : the compiler refuses the source, with its words, or does not end.
    """
    output, targets = name + SUFFIXES[platform], {**TARGETS, **TUPLES}[platform]
    slices = {target: compiled({**sources, **objects(target)}, target, output, SHARED) for target in targets}
    return next(iter(slices.values())) if len(slices) == 1 else _universal(slices)


def host_target() -> str:
    """Return the target that this machine runs.

    Raises
    ------
    BuildError : there is none.
    """
    all_targets = [target for targets in TARGETS.values() for target in targets]
    for target in all_targets:
        if target.startswith(f"{fmpy.architecture}-{_MACOS.get(fmpy.system, fmpy.system)}"):
            return target
    known = ", ".join(all_targets)
    raise BuildError(f"There are no FMUs for {fmpy.platform_tuple}; expected one of {known}.")


def host_platform(fmi: int = 2) -> str:
    """Return the platform that this machine is in a version of FMI, a key of its `PLATFORMS`; BuildError if none."""
    return next(platform for platform, targets in PLATFORMS[fmi].items() if host_target() in targets)


def platforms_of(fmi: int, platforms: Iterable[str]) -> list[str]:
    """Return the platforms of a version of FMI that have no other targets than some platforms of 2.0 have."""
    targets = {target for platform in platforms for target in TARGETS[platform]}
    return [platform for platform, own in PLATFORMS[fmi].items() if targets.issuperset(own)]


def host_folders() -> list[str]:
    """Return the folders of an FMU's binaries that may hold this machine's, the best first.

    Many an FMU for ARM has them where FMPy looks, in that of x86.
    """
    return [folder for folder in (fmpy.platform_tuple, fmpy.platform) if folder in (*TARGETS, fmpy.platform)]


def standard_headers(fmi: int = 2) -> dict[str, bytes]:
    """Return the headers of a version of FMI by file name."""
    return {name: (files("fmpy") / "c-code" / name).read_bytes() for name in _STANDARD_HEADERS[fmi]}


def compiled(sources: Mapping[str, bytes], target: str, output: str, options: Iterable[str] = ()) -> bytes:
    """Return what the compiler makes of C sources, headers and objects, by file name.

    What lies in a folder is there to be included.

    Raises
    ------
    BuildError : the compiler refuses the source, or does not end.
    """
    with tempfile.TemporaryDirectory() as folder:
        for name, content in sources.items():
            (Path(folder) / name).parent.mkdir(exist_ok=True)
            (Path(folder) / name).write_bytes(content)
        code = sorted(name for name in sources if name.endswith((".c", ".o")) and "/" not in name)
        command = [sys.executable, "-m", "ziglang", *arguments(target, output, options, code)]
        try:
            done = subprocess.run(
                command,
                cwd=folder,
                env={**os.environ, "ZIG_GLOBAL_CACHE_DIR": str(_cache_folder())},
                capture_output=True,
                encoding="utf-8",
                errors="replace",
                timeout=TIME_LIMIT,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise BuildError(f"The compiler does not end for {target} within {TIME_LIMIT:g} s.") from None
        if done.returncode:
            raise BuildError(f"The compiler fails for {target}:\n{done.stderr}")
        return (Path(folder) / output).read_bytes()


def _cache_folder() -> Path:
    """Return where zig keeps what it has compiled: its usual folder, or one for this process if that cannot be used.

    zig ends with an error where there is no home, and tries for ever where one cannot be made, as below /proc.
    """
    for variable, below in _CACHES.items():
        if value := os.environ.get(variable):
            folder = Path(value, below).absolute()
            with suppress(OSError):
                folder.mkdir(parents=True, exist_ok=True)
                tempfile.TemporaryFile(dir=folder).close()
                return folder
    return _temporary_cache()


@cache
def _temporary_cache() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="zig-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def arguments(target: str, output: str, options: Iterable[str], code: Iterable[str]) -> list[str]:
    """Return what the compiler is called with."""
    is_object = "-c" in options
    libraries = [] if "windows" in target or is_object else ["-lm"]
    # zig has no linker that can for macOS, nor libraries for Windows. An object would be compiled anew in each link:
    # that pays where nothing else inlines, as an engine of WebAssembly does not.
    whole = ["-flto"] if "wasm" in target or ("linux" in target and not is_object) else []
    # In equations written out operation by operation, packing pairs of them into vectors pays with AVX alone.
    single = [] if target.startswith("x86_64") else ["-fno-slp-vectorize"]
    return ["cc", "-target", target, *FLAGS, *single, *whole, *options, "-o", output, *code, *libraries]


def _universal(slices: Mapping[str, bytes]) -> bytes:
    """Return a universal Mach-O binary: a big-endian table of architectures, then their binaries, aligned."""
    table = struct.pack(">II", _FAT_MAGIC, len(slices))
    body = b""
    start = 1 << _FAT_ALIGNMENT
    for target, content in slices.items():
        offset = start + len(body)
        table += struct.pack(">5I", *_CPU_TYPES[target.split("-")[0]], offset, len(content), _FAT_ALIGNMENT)
        body += content + bytes(-len(content) % start)
    return table + bytes(start - len(table)) + body
