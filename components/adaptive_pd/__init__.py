"""The adaptive PD controller of Hoang & Kreuzer 2007."""

from .interface import COMPONENT

__all__ = ["COMPONENT"]
