"""FMI co-simulation components that hold an underwater vehicle in place beside a structure.

The names of the public API are loaded when they are used: `System` and `wire`, `Changes`, `opened` and `read_ssp`,
`simulate`, `simulate_apart` and `write_ssp`, `Settings` and `run`, `score`, and `SYSTEMS`. docs/API.md tells of them,
with examples.
"""

from importlib import import_module
from importlib.metadata import version as _version
from typing import TYPE_CHECKING, Any

from . import loaded as loaded

if TYPE_CHECKING:
    from .master.apart import simulate_apart
    from .master.simulation import SimulationError, simulate
    from .ssp.declaration import System, wire
    from .ssp.reader import opened as read_ssp
    from .ssp.wiring import Wiring, WiringError
    from .study.changes import Changes
    from .study.runs import Run, opened, run
    from .study.scores import Score, score
    from .study.settings import Settings
    from .systems.catalogue import SYSTEMS
    from .whole.writer import write as write_ssp

__version__ = _version("rov-cosim")

_HOMES = {
    "Changes": "study.changes",
    "Run": "study.runs",
    "SYSTEMS": "systems.catalogue",
    "Score": "study.scores",
    "Settings": "study.settings",
    "SimulationError": "master.simulation",
    "System": "ssp.declaration",
    "Wiring": "ssp.wiring",
    "WiringError": "ssp.wiring",
    "opened": "study.runs",
    "read_ssp": "ssp.reader:opened",
    "run": "study.runs",
    "score": "study.scores",
    "simulate": "master.simulation",
    "simulate_apart": "master.apart",
    "wire": "ssp.declaration",
    "write_ssp": "whole.writer:write",
}
__all__ = [
    "SYSTEMS",
    "Changes",
    "Run",
    "Score",
    "Settings",
    "SimulationError",
    "System",
    "Wiring",
    "WiringError",
    "opened",
    "read_ssp",
    "run",
    "score",
    "simulate",
    "simulate_apart",
    "wire",
    "write_ssp",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, attribute = _HOMES[name].partition(":")
    return getattr(import_module(f".{module}", __name__), attribute or name)
