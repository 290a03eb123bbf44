"""From a declaration to results on disk: build what changed, run, write CSV, plot and table."""

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
from fmpy.util import write_csv
from numpy.typing import NDArray
from tqdm import tqdm

from ..exporters.build import build_fmus, components, fmu_path
from ..exporters.build import project_root as project_root
from ..master.master import Coupling, SimulationError, jacobi, simulate
from ..ssp import reader as ssp_reader
from ..ssp import swap_map
from ..ssp import writer as ssp_writer
from ..ssp.declaration import System, wire
from ..ssp.swapping import with_swaps
from ..ssp.wiring import Wiring
from .assessment import assessable, report
from .plots import plot_run
from .scores import HOLD_DURATION, score
from .troubles import TROUBLES


def ssp_path(system: System, export: str = "native") -> Path:
    """Return where the archive of a system lies, with FMUs of an export."""
    folder = project_root() / ("systems" if export == "native" else f"build/{export}")
    return folder / f"{system.name}.ssp"


def results_folder() -> Path:
    """Return where results are written unless the user says otherwise."""
    return project_root() / "build" / "results"


def build(
    *systems: System, export: str = "native", platforms: Iterable[str] = (), plain: bool = False
) -> dict[Path, bool]:
    """Build the FMUs and the archives of systems; return for each path whether it was written or was current.

    Raises
    ------
    BuildError : an FMU cannot be built.
    WiringError : a system is wrong.
    """
    root = project_root()
    built = build_fmus(root, export, platforms)
    fmus = {name: fmu_path(root, name, export) for name in components()}
    for system in systems:
        path = ssp_path(system, export)
        built[path] = ssp_writer.write(wire(system, fmus), path, plain)
    return built


@contextmanager
def opened(
    system: System | Path,
    export: str = "native",
    *,
    swaps: Mapping[str, Path] | None = None,
    map_: Path | None = None,
    values: Mapping[str, str] | None = None,
    troubles: Iterable[str] = (),
) -> Iterator[Wiring]:
    """Yield the wiring of a system, built first in an export, or of any SSP archive, which has its FMUs.

    Parameters
    ----------
    swaps : FMU files that take the place of elements, by element.
    map_ : a TOML file that tells how (see `swap_map`); none for FMUs with our names.
    values : other start values, by ``element.variable``, as literals.
    troubles : names of `TROUBLES` that come over it then.

    Raises
    ------
    BuildError : an FMU cannot be built.
    WiringError : the system, a swap, the map or a value is wrong, or a trouble does not apply to it.
    """
    maps = swap_map.read(map_) if map_ else {}
    if isinstance(system, System):
        build(system, export=export)
        system = ssp_path(system, export)
    with ssp_reader.opened(system) as wiring, with_swaps(wiring, swaps or {}, maps, warn) as swapped:
        changed = swapped.with_values(values or {})
        for trouble in troubles:
            changed = TROUBLES[trouble].applied(changed)
        yield changed


def run(
    system: System | Path,
    *,
    export: str = "native",
    coupling: Coupling = jacobi,
    stop_time: float | None = None,
    folder: Path | None = None,
    **changes: Any,
) -> tuple[NDArray[Any], Wiring]:
    """Simulate a system, write NAME.csv and NAME.png, print a table; return the results and the wiring.

    `changes` are those of `opened`: swaps, map_, values, troubles.

    Raises
    ------
    WiringError : the system or a change is wrong.
    SimulationError : an FMU failed or the run was interrupted; the results so far are in the CSV.
    """
    folder = folder or results_folder()
    folder.mkdir(parents=True, exist_ok=True)
    with opened(system, export, **changes) as wiring:
        csv = folder / f"{re.sub(r'[^A-Za-z0-9_-]', '_', wiring.name)}.csv"
        try:
            results = simulate(wiring, coupling, stop_time, progress=_progress, warn=warn)
        except SimulationError as error:
            if len(error.results):
                write_csv(csv, error.results)
                raise SimulationError(f"{error} The results so far are in {csv}.", error.results) from error
            raise
    write_csv(csv, results)
    if assessable(results, wiring):
        plot_run((results, wiring), csv.with_suffix(".png"))
        click.echo(report(results, wiring))
        if results["time"][-1] >= 2 * HOLD_DURATION:
            found = score(results, wiring)
            click.echo(
                f"\nverdict over the last {HOLD_DURATION:g} s: {found.verdict}{found.reason and f', {found.reason}'}"
            )
        click.echo(f"\n{csv}\n{csv.with_suffix('.png')}")
    else:
        click.echo("There is no vehicle with a pose eta in it, so nothing is assessed or drawn.")
        click.echo(csv)
    return results, wiring


def _progress(steps: Any) -> Any:
    return tqdm(steps, unit="step", leave=False, delay=1.0, disable=None)


def warn(message: str) -> None:
    """Show a warning of an FMU."""
    click.echo(f"warning: {message}", err=True)
