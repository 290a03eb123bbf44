"""What happens around the vehicle over time: current, pulls of the umbilical, set-point."""

from .interface import COMPONENT

__all__ = ["COMPONENT"]
