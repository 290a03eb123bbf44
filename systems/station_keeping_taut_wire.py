"""Case 4.2 of Hoang & Kreuzer 2007 with the other sensor that the paper names: a taut wire in the arm's place.

Gains, start and loads are those of `station_keeping`, but for the arm's force: the winch pulls instead, by the 8 N that
`taut_wire` has as tension, and to the side to which the arm pulls there. Compass and inclinometers drift, and the
vehicle follows what they say: it holds within 10 mm and 1 deg.
"""

from rov_cosim.systems import station_keeping
from rov_cosim.systems.loop import WIRE, station_keeping_loop

_PLANT = station_keeping.SYSTEM.parameters["rov_plant"]

SYSTEM = station_keeping_loop(
    "station_keeping_taut_wire",
    "Case 4.2 with a taut wire, compass and inclinometers in the arm's place",
    {
        "rov_plant": {name: value for name, value in _PLANT.items() if not name.startswith("F_A.")},
        WIRE: {"attachment.y": -0.5},
    },
    station_keeping.SYSTEM.stop_time,
    WIRE,
)

if __name__ == "__main__":
    from rov_cosim import run

    run(SYSTEM)
