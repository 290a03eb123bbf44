"""Holds a small 4-DOF vehicle with adaptive_pd.fmu: pip install fmpy, then `python examples/closed_loop.py`.

Axes are right-handed with z up; pose is x, y, z, roll, pitch, yaw in m and rad, velocity is in the body. In the place
of `Vehicle` comes yours: it tells its pose and takes eight thrusters' forces. The controller knows its thrusters,
parameters `thruster[i].r`, `.d`, and its weight; it knows neither its inertia nor the forces that press on it.
"""

import sys

import numpy as np
from verdict import told

from fmu import Fmu

STEP, STEPS = 0.03, 2800


class Vehicle:
    """Surge, sway, heave and yaw of the paper's vehicle, 80 kg, pressed by a buoy, an umbilical and an arm."""

    M = np.array([120.0, 128.0, 136.0, 14.7])  # with added mass, in kg and kg m^2
    D = np.array([130.0, 195.0, 286.0, 10.18])  # quadratic
    FORCE, MOMENT = np.array([2.0, -8.0, 25.0]), -2.0  # earth frame, N and N m

    def __init__(self, wrenches):
        self.wrenches = wrenches  # of 1 N of each thruster: rows X, Y, Z, N
        self.eta, self.nu = np.array([0.0, 0.5, 0.0, 2.0]), np.zeros(4)  # x, y, z, yaw

    def advance(self, u, time):
        """Integrate over a time in s under the thrusters' forces u in N, in ten steps."""
        for _ in range(10):
            c, s = np.cos(self.eta[3]), np.sin(self.eta[3])
            R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
            m_u, m_v = self.M[:2] * self.nu[:2]
            coriolis = np.array([-m_v * self.nu[3], m_u * self.nu[3], 0.0, m_v * self.nu[0] - m_u * self.nu[1]])
            load = np.append(R.T @ self.FORCE, self.MOMENT) - self.D * abs(self.nu) * self.nu
            self.nu = self.nu + time / 10 * (self.wrenches @ u + load - coriolis) / self.M
            self.eta = self.eta + time / 10 * np.append(R @ self.nu[:3], self.nu[3])


with Fmu("adaptive_pd.fmu", "parameters/start_values.ssv", STEP) as controller:
    r, d = (np.reshape([controller[f"thruster[{i}].{key}"] for i in range(1, 9)], (8, 3)) for key in "rd")
    vehicle = Vehicle(np.column_stack([d, np.cross(r, d)])[:, [0, 1, 2, 5]].T)
    controller["eta_m_valid"] = True
    rows = []
    for _ in range(STEPS):
        x, y, z, psi = vehicle.eta
        controller["eta_m"] = x, y, z, 0.0, 0.0, psi
        time = controller.step()
        vehicle.advance(np.array(controller["u"]), STEP)
        rows.append([time, *vehicle.eta])
sys.exit(told(rows, "closed_loop"))
