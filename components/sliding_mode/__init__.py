"""A sliding-mode controller with a boundary layer: the robust alternative that needs a model of the vehicle."""

from .interface import COMPONENT

__all__ = ["COMPONENT"]
