"""The margins of a loop as a picture: its open-loop response by axis, and the delay it has to spare."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..components.interface import POSE
from ..control.certificate import Certificate
from .plots import save


def draw_margins(certificate: Certificate, path: Path) -> None:
    """Draw gain and phase of each axis with the others closed, PNG or SVG by the suffix."""
    linear = certificate.level
    omega = np.geomspace(0.01, np.pi / linear.step, 400)
    figure = Figure(figsize=(9, 6.5), layout="constrained")
    gain, phase = figure.subplots(2, 1, sharex=True)
    for i, axis in enumerate(linear.controlled):
        # Broken at the feedback's sign: the loop is at its limit where the gain is one and the phase zero.
        L = linear.response(axis, omega)
        left = np.degrees(np.unwrap(np.angle(L)))
        left -= 360 * np.round((left[len(left) // 2] - 90) / 360)
        margin = certificate.margins.get(axis)
        spare = f", {1e3 * margin.delay:.0f} ms to spare" if margin else ""
        gain.loglog(omega, np.abs(L), f"C{i}", label=f"{POSE[axis]}{spare}")
        phase.semilogx(omega, left, f"C{i}")
        if margin and np.isfinite(margin.delay):
            phase.plot(margin.crossover, np.degrees(margin.phase), f"C{i}o")
    for panel, label in ((gain, "gain"), (phase, "phase to spare [deg]")):
        panel.set_ylabel(label)
        panel.grid(alpha=0.3)
    gain.axhline(1.0, color="black", linewidth=0.8)
    phase.axhline(0.0, color="black", linewidth=0.8)
    phase.set_ylim(-90, 180)
    phase.set_xlabel("frequency [rad/s]")
    gain.legend(fontsize="small")
    figure.suptitle(f"{certificate.name}: each axis with the others closed", fontsize=12)
    save(figure, path)
