"""Repeatable noise: standard normal draws as a pure function of (seed, sample index)."""

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
