"""Kinematics of the passive arm, its encoders, noise and pull.

The shoulder sits at r_A on the vehicle. Joint 1 yaws about the body's z axis; joints 2 and 3 pitch the links L_1 and
L_2, which point along x at zero; joints 4 to 6 are a spherical wrist (zyx). The end effector is fixed to the structure.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from .. import sensing
from ..frames import array, euler_angles, is_regular, rotation
from ..noise import gauss_markov

FOLDED = 0.05
"""Least reach as a share of L_1 + L_2: closer than this the links would fold into each other."""


def forward_kinematics(q: Any, L: Any) -> tuple[Any, Any]:
    """Return the wrist position, shape (3,), in m and the end effector's rotation, shape (3, 3), in shoulder axes."""
    elbow, wrist = q[1], q[1] + q[2]
    out = L[0] * np.cos(elbow) + L[1] * np.cos(wrist)
    down = L[0] * np.sin(elbow) + L[1] * np.sin(wrist)
    position = array([out * np.cos(q[0]), out * np.sin(q[0]), -down])
    return position, _forearm(q) @ rotation(array([q[5], q[4], q[3]]))


def inverse_kinematics(position: Any, R: Any, L: Any) -> Any:
    """Return the joint angles q, shape (6,), in rad for a wrist position in reach: the elbow bends by 0 <= q_3 <= pi.

    position, shape (3,), in m and R, shape (3, 3), are those of the end effector in shoulder axes. Out of reach, the
    arm points at the position, stretched or folded.
    """
    out = np.sqrt(position[0] ** 2 + position[1] ** 2)
    cosine = (out**2 + position[2] ** 2 - L[0] ** 2 - L[1] ** 2) / (2 * L[0] * L[1])
    bend = np.arccos(np.clip(cosine, -1.0, 1.0))
    pitch = np.arctan2(-position[2], out) - np.arctan2(L[1] * np.sin(bend), L[0] + L[1] * np.cos(bend))
    arm = array([np.arctan2(position[1], position[0]), pitch, bend])
    wrist = euler_angles(_forearm(arm).T @ R)
    return array([arm[0], arm[1], arm[2], wrist[2], wrist[1], wrist[0]])


def end_effector_from(eta: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """Return where the attachment is, seen from the shoulder of a vehicle at pose eta: position and rotation."""
    R = rotation(eta[3:6])
    position = R.T @ (p.attachment[0:3] - eta[0:3]) - p.r_A
    return position, R.T @ rotation(p.attachment[3:6])


def pose_from(q: Any, p: SimpleNamespace) -> Any:
    """Return the pose eta, shape (6,), of the vehicle whose arm has the joint angles q."""
    position, R_arm = forward_kinematics(q, p.L)
    R = rotation(p.attachment[3:6]) @ R_arm.T
    return np.concatenate([p.attachment[0:3] - R @ (p.r_A + position), euler_angles(R)])


def sample(
    x: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace, w: Any
) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return state and outputs after measuring the true pose u.eta with the standard normal draws w, shape (8,)."""
    position, R = end_effector_from(u.eta, p)
    reach = np.sqrt(np.sum(position**2))
    longest = p.L[0] + p.L[1]
    shortest = np.maximum(np.abs(p.L[0] - p.L[1]), FOLDED * longest)
    in_reach = np.logical_and(reach <= longest, reach >= shortest)
    attached = np.logical_and(in_reach, is_regular(u.eta))

    angles = inverse_kinematics(position, R, p.L)
    q = np.where(attached, sensing.quantised(angles, sensing.encoder_resolution(p.encoder_counts)), x.q)
    deviation = array([p.noise_std] * 3 + [p.noise_std_angle] * 3)
    noise = gauss_markov(x.noise, x.started > 0, w[0:6], deviation, p.noise_correlation_time, p.sample_time)
    pose = pose_from(q, p) + noise + np.concatenate([p.bias, np.zeros(3)])
    memory, measurement = sensing.handed_out(x, p, pose, attached, w[6:8])
    pull = p.preload + p.stiffness * (rotation(u.eta[3:6]) @ position)

    state = {**memory, "q": q, "noise": noise, "started": 1.0}
    outputs = {
        **measurement,
        "attached": attached,
        "q": q,
        "reach": reach,
        "F_arm": np.where(attached, pull, 0.0),
    }
    return state, outputs


def initial_state(p: SimpleNamespace) -> Mapping[str, Any]:
    """Return the state before the first sample: nothing measured yet."""
    return {**sensing.initial_state(), "q": np.zeros(6), "noise": np.zeros(6), "started": 0.0}


def _forearm(q: Any) -> Any:
    """Return the rotation of the forearm in shoulder axes."""
    return rotation(array([0.0 * q[0], q[1] + q[2], q[0]]))
