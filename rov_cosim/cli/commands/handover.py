"""`rov-cosim handover`: kits, and the check of an import."""

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

import click
from tqdm import tqdm

from ...components.interface import Component
from ...exporters.build import components, project_root
from ...exporters.zig import CURE, TARGETS, BuildError, host_platform
from ...study.screen import say
from .. import outputs


@click.group()
def command() -> None:
    """Hand a component to another team, and check what they made of it."""


def _kit(name: str) -> click.Command:
    @click.option("--output", type=outputs.FOLDER, help="Folder for the kit.")
    @click.option("--this-platform", is_flag=True, help="A binary for this machine alone, which is sooner built.")
    def write(output: Path | None, this_platform: bool) -> None:
        try:
            from ...handover import kit
        except ModuleNotFoundError as error:
            raise BuildError(f"A kit needs {error.name}, which is not installed: {CURE}") from None
        folder = output or project_root() / "build" / "handover"
        platforms = [host_platform()] if this_platform else [*TARGETS]
        component = components()[name]
        for path in kit.write(component, folder, platforms, _progress, _page(component)):
            click.echo(path)

    return click.command(name, help=f"Write the kit of {name}: FMU, guide, parameter sets, reference runs.")(write)


def _page(component: Component) -> bytes | None:
    """Return the live page of a component; None, and a line that tells why, if there is no npm for it."""
    from ...handover import live
    from ...report.bundle import BundleError

    try:
        return live.written(component, progress=say)
    except BundleError as error:
        say(f"The kit is without {live.NAME}: {str(error).splitlines()[0]}")
        return None


def _progress(steps: Iterable[str], what: str) -> Iterator[str]:
    with tqdm(list(steps), leave=False, disable=None) as bar:
        for step in bar:
            if bar.disable:  # there is no terminal
                say(f"{what} {step}")
            else:
                bar.set_description(f"{what} {step}")
            yield step


for _name in components():
    command.add_command(_kit(_name))


@command.command()
@click.argument("fmu", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option(
    "--component", type=click.Choice(list(components())), help="Whose behaviour; by the FMU's name if left out."
)
@click.option(
    "--map",
    "map_",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="TOML: what the FMU's variables are, as for `run --swap`; none if it has the same names.",
)
def check(fmu: Path, component: str | None, map_: Path | None) -> None:
    """Replay the reference runs through an FMU file; say signal by signal whether it conforms."""
    from ...handover import verdict

    lines, conforms = verdict.judge(fmu, component, map_)
    for line in lines:
        click.echo(line)
    sys.exit(0 if conforms else 1)


@command.command()
def importers() -> None:
    """Run the controller and a system in the tools of others, and write docs/IMPORTERS.md."""
    from ...importers.page import write_page

    page = project_root() / "docs" / "IMPORTERS.md"
    failures = write_page(page, _progress)
    click.echo(page)
    if failures:
        raise click.ClickException("\n".join(failures))


@command.command()
def simulators() -> None:
    """Hold a vehicle in the simulators of others by the kit's examples, and write docs/SIMULATORS.md."""
    from ...importers.simulators import write_page

    click.echo(write_page(project_root() / "docs", _progress))
