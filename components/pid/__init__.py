"""The PID controller: a baseline that removes a constant disturbance without a model of where its forces act."""

from .interface import COMPONENT

__all__ = ["COMPONENT"]
