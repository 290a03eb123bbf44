"""Repeatable noise: standard normal draws as a pure function of (seed, sample index), and noise with a memory."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def standard_normal(seed: int, index: int, n: int) -> NDArray[np.float64]:
    """Return n independent standard normal draws, shape (n,), for sample `index` >= 0 and a 32-bit `seed`.

    The bits are Philox4x64-10 (Salmon et al. 2011) with key `seed` and the counter (block, index, 0, 0), so samples
    never share a block; pairs of 53-bit uniforms become normals by the Box-Muller transform.
    """
    pairs = (n + 1) // 2
    bits = np.random.Philox(key=seed, counter=index << 64).random_raw(2 * pairs)
    uniform = ((bits >> np.uint64(11)) + np.uint64(1)) * 2.0**-53
    radius, angle = np.sqrt(-2.0 * np.log(uniform[0::2])), 2.0 * np.pi * uniform[1::2]
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1).reshape(-1)[:n]


def gauss_markov(last: Any, started: Any, w: Any, deviation: Any, correlation_time: Any, step: Any) -> Any:
    """Return the next value, shape (n,), of a stationary Gauss-Markov process from the standard normal draws w.

    It is white for a correlation time of 0 s, and has its full deviation at once where it has not started.
    """
    coloured = correlation_time > 0
    decay = np.where(coloured, np.exp(-step / np.where(coloured, correlation_time, 1.0)), 0.0)
    memory = np.where(started, decay, 0.0)
    return memory * last + np.sqrt(1 - memory**2) * deviation * w
