"""Which of many alike are tested, and which of these by a default run."""

from collections.abc import Iterable, Mapping
from typing import Any

import pytest

from rov_cosim.ssp.declaration import System


def typical(all_: Iterable[str], *kept: str) -> list[Any]:
    """Return the parameters of a test of all: those kept stand for the rest, which run among the slow tests."""
    names = list(all_)
    assert set(kept) <= set(names), kept
    return [name if name in kept else pytest.param(name, marks=pytest.mark.slow) for name in names]


def distinct(systems: Mapping[str, System], *more: str) -> list[str]:
    """Return the first of all systems that differ in values of parameters alone, and some more."""
    first: dict[tuple[Any, ...], str] = {}
    for name, system in systems.items():
        first.setdefault((tuple(system.elements.items()), system.connections), name)
    return [*first.values(), *more]
