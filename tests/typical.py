"""Which of many alike a default run tests."""

from collections.abc import Iterable
from typing import Any

import pytest


def typical(all_: Iterable[str], *kept: str) -> list[Any]:
    """Return the parameters of a test of all: those kept stand for the rest, which run among the slow tests."""
    names = list(all_)
    assert set(kept) <= set(names), kept
    return [name if name in kept else pytest.param(name, marks=pytest.mark.slow) for name in names]
