"""Adaptive PD control with saturated errors, after Sun & Cheah 2003: what Hoang & Kreuzer 2007 set out from."""

from .interface import COMPONENT

__all__ = ["COMPONENT"]
