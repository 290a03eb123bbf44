"""Case 4.1 of Hoang & Kreuzer 2007 with the PD controller: each axis settles where K_P e equals the disturbance."""

from rov_cosim.systems import paper_simulation
from rov_cosim.systems.loop import without_adaptation

SYSTEM = without_adaptation(
    paper_simulation.SYSTEM, "paper_simulation_pd", "Case 4.1 with the PD controller, for comparison"
)

if __name__ == "__main__":
    from rov_cosim import run

    run(SYSTEM)
