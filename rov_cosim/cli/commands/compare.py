"""`rov-cosim compare`: several runs in one figure and one table."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import click

from ...errors import UserError
from ...ssp.declaration import System
from ...study.changes import Changes
from ...study.runs import Run, file_name, opened, results_folder, simulated
from ...study.score_table import table, write_scores
from ...study.screen import counted, say
from ...study.troubles import TROUBLES
from .. import options

Varied = list[tuple[str, list[str]]]


def _varied(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> Varied:
    found = dict(options.assigned(texts, "ELEMENT.VARIABLE=VALUE,VALUE,... or trouble=NAME,NAME,..."))
    varied = [(end, [value.strip() for value in values.split(",")]) for end, values in found.items()]
    for end, values in varied:
        if twice := {value for value in values if values.count(value) > 1}:
            raise click.BadParameter(f"{end} has {', '.join(sorted(twice))} twice")
        if end == "trouble":
            for name in values:
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
@options.coupling
@options.stop_time
@options.changes
@click.option(
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    callback=options.suffix(".png", ".svg"),
    help="The picture; a CSV of its name lies beside it.",
)
@options.fail_on
def command(
    systems: tuple[System | Path, ...],
    varied: Varied,
    export: str,
    coupling: str,
    stop_time: float | None,
    changes: Changes,
    output: Path | None,
    fail_on: str | None,
) -> None:
    """Run several SYSTEMS, or one in several ways: their errors in one figure, a table and its CSV."""
    runs: dict[str, Run] = {}
    with counted() as warn:
        for system in systems:
            for values in product(*(values for _, values in varied)):
                words = dict(zip((end for end, _ in varied), values, strict=True))
                with opened(system, _with(changes, words), export, warn, say) as wiring:
                    done = simulated(wiring, coupling, stop_time, warn)
                label = _label(system, words, len(systems) > 1)
                if label in runs:
                    raise click.UsageError(f"{label} stands twice: the same run says nothing new.")
                if done.score is None:
                    raise click.UsageError(f"{label} has no vehicle with a pose eta: there is nothing to compare.")
                runs[label] = done
    if len(runs) < 2:
        raise click.UsageError("One run is nothing to compare: name another system, or vary something by --vary.")
    scores = {label: done.score for label, done in runs.items() if done.score}
    click.echo(table(scores))
    name = file_name("+".join(["compare", *(run.name for run in runs.values())]))
    path = (output or results_folder() / f"{name}.png").absolute()
    path.parent.mkdir(parents=True, exist_ok=True)
    csv = path.with_name(f"{path.stem}.csv")
    write_scores({(label,): found for label, found in scores.items()}, ("run",), csv)
    click.echo(f"\n{csv}")
    from ...study.plots import plot_comparison  # loads matplotlib, which takes longer than the runs

    drawn = {label: (done.results, done.wiring) for label, done in runs.items() if len(done.results)}
    if drawn:
        plot_comparison(drawn, path)
        click.echo(path)
    if failed := [f"{label}: {done.failure}" for label, done in runs.items() if done.failure]:
        raise UserError("\n".join(failed))
    if fail_on:
        options.gate(scores, fail_on)


def _with(changes: Changes, words: dict[str, str]) -> Changes:
    """Return the changes with what varies besides."""
    trouble = [value for end, value in words.items() if end == "trouble"]
    values = {end: value for end, value in words.items() if end != "trouble"}
    return replace(changes, values={**changes.values, **values}, troubles=(*changes.troubles, *trouble))


def _label(system: System | Path, words: dict[str, str], several: bool) -> str:
    """Return what tells a run from the others."""
    name = system.name if isinstance(system, System) else str(system)
    varied = [value if end == "trouble" else f"{end}={value}" for end, value in words.items()]
    return ", ".join(([name] if several or not varied else []) + varied)
