"""Symmetric gain matrices, as parameters: the diagonal, and beside it an element for each two axes, 0 by default.

Hoang & Kreuzer 2007 take K_P, K_D and Gamma for symmetric positive definite matrices; their own are diagonal.
"""

from collections.abc import Callable
from functools import cache
from itertools import combinations
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .frames import array
from .interface import Requirement, Signal

NEARLY_SINGULAR = 1e-9
"""Pivot of the matrix scaled to a diagonal of ones that counts as zero."""


def off_diagonal(of: Signal, labels: tuple[str, ...], unit: Callable[[str, str], str]) -> Signal:
    """Declare what a gain has off its diagonal: ``KEY_off.x.y`` for each two of its labels; unit is that of a pair."""
    pairs = tuple(combinations(labels, 2))
    key = f"{of.key}_off"
    return Signal(
        key,
        f"{of.description.split(' (')[0].split(';')[0]}, off its diagonal",
        pattern=f"{key}.{{}}",
        axes=(tuple(".".join(pair) for pair in pairs),),
        unit=tuple(unit(*pair) for pair in pairs),
        tunable=of.tunable,
    )


def symmetric(diagonal: Any, off: Any) -> Any:
    """Return the matrix, shape (n, n), of a diagonal, shape (n,), and of what is off it, row by row of one half."""
    n = diagonal.shape[0]
    return np.diag(diagonal) + np.reshape(_places(n) @ off, (n, n))


def definiteness(diagonal: Any, off: Any) -> Any:
    """Return a positive number if the matrix is positive definite among the axes whose gain is not 0, the rest alone.

    By the pivots of L D L^T, of the matrix scaled to a diagonal of ones, so that they do not depend on units.
    """
    used = np.where(diagonal > 0, 1.0, 0.0)
    scale = np.diag(used / np.sqrt(np.where(diagonal > 0, diagonal, 1.0)))
    K = symmetric(diagonal, off)
    rest, pivots = scale @ K @ scale + np.diag(1 - used), []
    for n in range(diagonal.shape[0] - 1, 0, -1):
        pivots.append(rest[0, 0])
        rest = rest[1:, 1:] - np.reshape(rest[1:, 0], (n, 1)) @ np.reshape(rest[0, 1:], (1, n)) / rest[0, 0]
    least = np.min(array([*pivots, rest[0, 0]]))
    coupled_to_none = np.sum(np.abs(K - np.diag(used) @ K @ np.diag(used)))
    return np.where(coupled_to_none > 0, -1.0, least - NEARLY_SINGULAR)


def positive_definite(key: str, n: int) -> Requirement:
    """Require of the first n gains of a key, and of what is off their diagonal, that they are positive definite."""

    def margin(p: SimpleNamespace) -> Any:
        return definiteness(getattr(p, key)[:n], getattr(p, f"{key}_off"))

    return Requirement(
        margin,
        f"{key} is not positive definite: make {key}_off.* smaller in size (each below the root of the product of its "
        f"two {key}, and 0 where one of these is 0).",
    )


@cache
def _places(n: int) -> NDArray[np.float64]:
    """Return where the elements off the diagonal go, shape (n^2, n (n - 1) / 2)."""
    pairs = list(combinations(range(n), 2))
    places = np.zeros((n, n, len(pairs)))
    for k, (i, j) in enumerate(pairs):
        places[i, j, k] = places[j, i, k] = 1.0
    return places.reshape(n * n, -1)
