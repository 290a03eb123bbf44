"""Reference cases of the adaptive controller with saturated errors."""

from ..feedback_cases import controller_cases
from .interface import COMPONENT

CASES = controller_cases(COMPONENT, "adaptation", {"adaptation": 0}, {"theta_hat_0.dB": 5.0, "Delta.x": 0.1})
