"""The systems of this project, by name."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import product

from rov_cosim.ssp.declaration import System
from rov_cosim.systems import fleet, paper_simulation, paper_simulation_pd, station_keeping, station_keeping_pd


class _Catalogue(Mapping[str, System]):
    """Systems that are made when they are asked for, so that a faulty vehicle's file stops its own systems alone."""

    def __init__(self, makers: Mapping[str, Callable[[], System]]) -> None:
        self._makers = makers

    def __getitem__(self, name: str) -> System:
        return self._makers[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self._makers)

    def __len__(self) -> int:
        return len(self._makers)


_PAPER = [module.SYSTEM for module in (station_keeping, station_keeping_pd, paper_simulation, paper_simulation_pd)]

SYSTEMS: Mapping[str, System] = _Catalogue(
    {
        **{system.name: partial(lambda system: system, system) for system in _PAPER},
        **{fleet.named(*pair): partial(fleet.holding, *pair) for pair in product(fleet.VEHICLES, fleet.CONTROLLERS)},
    }
)
