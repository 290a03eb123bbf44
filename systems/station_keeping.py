"""Case 4.2 of Hoang & Kreuzer 2007: the experiment in the basin, with arm, encoders, noise and lead filter.

Gains, sample time and start are the paper's. The forces are inferred: they are chosen so that the described behaviour
appears, namely a rise by buoyancy to about 0.3 m, a return that is all but done after 25 s, and x within -4 and +2 cm.
The run is longer than the paper's 70 s: with its gains an error decays with a time constant of K_P / (epsilon_0 Gamma),
11 s in heave and 13 s in surge and sway, where Gamma is the sum over the forces that act in the axis.
"""

from rov_cosim.systems.loop import station_keeping_loop
from rov_cosim.systems.session import run

SYSTEM = station_keeping_loop(
    "station_keeping",
    "Case 4.2: the experiment, adaptive PD with measuring arm, encoders, noise and lead filter",
    {
        "rov_plant": {"eta_0.y": 0.5, "eta_0.psi": 2.0, "dB": 25.0, "F_C.x": 1.0, "F_C.y": 1.0, "F_A.z": 8.0},
    },
    stop_time=90.0,
)

if __name__ == "__main__":
    run(SYSTEM)
