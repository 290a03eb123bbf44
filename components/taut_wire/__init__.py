"""A taut wire that measures the pose of the vehicle by its length, two angles, a compass and inclinometers."""

from .interface import COMPONENT

__all__ = ["COMPONENT"]
