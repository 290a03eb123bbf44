"""`rov-cosim campaign`: many runs of a system, with what varies drawn anew for each."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click
from tqdm import tqdm

from ...study.campaign import declared, servant
from ...study.campaign.errors import with_extra
from ...study.runs import file_name, results_folder
from ...study.screen import counted, say
from .. import options, outputs


def _toml(context: click.Context, parameter: click.Parameter, path: Path) -> Path:
    if path.suffix != ".toml":
        raise click.BadParameter(f"expected a name that ends in .toml, got {path}")
    return path


@click.command()
@click.argument(
    "file",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    callback=_toml,
)
@options.jobs
@options.scheduler
@click.option("--output", type=outputs.FOLDER, help="Folder for table, report and picture.")
@click.option("--fresh", is_flag=True, help="Run all anew, also what is recorded.")
def command(file: Path, jobs: int, scheduler: str, output: Path | None, fresh: bool) -> None:
    """Run the campaign of FILE, a TOML: a table in Parquet, how sure the hold is, and what matters.

    What a run of the same campaign recorded before it was interrupted, or killed, is taken as it is.
    """
    if not scheduler:
        servant.begin()
    found = declared.read(file)
    path = (output or results_folder()).absolute() / f"{file_name(f'campaign+{file.stem}')}.parquet"
    path.parent.mkdir(parents=True, exist_ok=True)
    with counted() as warn:
        outcome = with_extra("conduct").conduct(found, path, jobs, scheduler, fresh, _progress, warn, say)
    text = with_extra("analysis").report(outcome)
    click.echo(text)
    click.echo(f"\n{path}")
    path.with_suffix(".txt").write_text(f"{text}\n", encoding="utf-8")
    click.echo(path.with_suffix(".txt"))
    with_extra("picture").draw(outcome, path.stem, path.with_suffix(".png"))
    click.echo(path.with_suffix(".png"))


def _progress(runs: Iterable[int], total: int, before: int) -> Any:
    return tqdm(runs, total=total, initial=before, unit="run", leave=False, disable=None)
