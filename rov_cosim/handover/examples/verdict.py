"""What the examples say at their end: whether the vehicle was held, by how much; MIT, as all here."""

import csv

import numpy as np

LIMITS = 10.0, 1.0
"""Largest error of position in mm, and of yaw in deg, of a vehicle that is held."""


def told(rows, name=""):
    """Print the worst errors over the last fifth of a run and return the exit status; write NAME.csv if it is named.

    rows are time, x, y, z and yaw, in s, m and rad, off a set-point of zero.
    """
    table = np.array(rows)
    last = table[-len(table) // 5 :]
    position = 1e3 * np.linalg.norm(last[:, 1:4], axis=1).max()
    yaw = np.degrees(np.abs(np.remainder(last[:, 4] + np.pi, 2 * np.pi) - np.pi).max())
    held = position < LIMITS[0] and yaw < LIMITS[1]
    print(f"{'held' if held else 'lost'}: {position:.1f} mm, {yaw:.1f} deg")
    if name:
        with open(f"{name}.csv", "w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([["time", "x", "y", "z", "psi"], *table.tolist()])
    return 0 if held else 1
