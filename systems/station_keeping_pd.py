"""Case 4.2 of Hoang & Kreuzer 2007 with the PD controller: a constant offset remains."""

from rov_cosim.systems import station_keeping
from rov_cosim.systems.loop import without_adaptation

SYSTEM = without_adaptation(
    station_keeping.SYSTEM, "station_keeping_pd", "Case 4.2 with the PD controller, for comparison"
)

if __name__ == "__main__":
    from rov_cosim import run

    run(SYSTEM)
