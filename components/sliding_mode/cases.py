"""Reference cases of the sliding-mode controller."""

from ..feedback_cases import controller_cases
from ..interface import POSE
from .interface import COMPONENT

_NONE = {f"boundary_layer.{axis}": 0.0 for axis in POSE}
CASES = controller_cases(COMPONENT, "a boundary layer", _NONE, {"Lambda.z": 1.5})
