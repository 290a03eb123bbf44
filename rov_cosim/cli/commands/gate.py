"""`rov-cosim gate`: cells that have to keep their limits; what a CI job runs."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem
from tqdm import tqdm

from ... import systems
from ...ssp.wiring import suggestion
from ...study.gate import declared, junit, page
from ...study.gate.conduct import Cell, conduct
from ...study.runs import file_name, results_folder
from ...study.score_table import write_scores
from ...study.screen import counted, say
from .. import options, outputs

_SHIPPED = {file.stem: file for file in sorted((Path(systems.__file__).parent / "gates").glob("*.toml"))}


class _GateType(click.ParamType[Path]):
    """The path of a TOML file, or the name of a gate of this project."""

    name = "gate"

    def shell_complete(
        self, context: click.Context, parameter: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Return the gates whose names begin so, and files."""
        shipped = [CompletionItem(name) for name in _SHIPPED if name.startswith(incomplete)]
        return shipped or [CompletionItem(incomplete, type="file")]

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> Path:
        """Return the path."""
        if value in _SHIPPED:
            return _SHIPPED[value]
        if not str(value).endswith(".toml"):
            known = suggestion(value, _SHIPPED) or f" Known: {', '.join(_SHIPPED)}; or name a .toml."
            self.fail(f"there is no gate {value}.{known}")
        if not Path(value).is_file():
            self.fail(f"there is no file {value}.")
        return Path(value)


@click.command()
@click.argument("file", type=_GateType(), metavar="FILE.toml|NAME")
@options.jobs
@click.option(
    "--output",
    type=outputs.FOLDER,
    help="Folder for JUnit XML, Markdown, CSV and picture.",
)
def command(file: Path, jobs: int, output: Path | None) -> None:
    """Run the gate of a TOML file, or that of a NAME (quick): end with status 1 unless all keep their limits."""
    gate = declared.read(file)
    path = (output or results_folder()).absolute() / file_name(f"gate+{gate.name}")
    path.parent.mkdir(parents=True, exist_ok=True)
    with counted() as warn:
        outcome = conduct(gate, jobs, _progress, warn, say)
        for warning in outcome.warnings:
            warn(warning)
    for cell in outcome.of("green"):
        result = outcome.results[cell]
        click.echo(f"green  {', '.join(cell)}: {', '.join(filter(None, (str(result.score), page.kept(result))))}")
    for line in outcome.lines:
        click.echo(f"red    {line}")
    junit.write(outcome, path.with_name(f"{path.name}.xml"))
    path.with_name(f"{path.name}.md").write_text(page.markdown(outcome), encoding="utf-8")
    scores = {cell: result.score for cell, result in outcome.results.items() if result.score}
    write_scores(scores, Cell._fields, path.with_name(f"{path.name}.csv"))
    from ...study.gate import picture  # loads matplotlib, which takes a while

    picture.draw(outcome, path.with_name(f"{path.name}.png"))
    for suffix in (".xml", ".md", ".csv", ".png"):
        click.echo(path.with_name(f"{path.name}{suffix}"))
    if outcome.is_red:
        raise click.ClickException(outcome.verdict)
    click.echo(outcome.verdict)


def _progress(runs: Iterable[Any], total: int) -> Any:
    return tqdm(runs, total=total, unit="run", leave=False, disable=None)
