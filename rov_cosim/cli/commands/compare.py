"""`rov-cosim compare`: several runs in one figure."""

from pathlib import Path
from typing import Any

import click

from ...master.master import COUPLINGS, simulate
from ...ssp.declaration import System
from ...study import session
from ...study.assessment import assessable
from ...study.plots import Run, plot_comparison
from .. import options


@click.command()
@click.argument("systems", type=options.SystemType(), nargs=-1, required=True)
@options.export
@options.coupling
@options.stop_time
@options.changes
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path), callback=options.png, help="The PNG.")
def command(
    systems: tuple[System | Path, ...],
    export: str,
    coupling: str,
    stop_time: float | None,
    output: Path | None,
    **changes: Any,
) -> None:
    """Run several SYSTEMS and draw their errors into one figure."""
    runs: dict[str, Run] = {}
    for system in systems:
        with session.opened(system, export, **changes) as wiring:
            label = wiring.name if isinstance(system, System) else str(system)
            results = simulate(wiring, COUPLINGS[coupling], stop_time, warn=session.warn)
        if not assessable(results, wiring):
            raise click.UsageError(f"{label} has no vehicle with a pose eta: there is nothing to compare.")
        runs[label] = (results, wiring)
    path = output or session.results_folder() / f"compare-{'-'.join(Path(label).stem for label in runs)}.png"
    plot_comparison(runs, path)
    click.echo(path)
