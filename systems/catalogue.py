"""The systems of this project, by name."""

from . import paper_simulation, paper_simulation_pd, station_keeping, station_keeping_pd
from .declaration import System

SYSTEMS: dict[str, System] = {
    module.SYSTEM.name: module.SYSTEM
    for module in (station_keeping, station_keeping_pd, paper_simulation, paper_simulation_pd)
}
