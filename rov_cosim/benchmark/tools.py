"""What a step of a system costs in the masters of others, which read its archive.

    python -m rov_cosim.benchmark.tools NAME PART ARCHIVE STEPS OUT

measures one of them, for `costs_of`.
"""

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

from ..importers import masters, programs
from ..importers.driving import Loop
from ..importers.measuring import ImporterError, apart
from ..importers.tools import IMPORTERS
from ..master.simulation import simulate
from ..ssp import reader
from ..ssp.declaration import System, wire
from ..ssp.wiring import Wiring
from ..study.screen import say
from .costs import Cost

PARTS = ("loop", "loop, outputs observed")
"""What a tool does: step alone, or hand all outputs out too, libcosim to its observer of last values, Ecos to a CSV."""

BATCHES = 4
"""The least of so many measurements counts, each over the steps given: to start a tool takes longer than these."""

Steps = Callable[[int], object]
"""Takes so many steps."""


def _ecos(wiring: Wiring, archive: Path, is_observed: bool) -> Iterator[Steps]:
    simulation = masters.ecos().EcosSimulation(step_size=wiring.step_size, ssp_path=str(archive))
    with TemporaryDirectory() as folder, simulation:
        if is_observed:
            simulation.add_csv_writer(str(Path(folder, "out.csv")), identifiers=_outputs(wiring))
        simulation.init(0, "nominal")
        yield simulation.step
        simulation.terminate()


def _libcosim(wiring: Wiring, archive: Path, is_observed: bool) -> Iterator[Steps]:
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    execution: Any = CosimExecution.from_ssp_file(ssp_path=str(archive))
    if is_observed:
        execution.add_observer(CosimObserver.create_last_value())
    yield execution.step


DRIVERS = {"libcosim": _libcosim, "ecos": _ecos}
"""Yields what takes steps of an archive, by a key of `IMPORTERS`."""


def costs_of(archive: Path, steps: int) -> dict[str, Cost | None]:
    """Return what measures each tool, by what a table calls it; None for one that is not installed.

    The processor's time of all its threads counts. It is NaN for a tool that fails, and stderr has what it said.
    """
    ways: dict[str, Cost | None] = {}
    for name in DRIVERS:
        for part in PARTS:

            def measured(name: str = name, part: str = part) -> tuple[float, ...]:
                try:
                    return (apart(__spec__.name, name, part, str(archive), str(steps)),)
                except ImporterError as error:
                    say(str(error))
                    return (math.nan,)

            ways[f"{IMPORTERS[name].title}: {part}"] = measured if IMPORTERS[name].version() else None
    return ways


@contextmanager
def as_one_fmu(wiring: Wiring, archive: Path) -> Iterator[dict[str, Wiring | None]]:
    """Yield a system as one FMU, ours and that of another tool, for a master; None if that is not installed."""
    with TemporaryDirectory() as folder:
        made = None
        if IMPORTERS["toolbox"].version():
            loop = Loop(archive, wiring, simulate(wiring, stop_time=wiring.start_time + wiring.step_size))
            made = alone(programs.container(loop, Path(folder)), wiring)
        yield {"the system's FMU": alone(archive, wiring), "fmucontainer": made}


def alone(fmu: Path, wiring: Wiring) -> Wiring:
    """Return the wiring of one FMU that is a system, with the times of the system."""
    system = System(wiring.name, "", {"system": "system"}, (), wiring.stop_time, step_size=wiring.step_size)
    return wire(system, {"system": fmu})


def _outputs(wiring: Wiring) -> list[str]:
    return [
        f"{element.name}::{name}"
        for element in wiring.elements
        for name, variable in element.variables.items()
        if variable.causality == "output"
    ]


def _main(name: str, part: str, archive: str, steps: str, out: str) -> None:
    with reader.opened(Path(archive)) as wiring:
        opened = contextmanager(DRIVERS[name])
        with opened(wiring, Path(archive), part == PARTS[1]) as take:
            times = []
            for _ in range(BATCHES + 1):  # the first one warms up
                begin = process_time()
                take(int(steps))
                times.append(process_time() - begin)
            Path(out).write_text(repr(min(times[1:]) / int(steps)), encoding="utf-8")


if __name__ == "__main__":
    _main(*sys.argv[1:])
