"""Compiling C for every platform by the PyPI package `ziglang`; no compiler of the system is used."""

import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping
from importlib.metadata import version
from pathlib import Path

import fmpy

from ..errors import UserError

TARGETS = {
    "linux64": ("x86_64-linux-gnu.2.17",),
    "win64": ("x86_64-windows-gnu",),
    "darwin64": ("x86_64-macos.11.0", "aarch64-macos.11.0"),
}
"""What each platform of FMI 2.0 is compiled for; several targets go into one universal binary."""

SUFFIXES = {"linux64": ".so", "win64": ".dll", "darwin64": ".dylib"}

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

_SHARED = ("-shared", "-fPIC", "-s")
_FAT_MAGIC, _CPU_TYPES = 0xCAFEBABE, {"x86_64": (0x01000007, 3), "aarch64": (0x0100000C, 0)}
_FAT_ALIGNMENT = 14


class BuildError(UserError):
    """FMUs cannot be built; the message tells why and the cure."""


def recipe() -> str:
    """Return how binaries are made: the compiler's version and its command lines."""
    lines = [f"ziglang {version('ziglang')}"]
    for platform, targets in TARGETS.items():
        for target in targets:
            lines.append(f"{platform}: {' '.join(_command(target, f'NAME{SUFFIXES[platform]}', _SHARED, ['*.c']))}")
    return "\n".join([*lines, ""])


def shared_library(name: str, sources: Mapping[str, bytes], platform: str) -> bytes:
    """Return the shared library `name` of C sources and headers, by file name, for a platform of `TARGETS`.

    Raises
    ------
    BuildError : the compiler refuses the source; the message is the compiler's.
    """
    output = name + SUFFIXES[platform]
    slices = {target: compiled(sources, target, output, _SHARED) for target in TARGETS[platform]}
    return next(iter(slices.values())) if len(slices) == 1 else _universal(slices)


def host_target() -> str:
    """Return the target that this machine runs.

    Raises
    ------
    BuildError : there is none.
    """
    for target in TARGETS.get(fmpy.platform, ()):
        if target.startswith(f"{fmpy.architecture}-"):
            return target
    known = ", ".join(target for targets in TARGETS.values() for target in targets)
    raise BuildError(f"There are no FMUs for {fmpy.platform_tuple}; expected one of {known}.")


def host_platform() -> str:
    """Return the platform of FMI that this machine is, a key of `TARGETS`; BuildError if it is none."""
    return next(platform for platform, targets in TARGETS.items() if host_target() in targets)


def compiled(sources: Mapping[str, bytes], target: str, output: str, options: Iterable[str] = ()) -> bytes:
    """Return what the compiler makes of C sources and headers, by file name.

    Raises
    ------
    BuildError : the compiler refuses the source.
    """
    with tempfile.TemporaryDirectory() as folder:
        for name, content in sources.items():
            (Path(folder) / name).write_bytes(content)
        files = sorted(name for name in sources if name.endswith(".c"))
        command = [sys.executable, "-m", "ziglang", *_command(target, output, options, files)]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            raise BuildError(f"The compiler fails for {target}:\n{done.stderr}")
        return (Path(folder) / output).read_bytes()


def _command(target: str, output: str, options: Iterable[str], files: Iterable[str]) -> list[str]:
    libraries = [] if "windows" in target else ["-lm"]
    return ["cc", "-target", target, *FLAGS, *options, "-o", output, *files, *libraries]


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
