"""Sliding-mode control to a set-point (Yoerger & Slotine 1985; Slotine & Li 1991, chapter 7; Fossen 1994, chapter 4).

    s = e' + slope,        slope = Lambda e, or with integration 2 Lambda e + Lambda^2 z, z' = e

s is the sliding variable in the earth frame. While it is zero the error decays by itself: one pole at -Lambda, or two.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from .. import feedback, measurement
from ..frames import jacobian, jacobian_inverse, skew
from ..measurement import Measured, measured
from ..vehicle import coriolis, mass_matrix, restoring


def saturation(s: Any, width: Any) -> Any:
    """Return s / width clipped to [-1, 1], elementwise; the sign of s where the width is 0."""
    layer = width > 0
    return np.where(layer, np.clip(s / np.where(layer, width, 1.0), -1.0, 1.0), np.sign(s))


def sliding_slope(m: Measured, z: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """Return the slope, shape (6,), in m/s and rad/s, and its rate; z, shape (6,), is the integral of the error."""
    integrating = p.integration > 0
    slope = np.where(integrating, 2 * p.Lambda * m.e + p.Lambda**2 * z, p.Lambda * m.e)
    return slope, np.where(integrating, 2 * p.Lambda * m.e_dot + p.Lambda**2 * m.e, p.Lambda * m.e_dot)


def model_wrench(m: Measured, slope: Any, slope_rate: Any, p: SimpleNamespace) -> Any:
    """Return the body wrench, shape (6,), by which the vehicle as the controller knows it would keep s at zero.

    M nu_r' + C(nu) nu_r + D(nu) nu_r + g_V(eta),    nu_r = J^-1(eta) (eta_d' - slope)    (Fossen 1994, chapter 4)

    Of (J^-1)' in nu_r' there is the turn of the linear part. What it adds while roll and pitch change is left to K_S,
    and so is eta_d''.
    """
    J_inverse = jacobian_inverse(m.eta)
    nu, nu_r = J_inverse @ m.eta_dot, J_inverse @ (m.eta_dot - m.e_dot - slope)
    turning = np.concatenate([skew(nu[3:6]) @ nu_r[0:3], np.zeros(3)])
    M = mass_matrix(p.mass, p.I, p.r_G, p.added_mass)
    resistance = coriolis(M, nu) @ nu_r + (p.D_linear + p.D_quadratic * np.abs(nu)) * nu_r
    return M @ (-J_inverse @ slope_rate - turning) + resistance + restoring(m.eta, p.mass, p.g, p.r_G, p.r_B)


def sample(
    x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, w: Any
) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return state and outputs after one sample; no draws are needed.

    tau = model_wrench - J^T(eta) K_S sat(s / Phi)        (Slotine & Li 1991, chapter 7)

    where Phi is the width of the boundary layer. z grows inside of it alone, and so cannot wind up.
    """
    m = measured(x, u, p)
    slope, slope_rate = sliding_slope(m, x.z, p)
    s = m.e_dot + slope
    switched = jacobian(m.eta).T @ (p.K_S * saturation(s, p.boundary_layer))
    tau = model_wrench(m, slope, slope_rate, p) - switched
    # A vehicle at rest has no drag, but the model's linear drag on the slope is in tau: it holds a part of the forces.
    disturbance = switched + p.D_linear * (jacobian_inverse(m.eta) @ slope)

    growing = np.logical_and(p.integration > 0, np.abs(s) < p.boundary_layer)
    return (
        {"z": x.z + p.sample_time * np.where(growing, m.e, 0.0), **m.state},
        {**feedback.command(tau, u, p), "s": s, "disturbance": disturbance, **m.outputs},
    )


def initial_state(p: SimpleNamespace) -> Mapping[str, Any]:
    """Return the state before the first sample."""
    return {"z": np.zeros(6), **measurement.initial_state()}
