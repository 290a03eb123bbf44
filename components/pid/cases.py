"""Reference cases of the PID controller."""

from ..feedback_cases import controller_cases
from .interface import COMPONENT

CASES = controller_cases(COMPONENT, "integration", {"integration": 0}, {"integral_0.z": 5.0})
