"""Signs between this project's axes, z up and y to port, and those of the tools that count z downwards.

North-east-down earth axes and front-right-down body axes are ours turned by half a turn about x. So y and z of every
vector change their signs, as do the pitch and yaw angles (R_z(psi) R_y(theta) R_x(phi) turned about x is
R_z(-psi) R_y(-theta) R_x(phi)), and the rates, forces and moments about these axes. The way back is the same.
"""

from collections.abc import Mapping
from math import prod

from ..components.interface import POSE, VELOCITY, WRENCH

Z_DOWN: Mapping[str, float] = {
    label: -1.0
    for labels in (POSE, VELOCITY, WRENCH)
    for label, sign in zip(labels, "+--+--", strict=True)
    if sign == "-"
} | {"azimuth": -1.0, "elevation": -1.0}
"""Factor of a variable by the last part of its name; one for all others."""

# Gains, masses, damping, widths and standard deviations: they have elements of the same names, and no direction.
_DIRECTIONLESS = {
    *("K_P", "K_D", "K_I", "K_S", "Lambda", "Gamma", "Delta", "boundary_layer"),
    *("added_mass", "D_linear", "D_quadratic", "current_std", "attitude_noise_std", "attitude_drift_std"),
}
_OFF_DIAGONAL = {"K_P_off", "K_D_off", "Gamma_off"}


def sign(variable: str) -> float:
    """Return the factor of a variable on the way to axes that count z downwards, by its name: -1 or 1.

    It knows the parameters of this project's components; any other variable is told by the last part of its name.
    """
    group, _, label = variable.rpartition(".")
    if group.partition(".")[0] in _OFF_DIAGONAL:  # between two axes
        return prod(Z_DOWN.get(part, 1.0) for part in variable.split("."))
    if group == "I":  # the products with x, the integrals of x y and x z, change theirs
        return -1.0 if label in ("xy", "xz") else 1.0
    return 1.0 if group.partition(".")[0] in _DIRECTIONLESS else Z_DOWN.get(label, 1.0)
