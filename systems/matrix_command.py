"""The command `rov-cosim matrix`: runs, tables and picture of vehicles, troubles and controllers."""

import os
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click
from tqdm import tqdm

from . import options, session, swap_map
from .fleet import CONTROLLERS, VEHICLES
from .matrix import MatrixError, Scores, run_all, wired
from .scores import VERDICTS
from .troubles import TROUBLES

_Decorator = Callable[[Callable[..., None]], Callable[..., None]]


def _some(name: str, known: Iterable[str]) -> _Decorator:
    return click.option(
        f"--{name}",
        f"{name}s",
        type=click.Choice(list(known)),
        multiple=True,
        metavar="NAME",
        help=f"Only this {name}; can be given more than once.",
    )


@click.command()
@_some("vehicle", VEHICLES)
@_some("controller", CONTROLLERS)
@_some("trouble", TROUBLES)
@options.set_
@options.swap
@options.map_
@click.option(
    "--jobs", type=click.IntRange(min=1), default=os.cpu_count() or 1, help="Processes; one a core if left out."
)
@click.option(
    "--output", type=click.Path(file_okay=False, path_type=Path), help="Folder for CSV, Markdown and picture."
)
def matrix(
    vehicles: tuple[str, ...],
    controllers: tuple[str, ...],
    troubles: tuple[str, ...],
    values: dict[str, str],
    swaps: dict[str, Path],
    map_: Path | None,
    jobs: int,
    output: Path | None,
) -> None:
    """Run every vehicle with every controller in every trouble, and tell which held it."""
    folder = output or session.results_folder()
    folder.mkdir(parents=True, exist_ok=True)
    maps = swap_map.read(map_) if map_ else {}
    chosen = vehicles or tuple(VEHICLES), controllers or CONTROLLERS
    with wired(session.project_root(), *chosen, swaps, maps, session.warn) as loops:
        changed = {pair: wiring.with_values(values) for pair, wiring in loops.items()}
        try:
            scores = run_all(changed, troubles or tuple(TROUBLES), jobs, _progress)
        except MatrixError as error:
            _write(error.scores, folder)
            raise MatrixError(f"{error} The results so far are in {folder}.", error.scores) from error
    _write(scores, folder)
    for controller in chosen[1]:
        found = Counter(score.verdict for cell, score in scores.items() if cell.controller == controller)
        click.echo(f"{controller:12} {', '.join(f'{found[verdict]} {verdict}' for verdict in VERDICTS)}")


def _write(scores: Scores, folder: Path) -> None:
    from . import matrix_tables  # loads the plotting, which takes a while

    if not scores:
        return
    matrix_tables.write_csv(scores, folder / "matrix.csv")
    (folder / "matrix.md").write_text(matrix_tables.markdown(scores), encoding="utf-8")
    matrix_tables.draw_heat_map(scores, folder / "matrix.png")
    for suffix in ("csv", "md", "png"):
        click.echo(folder / f"matrix.{suffix}")


def _progress(runs: Iterable[Any], total: int) -> Any:
    return tqdm(runs, total=total, unit="run", leave=False, disable=None)
