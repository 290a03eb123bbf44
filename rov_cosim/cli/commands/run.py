"""`rov-cosim run`: a system, simulated."""

from pathlib import Path
from typing import Any

import click

from ...master.master import COUPLINGS
from ...ssp.declaration import System
from ...study import session
from .. import options


@click.command()
@click.argument("system", type=options.SystemType())
@options.export
@options.coupling
@options.stop_time
@options.changes
@click.option("--output", type=click.Path(file_okay=False, path_type=Path), help="Folder for CSV and plot.")
def command(
    system: System | Path, export: str, coupling: str, stop_time: float | None, output: Path | None, **changes: Any
) -> None:
    """Run SYSTEM, a name from `list` or an .ssp file: CSV, plot and a table of results."""
    how = COUPLINGS[coupling]
    session.run(system, export=export, coupling=how, stop_time=stop_time, folder=output, **changes)
