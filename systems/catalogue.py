"""The systems of this project, by name."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial

from rov_cosim.errors import UserError
from rov_cosim.ssp.declaration import System
from rov_cosim.ssp.wiring import suggestion
from rov_cosim.systems import (
    fleet,
    paper_simulation,
    paper_simulation_pd,
    station_keeping,
    station_keeping_pd,
    station_keeping_taut_wire,
)


class UnknownSystemError(UserError, KeyError):
    """There is no system of a name."""

    def __str__(self) -> str:
        return str(self.args[0])  # a KeyError shows it in quotes


class _Catalogue(Mapping[str, System]):
    """Systems that are made when they are asked for, so that a faulty vehicle's file stops its own systems alone."""

    def __init__(self, makers: Mapping[str, Callable[[], System]]) -> None:
        self._makers = makers

    def __getitem__(self, name: str) -> System:
        if name not in self._makers:
            raise UnknownSystemError(f"There is no system {name}." + suggestion(name, self._makers))
        return self._makers[name]()

    def __contains__(self, name: object) -> bool:
        return name in self._makers

    def __iter__(self) -> Iterator[str]:
        return iter(self._makers)

    def __len__(self) -> int:
        return len(self._makers)


_SINGLE = [
    module.SYSTEM
    for module in (
        station_keeping,
        station_keeping_pd,
        station_keeping_taut_wire,
        paper_simulation,
        paper_simulation_pd,
    )
]

SYSTEMS: Mapping[str, System] = _Catalogue(
    {
        **{system.name: partial(lambda system: system, system) for system in _SINGLE},
        **{fleet.named(*pair): partial(fleet.holding, *pair) for pair in fleet.LOOPS},
    }
)
