"""The environment in which a release is the same on every machine of a kind.

Sums and sines round otherwise where a processor has fused operations: BLAS, NumPy and the C library each choose by the
processor what they run. So all three are told to run what the least x86-64 has, or the least ARM.
"""

import os
import platform
from calendar import timegm

from numpy import show_config

from ..exporters.archive import RELEASED

_LEAST = {"x86_64": "Nehalem", "amd64": "Nehalem", "aarch64": "ARMV8", "arm64": "ARMV8"}
"""OpenBLAS's name of the least processor of a kind."""
_FUSED = "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX2_Usable,-FMA_Usable,-FMA4_Usable"
"""What the C library is not to use, by its names since 2.33 and before."""


def variables() -> dict[str, str]:
    """Return the variables of the environment, besides the user's, that a process has to begin with."""
    found = show_config(mode="dicts")["SIMD Extensions"].get("found", [])  # beyond what NumPy takes for granted
    left_out = [os.environ.get("NPY_DISABLE_CPU_FEATURES", ""), *found]
    told = {
        "GLIBC_TUNABLES": _FUSED,
        "LC_ALL": "C.UTF-8",
        "NPY_DISABLE_CPU_FEATURES": " ".join(filter(None, left_out)),
        "OPENBLAS_CORETYPE": _LEAST.get(platform.machine().lower(), ""),
        "PYTHONHASHSEED": "0",
        "SOURCE_DATE_EPOCH": str(timegm((*RELEASED, 0, 0, 0))),
        "TZ": "UTC",
    }
    return {name: value for name, value in told.items() if value}  # an empty one cannot be set everywhere


def is_settled() -> bool:
    """Tell whether this process began so."""
    return all(os.environ.get(name) == value for name, value in variables().items())
