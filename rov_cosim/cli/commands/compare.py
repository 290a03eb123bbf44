"""`rov-cosim compare`: several runs in one figure and one table."""

from contextlib import ExitStack
from dataclasses import replace
from itertools import product
from pathlib import Path

import click

from ...errors import UserError
from ...ssp.declaration import System
from ...ssp.wiring import Wiring
from ...study.assessment import assessable
from ...study.changes import Changes
from ...study.runs import Run, file_name, opened, results_folder, simulated
from ...study.score_table import comparison, write_scores
from ...study.screen import counted, say
from ...study.settings import Settings
from ...study.troubles import TROUBLES
from .. import options, outputs

Varied = dict[str, list[str]]


def _varied(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> Varied:
    found = dict(options.assigned(texts, "ELEMENT.VARIABLE=VALUE,VALUE,... or trouble=NAME,NAME,..."))
    varied = {end: [value.strip() for value in values.split(",")] for end, values in found.items()}
    for name in varied.get("trouble", ()):
        options.OneOf("trouble", TROUBLES).convert(name, parameter, context)
    return varied


@click.command()
@click.argument("systems", type=options.SystemType(), nargs=-1, required=True)
@click.option(
    "--vary",
    "varied",
    multiple=True,
    callback=_varied,
    metavar="ELEMENT.VARIABLE=V,V,...",
    help="A run for each value, or for each trouble (trouble=NAME,NAME); several vary in every combination.",
)
@options.export
@options.settings
@options.changes
@click.option(
    "--output",
    type=outputs.Place(".png", ".svg"),
    help="The picture; a CSV of its name lies beside it.",
)
@options.fail_on
def command(
    systems: tuple[System | Path, ...],
    varied: Varied,
    export: str,
    settings: Settings,
    changes: Changes,
    output: Path | None,
    fail_on: str | None,
) -> None:
    """Run several SYSTEMS, or one in several ways: their errors in one figure, a table and its CSV."""
    if twice := [end for end in varied if end in changes.values]:
        raise click.UsageError(f"{twice[0]} is set and varied: take one of --set and --vary.")
    names = [_name(system) for system in systems]
    title = "+".join([*dict.fromkeys(names), *(f"{end}={','.join(values)}" for end, values in varied.items())])
    path = (output or results_folder() / f"{file_name(f'compare+{title}')}.png").absolute()
    path.parent.mkdir(parents=True, exist_ok=True)
    with counted() as warn, ExitStack() as stack:
        wirings: dict[str, Wiring] = {}
        for system in systems:
            for values in product(*varied.values()):
                words = dict(zip(varied, values, strict=True))
                wiring = stack.enter_context(opened(system, _with(changes, words), export, warn, say))
                _add(wirings, _label(system, words, len(systems) > 1), wiring)
        if len(wirings) < 2:
            raise click.UsageError("One run is nothing to compare: name another system, or vary something by --vary.")
        runs: dict[str, Run] = {}
        for label, wiring in wirings.items():
            runs[label] = simulated(wiring, settings, warn)
            if runs[label].is_interrupted:
                break
    _show(runs, title if varied else "", path)
    if failed := [f"{label}: {done.failure}" for label, done in runs.items() if done.failure]:
        raise UserError("\n".join(failed))
    if fail_on:
        options.gate({label: done.score for label, done in runs.items()}, fail_on)


def _add(wirings: dict[str, Wiring], label: str, wiring: Wiring) -> None:
    if not assessable(wiring):
        raise click.UsageError(f"{label} has no vehicle with a pose eta: there is nothing to compare.")
    for other, known in wirings.items():
        if wiring.runs_as(known):
            raise click.UsageError(f"{label} is the same run as {other}: it says nothing new.")
    wirings[label] = wiring


def _show(runs: dict[str, Run], title: str, path: Path) -> None:
    """Print the table, write its CSV and the picture, of runs that came so far."""
    scores = {label: done.score for label, done in runs.items() if done.score}
    click.echo(comparison(runs))
    csv = path.with_name(f"{path.stem}.csv")
    write_scores({(label,): found for label, found in scores.items()}, ("run",), csv)
    click.echo(f"\n{csv}")
    drawn = {label: (done.results, done.wiring) for label, done in runs.items() if len(done.results)}
    if drawn:
        from ...study.plots import plot_comparison  # loads matplotlib, which takes longer than the runs

        plot_comparison(drawn, title, path)
        click.echo(path)


def _with(changes: Changes, words: dict[str, str]) -> Changes:
    """Return the changes with what varies besides."""
    trouble = [value for end, value in words.items() if end == "trouble"]
    values = {end: value for end, value in words.items() if end != "trouble"}
    return replace(changes, values={**changes.values, **values}, troubles=(*changes.troubles, *trouble))


def _name(system: System | Path) -> str:
    return system.name if isinstance(system, System) else str(system)


def _label(system: System | Path, words: dict[str, str], several: bool) -> str:
    """Return what tells a run from the others."""
    varied = [value if end == "trouble" else f"{end}={value}" for end, value in words.items()]
    return ", ".join(([_name(system)] if several or not varied else []) + varied)
