"""Holds a vehicle in MuJoCo with adaptive_pd.fmu: pip install fmpy mujoco, `python examples/mujoco_rov.py`.

`rov.xml` has the body, its thrusters as sites, the drag of its ellipsoid and the current (`wind`). The buoyancy, 20 N
more than the weight, acts at a site above the centre of gravity. MuJoCo's axes are the controller's: z up, x forward.
"""

import sys
from pathlib import Path

import mujoco
import numpy as np
from verdict import told

from fmu import Fmu

STEP, STEPS = 0.03, 2800
model = mujoco.MjModel.from_xml_path(str(Path(__file__).with_name("rov.xml")))
data = mujoco.MjData(model)
lift = np.array([0.0, 0.0, 80.0 * 9.81 + 20.0])


def pose():
    """Return x, y, z, roll, pitch, yaw (zyx)."""
    w, x, y, z = data.qpos[3:]
    phi = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    psi = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return *data.qpos[:3], phi, np.arcsin(2 * (w * y - z * x)), psi


with Fmu("adaptive_pd.fmu", step_size=STEP) as controller:
    mujoco.mj_forward(model, data)
    controller["eta_m_valid"] = True
    rows = []
    for _ in range(STEPS):
        controller["eta_m"] = pose()
        time = controller.step()
        data.ctrl[:] = controller["u"]
        for _ in range(round(STEP / model.opt.timestep)):
            data.qfrc_applied[:] = 0.0
            mujoco.mj_applyFT(model, data, lift, np.zeros(3), data.site("buoyancy").xpos, 1, data.qfrc_applied)
            mujoco.mj_step(model, data)
        x, y, z, _, _, psi = pose()
        rows.append([time, x, y, z, psi])
sys.exit(told(rows, "mujoco_rov"))
