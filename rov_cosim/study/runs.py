"""From a system to results on disk: build what changed, wire, change, simulate; table, CSV and picture."""

import re
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import click
from numpy.typing import NDArray
from tqdm import tqdm

from ..exporters.build import project_root
from ..master.apart import simulate_apart
from ..master.exchange import COUPLINGS
from ..master.instances import Instances
from ..master.interrupts import terminate_as_interrupted
from ..master.simulation import Progress, SimulationError, simulate
from ..ssp import reader
from ..ssp.declaration import System, wire
from ..ssp.wiring import Wiring
from ..whole.writer import write
from .archives import ssp_path
from .assessment import assessable, hold_begin, report
from .changes import Changes
from .csv_table import write_csv
from .scores import Score, score
from .screen import counted, say
from .settings import Settings

_LONGEST_NAME = 120
SHORT_HOLD = 5.0
"""Duration in s of a hold below which its verdict is doubted."""


@dataclass(frozen=True)
class Run:
    """A run: its name, the system that ran, its results, and why it ended early if it did."""

    name: str
    wiring: Wiring
    results: NDArray[Any]
    failure: str = ""
    is_interrupted: bool = False

    @property
    def score(self) -> Score | None:
        """How well it held the vehicle; None if there is no vehicle in it."""
        if not len(self.results):
            return Score("lost", reason=self.failure)
        if not assessable(self.wiring):
            return None
        return score(self.results, self.wiring, self.failure)


@contextmanager
def opened(
    system: System | Path,
    changes: Changes | None = None,
    export: str = "native",
    warn: Callable[[str], None] = lambda message: None,
    progress: Callable[[str], object] = lambda line: None,
) -> Iterator[Wiring]:
    """Yield the wiring of a system, its FMUs built in an export, or of any SSP archive, with changes in it.

    `warn` is called with what is not quite right and what the changes leave open, `progress` with what a build begins.

    Raises
    ------
    BuildError : an FMU cannot be built.
    WiringError : the system or a change is wrong.
    """
    changes = changes or Changes()
    if isinstance(system, System):
        yield changes.applied(wire(system, export=export, progress=progress), warn)
        return
    with reader.opened(system, warn) as wiring:
        yield changes.applied(replace(wiring, name=_archive_name(system, wiring)), warn)


def simulated(
    wiring: Wiring,
    settings: Settings | None = None,
    warn: Callable[[str], None] = lambda message: None,
    progress: Progress | None = None,
    instances: Instances | None = None,
    recorded: Collection[str] | None = None,
) -> Run:
    """Return the run of a system; one that fails, or is interrupted, has the results so far.

    The further arguments are those of `simulate`; progress is shown if left out, and with `instances` it runs in this
    process, whatever the settings say.

    Raises
    ------
    WiringError : the system cannot run, or not with these settings.
    UserError : the table of inputs cannot be read.
    """
    settings = settings or Settings()
    name = file_name("+".join([wiring.name, *settings.words()]))
    wiring = settings.timed(wiring)
    how: dict[str, Any] = {
        "coupling": COUPLINGS[settings.coupling],
        "progress": progress or _progress,
        "warn": warn,
        "inputs": settings.table(),
        "output_interval": settings.output_interval,
        "allow_not_finite": settings.allow_not_finite,
        "recorded": recorded,
    }
    try:
        if instances is None and settings.isolates(wiring):
            results = simulate_apart(wiring, timeout=settings.timeout, **how)
        else:
            results = simulate(wiring, instances=instances, **how)
    except SimulationError as error:
        return Run(name, wiring, error.results, str(error), error.is_interrupted)
    return Run(name, wiring, results)


