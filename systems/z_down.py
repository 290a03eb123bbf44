"""Signs between this project's axes, z up and y to port, and those of the tools that count z downwards.

North-east-down earth axes and front-right-down body axes are ours turned by half a turn about x. So y and z of every
vector change their signs, as do the pitch and yaw angles (R_z(psi) R_y(theta) R_x(phi) turned about x is
R_z(-psi) R_y(-theta) R_x(phi)), and the rates, forces and moments about these axes. The way back is the same.
"""

from collections.abc import Mapping

from ..components.interface import POSE, VELOCITY, WRENCH

Z_DOWN: Mapping[str, float] = {
    label: -1.0
    for labels in (POSE, VELOCITY, WRENCH)
    for label, sign in zip(labels, "+--+--", strict=True)
    if sign == "-"
}
"""Factor of a variable by the last part of its name; one for all others."""
