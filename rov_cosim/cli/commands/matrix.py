"""The command `rov-cosim matrix`: runs, tables and picture of vehicles, troubles and controllers."""

import shlex
import sys
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click
from tqdm import tqdm

from ...study.campaign import servant
from ...study.changes import Changes
from ...study.matrix import Cell, Matrix, MatrixError, run_all, wired
from ...study.runs import file_name, results_folder
from ...study.score_table import write_scores
from ...study.scores import VERDICTS
from ...study.screen import counted, say
from ...study.troubles import TROUBLES
from ...systems.catalogue import SYSTEMS
from ...systems.fleet import CONTROLLERS, VEHICLES, WIRED
from ...systems.loop import CONTROLLER
from .. import options, outputs

MOST_LINES = 30
"""Runs that are shown one by one."""


def _some(name: str, known: Iterable[str], which: str = "Only") -> Callable[[Callable[..., None]], Callable[..., None]]:
    names = list(known)
    shown = "NAME" if len(names) > 5 else "|".join(names)
    description = f"{which} this {name}; can be given more than once."
    return click.option(
        f"--{name}", f"{name}s", type=options.OneOf(name, names), multiple=True, metavar=shown, help=description
    )


@click.command()
@_some("vehicle", [*VEHICLES, *WIRED])
@_some("controller", CONTROLLERS)
@_some("trouble", TROUBLES)
@_some("system", SYSTEMS, "Besides the vehicles, or alone if none is named,")
@options.changes_but_troubles
@click.option(
    "--seeds",
    type=click.IntRange(1),
    default=1,
    show_default=True,
    help="Seeds of noise and current; a cell has the worst of them.",
)
@options.jobs
@options.scheduler
@click.option("--output", type=outputs.FOLDER, help="Folder for CSV, Markdown and picture.")
@options.fail_on
def command(
    vehicles: tuple[str, ...],
    controllers: tuple[str, ...],
    troubles: tuple[str, ...],
    systems: tuple[str, ...],
    changes: Changes,
    seeds: int,
    jobs: int,
    scheduler: str,
    output: Path | None,
    fail_on: str | None,
) -> None:
    """Run every vehicle with every controller in every trouble, and tell which held it."""
    if not scheduler:
        servant.begin()
    folder = (output or results_folder()).absolute()
    folder.mkdir(parents=True, exist_ok=True)
    if CONTROLLER in changes.swaps and len(controllers) > 1:
        raise click.UsageError(
            "--swap puts one controller into all loops: name one --controller, whose values it gets."
        )
    chosen = vehicles or (() if systems else (*VEHICLES, *WIRED)), controllers or tuple(CONTROLLERS)
    swapped = [f"{element} is {fmu.name}" for element, fmu in changes.swaps.items()]
    note = "; ".join([*swapped, *(f"{name} = {value}" for name, value in changes.values.items())])
    several = [f"seeds={seeds}"] if seeds > 1 else []
    # A part must not take the place of the whole, nor of another part.
    stem = file_name("+".join(["matrix", *vehicles, *controllers, *systems, *changes.words(), *troubles, *several]))
    with counted() as warn:
        loops = wired(*chosen, changes, warn, [SYSTEMS[name] for name in systems], say)
    if not loops:
        raise click.UsageError(f"{' and '.join(vehicles)}: no system with such a controller. Leave --controller out.")
    try:
        found = run_all(loops, troubles or tuple(TROUBLES), jobs, _progress, scheduler, seeds)
    except MatrixError as error:
        if not error.matrix.scores:
            raise
        _write(error.matrix, folder / f"{stem}-until-interrupted", " ".join(filter(None, (note, f"{error}"))))
        raise MatrixError(f"{error} The results so far are in {folder}.", error.matrix) from error
    if not found.scores:
        raise click.ClickException(f"No trouble applies: {' '.join(dict.fromkeys(found.left_out.values()))}")
    _write(found, folder / stem, note)
    if len(found.scores) <= MOST_LINES:
        for cell, score in found.scores.items():
            click.echo(f"{', '.join(cell)}: {score}")
    for controller in dict.fromkeys(controller for _, controller in loops):
        counts = Counter(score.verdict for cell, score in found.scores.items() if cell.controller == controller)
        click.echo(f"{controller:12} {', '.join(f'{counts[verdict]} {verdict}' for verdict in VERDICTS)}")
    if found.left_out:
        click.echo(f"{len(found.left_out)} more do not apply; {stem}.md tells why.")
    if fail_on:
        options.gate({", ".join(cell): score for cell, score in found.scores.items()}, fail_on)


def _write(found: Matrix, path: Path, note: str) -> None:
    from ...study import matrix_tables  # loads matplotlib, which takes a while

    write_scores(found.scores, Cell._fields, path.with_name(f"{path.name}.csv"))
    command = shlex.join(["rov-cosim", *sys.argv[1:]])
    page = matrix_tables.markdown(found, command, f"{path.name}.svg", note)
    path.with_name(f"{path.name}.md").write_text(page, encoding="utf-8")
    pictures = [path.with_name(f"{path.name}{suffix}") for suffix in (".png", ".svg")]
    matrix_tables.draw_heat_map(found, pictures, note)
    for suffix in (".csv", ".md", ".png", ".svg"):
        click.echo(path.with_name(f"{path.name}{suffix}"))


def _progress(runs: Iterable[Any], total: int) -> Any:
    return tqdm(runs, total=total, unit="run", leave=False, disable=None)