def run(
    system: System | Path,
    changes: Changes | None = None,
    *,
    export: str = "native",
    settings: Settings | None = None,
    folder: Path | None = None,
    name: str = "",
    picture: Path | None = None,
    archive: Path | None = None,
) -> Run:
    """Simulate a system, print a table and a verdict, write NAME.csv and NAME.png; return the run.

    Parameters
    ----------
    system : a system, or the path of an SSP archive.
    changes : what differs from it.
    export : "native" or "pythonfmu", of a system's FMUs.
    settings : how it is taken.
    folder : where the files go; build/results if left out.
    name : of the files; made of the system's name and all that differs if left out.
    picture : the picture, PNG or SVG; NAME.png in the folder if left out.
    archive : where to write what is run as an SSP archive.

    Raises
    ------
    BuildError : an FMU cannot be built.
    WiringError : the system or a change is wrong.
    SimulationError : an FMU failed or the run was interrupted; the results so far are in the CSV.
    """
    terminate_as_interrupted()
    settings = settings or Settings()
    folder = (folder or results_folder()).absolute()  # an FMU may change the working directory
    folder.mkdir(parents=True, exist_ok=True)
    picture = picture and picture.absolute()
    with counted() as warn, opened(system, changes, export, warn, say) as wiring:
        if archive:
            _write(wiring, archive, settings, warn)
        done = simulated(wiring, settings, warn)
    default = done.name if export == "native" else f"{done.name}+{export}"
    done = replace(done, name=file_name(name or default))
    if not done.failure:
        click.echo(_table(done))
        if done.score and settings.output_interval:
            click.echo(f"All of this is of the rows that were recorded, one in {settings.output_interval:g} s.")
    csv = folder / f"{done.name}.csv"
    if len(done.results):
        write_csv(csv, done.results)
    if done.failure:
        _fail(done, csv)
    click.echo(f"\n{csv}")
    if done.score:
        from .plots import plot_run  # loads matplotlib, which takes longer than the run

        picture = picture or folder / f"{done.name}.png"
        plot_run(done.results, done.wiring, done.name, picture)
        click.echo(picture)
    return done


def _write(wiring: Wiring, archive: Path, settings: Settings, warn: Callable[[str], None]) -> None:
    if settings.coupling != "jacobi":
        warn(f"{archive} cannot say that its coupling is {settings.coupling}: other tools take Jacobi.")
    if settings.input is not None:
        warn(f"{archive} does not hold what {settings.input} feeds.")
    write(settings.timed(wiring), archive, warn=warn, progress=say)


def results_folder() -> Path:
    """Return where results are written unless the user says otherwise."""
    return project_root() / "build" / "results"


def file_name(name: str) -> str:
    """Return a name that any file system takes, with a digest of the whole where it had to be changed."""
    safe = re.sub(r"[^A-Za-z0-9_.=+,\[\]-]", "_", name)
    if safe == name and len(safe) <= _LONGEST_NAME:
        return safe
    return f"{safe[: _LONGEST_NAME - 9]}+{sha256(name.encode()).hexdigest()[:8]}"


def _table(done: Run) -> str:
    found = done.score
    if found is None:
        return "There is no vehicle with a pose eta in it, so nothing is assessed or drawn."
    duration = done.results["time"][-1] - hold_begin(done.results)
    doubt = f" (a hold of {duration:.2g} s is short for that)" if duration < SHORT_HOLD else ""
    return f"{report(done.results, done.wiring)}\n\nverdict: {found}{doubt}"


def _fail(done: Run, csv: Path) -> None:
    if not len(done.results):
        raise SimulationError(done.failure, done.results)
    if done.score:
        click.echo(f"verdict: {done.score}")
    raise SimulationError(f"{done.failure} The results so far are in {csv}.", done.results)


def _archive_name(path: Path, wiring: Wiring) -> str:
    """Return the name of an archive's system, with a digest unless it is where this project keeps the system's own."""
    if path.resolve() == ssp_path(wiring.name).resolve():
        return wiring.name
    return f"{path.stem}-{sha256(path.read_bytes()).hexdigest()[:6]}"


def _progress(steps: Any) -> Any:
    return tqdm(steps, unit="step", leave=False, delay=1.0, disable=None)
