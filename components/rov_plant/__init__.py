"""The vehicle: six degrees of freedom, eight thrusters, current, and the forces that the controller does not know."""

from .interface import COMPONENT

__all__ = ["COMPONENT"]
