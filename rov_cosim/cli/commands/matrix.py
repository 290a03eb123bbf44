"""The command `rov-cosim matrix`: runs, tables and picture of vehicles, troubles and controllers."""

import os
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click
from tqdm import tqdm

from ...ssp import swap_map
from ...study import session
from ...study.campaign import Matrix, MatrixError, run_all, wired
from ...study.scores import VERDICTS
from ...study.troubles import TROUBLES
from ...systems.fleet import CONTROLLERS, VEHICLES
from .. import options


def _some(name: str, known: Iterable[str]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    told = f"Only this {name}; can be given more than once."
    return click.option(
        f"--{name}", f"{name}s", type=options.OneOf(name, known), multiple=True, metavar="NAME", help=told
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
def command(
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
    changes = [f"{element} is {fmu.name}" for element, fmu in swaps.items()]
    note = "; ".join([*changes, *(f"{name} = {value}" for name, value in values.items())])
    # A part must not take the place of the whole.
    stem = "matrix_part" if note or vehicles or controllers or troubles else "matrix"
    with wired(session.project_root(), *chosen, swaps, maps, session.warn) as loops:
        changed = {pair: wiring.with_values(values) for pair, wiring in loops.items()}
        try:
            found = run_all(changed, troubles or tuple(TROUBLES), jobs, _progress)
        except MatrixError as error:
            _write(error.matrix, folder / "matrix_part", note)
            raise MatrixError(f"{error} The results so far are in {folder}.", error.matrix) from error
    if not found.scores:
        raise click.ClickException(f"No trouble applies: {' '.join(dict.fromkeys(found.left_out.values()))}")
    _write(found, folder / stem, note)
    for controller in chosen[1]:
        counts = Counter(score.verdict for cell, score in found.scores.items() if cell.controller == controller)
        click.echo(f"{controller:12} {', '.join(f'{counts[verdict]} {verdict}' for verdict in VERDICTS)}")
    if found.left_out:
        click.echo(f"{len(found.left_out)} more do not apply; {stem}.md tells why.")


def _write(found: Matrix, path: Path, note: str) -> None:
    from ...study import campaign_tables as matrix_tables

    if not found.scores:
        return
    matrix_tables.write_csv(found, path.with_suffix(".csv"))
    path.with_suffix(".md").write_text(matrix_tables.markdown(found, note), encoding="utf-8")
    matrix_tables.draw_heat_map(found, path.with_suffix(".png"), note)
    for suffix in (".csv", ".md", ".png"):
        click.echo(path.with_suffix(suffix))


def _progress(runs: Iterable[Any], total: int) -> Any:
    return tqdm(runs, total=total, unit="run", leave=False, disable=None)
