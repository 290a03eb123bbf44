"""Holds a vehicle whose axes have z down (north-east-down, front-right-down), in SciPy, with adaptive_pd.fmu.

pip install fmpy scipy, `python examples/z_down.py`. Such axes are the controller's turned by half a turn about x: on
the way in and out y, z, pitch and yaw change their signs, and nothing else. Thruster forces have no axes.
"""

import sys

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from verdict import told

from fmu import Fmu

STEP, STEPS = 0.03, 2800
SIGNS = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
M = np.array([120.0, 128.0, 136.0, 9.2, 15.7, 14.7])
DRAG, CURRENT = np.array([130.0, 195.0, 286.0, 4.8, 9.8, 10.2]), np.array([0.12, 0.05, 0.0])
WEIGHT, EXCESS, R_B = 80.0 * 9.81, 20.0, np.array([0.0, 0.0, -0.05])  # the buoyancy attacks 5 cm above the origin


def rate(_, state, wrench):
    """Return eta' and nu' in six degrees of freedom (Fossen), for the thrusters' wrench."""
    phi, theta, psi = state[3:6]
    R, nu = Rotation.from_euler("ZYX", [psi, theta, phi]).as_matrix(), state[6:]
    T = np.array([
        [1.0, np.sin(phi) * np.tan(theta), np.cos(phi) * np.tan(theta)],
        [0.0, np.cos(phi), -np.sin(phi)],
        [0.0, np.sin(phi) / np.cos(theta), np.cos(phi) / np.cos(theta)],
    ])  # fmt: skip
    p, h = M[:3] * nu[:3], M[3:] * nu[3:]
    coriolis = np.concatenate([np.cross(nu[3:], p), np.cross(nu[:3], p) + np.cross(nu[3:], h)])
    nu_r = nu - np.append(R.T @ CURRENT, np.zeros(3))
    up = R.T @ [0.0, 0.0, -1.0]
    press = np.concatenate([EXCESS * up, np.cross(R_B, (WEIGHT + EXCESS) * up)])
    return np.concatenate([R @ nu[:3], T @ nu[3:], (wrench + press - coriolis - DRAG * abs(nu_r) * nu_r) / M])


with Fmu("adaptive_pd.fmu", step_size=STEP) as controller:
    r, d = (np.reshape([controller[f"thruster[{i}].{key}"] for i in range(1, 9)], (8, 3)) for key in "rd")
    wrenches = SIGNS[:, None] * np.column_stack([d, np.cross(r, d)]).T
    state = np.array([0.0, -0.5, 0.0, 0.0, 0.0, -2.0, *[0.0] * 6])
    controller["eta_m_valid"] = True
    rows = []
    for _ in range(STEPS):
        controller["eta_m"] = SIGNS * state[:6]
        time = controller.step()
        wrench = wrenches @ controller["u"]
        state = solve_ivp(rate, (0.0, STEP), state, args=(wrench,), rtol=1e-6).y[:, -1]
        rows.append([time, *state[:3], state[5]])
sys.exit(told(rows, "z_down"))
