"""Case 4.1 of Hoang & Kreuzer 2007: the simulation, with four degrees of freedom and ideal measurement.

Gains, forces and start are the paper's. The adaptation gain is inferred: with the lever arms of `components.vehicle`,
40 I lets each axis enter 2 cm at 29 s, where the paper reads "about 30 s".
"""

from rov_cosim.components.vehicle import FORCES
from rov_cosim.systems.loop import station_keeping_loop

GAINS = {"K_P.x": 100.0, "K_P.y": 100.0, "K_P.z": 120.0, "K_P.psi": 55.0}
DAMPING = {"K_D.x": 90.0, "K_D.y": 90.0, "K_D.z": 90.0, "K_D.psi": 80.0}

SYSTEM = station_keeping_loop(
    "paper_simulation",
    "Case 4.1: the simulation, adaptive PD with ideal measurement of pose and velocity",
    {
        "rov_plant": {
            **{"eta_0.x": 0.52, "eta_0.y": 0.73, "eta_0.z": 0.62, "eta_0.psi": 0.83},
            **dict(zip(FORCES, (5.0, 4.0, 4.0, 0.0, 8.0, 8.0, 0.0), strict=True)),
        },
        "passive_arm": {"encoder_counts": 0, "noise_std": 0.0},
        "controller": {
            **GAINS,
            **DAMPING,
            **{f"Gamma.{force}": 40.0 for force in FORCES},
            "use_measured_velocity": True,
        },
    },
)

if __name__ == "__main__":
    from rov_cosim import run

    run(SYSTEM)
