"""The systems of this project, by name."""

from . import fleet, paper_simulation, paper_simulation_pd, station_keeping, station_keeping_pd
from .declaration import System

_PAPER = [module.SYSTEM for module in (station_keeping, station_keeping_pd, paper_simulation, paper_simulation_pd)]
_FLEET = [fleet.holding(vehicle, controller) for vehicle in fleet.VEHICLES for controller in fleet.CONTROLLERS]

SYSTEMS: dict[str, System] = {system.name: system for system in (*_PAPER, *_FLEET)}
