"""What is worked out of a model description once, however many elements and runs there are of it."""

from collections.abc import Callable
from functools import wraps
from typing import TypeVar
from weakref import WeakKeyDictionary

from fmpy.model_description import ModelDescription

T = TypeVar("T")


def remembered(function: Callable[[ModelDescription], T]) -> Callable[[ModelDescription], T]:
    """Return the function with its results kept as long as the description is; it must not change, nor they."""
    known: WeakKeyDictionary[ModelDescription, T] = WeakKeyDictionary()

    @wraps(function)
    def recalled(description: ModelDescription) -> T:
        try:
            return known[description]
        except KeyError:
            return known.setdefault(description, function(description))

    return recalled
