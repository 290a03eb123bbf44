"""The passive six-joint arm that measures the pose of the vehicle by forward kinematics."""

from .interface import COMPONENT

__all__ = ["COMPONENT"]
