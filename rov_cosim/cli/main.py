"""The command `rov-cosim`."""

import sys
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import click

from ..exporters.build import EXPORTS, components
from ..exporters.zig import TARGETS, BuildError, host_platform
from ..handover.check import CheckError
from ..master.master import COUPLINGS, SimulationError, simulate
from ..ssp.declaration import System
from ..ssp.wiring import WiringError
from ..study import session
from ..study.assessment import assessable
from ..study.campaign import MatrixError
from ..study.plots import Run, plot_comparison
from ..study.troubles import TROUBLES, Trouble
from ..systems.catalogue import SYSTEMS
from . import options
from .matrix import matrix


class _Command(click.Group):
    """A group that ends with one line on stderr and exit status 1 where the user's input is at fault."""

    def invoke(self, context: click.Context) -> Any:
        try:
            return super().invoke(context)
        except BrokenPipeError:
            raise  # click ends quietly
        except (BuildError, CheckError, MatrixError, WiringError, SimulationError, OSError) as error:
            raise click.ClickException(str(error)) from error


@click.group(cls=_Command)
@click.version_option(package_name="rov-cosim")
def main() -> None:
    """Hold an underwater vehicle in place: build, run and compare systems of FMUs."""


@main.command("list")
def list_systems() -> None:
    """List the systems."""
    _list(SYSTEMS.values())


@main.command("troubles")
def list_troubles() -> None:
    """List what can go wrong, for --trouble, in the systems of the fleet."""
    _list(TROUBLES.values())


def _list(named: Iterable[System | Trouble]) -> None:
    width = max(len(one.name) for one in named)
    for one in named:
        click.echo(f"{one.name:{width}}  {one.description}")


@main.command()
@options.export
@click.option(
    "--all-platforms", is_flag=True, help="Native binaries for Linux, Windows and macOS, not this machine's alone."
)
@click.option("--plain-ssp", is_flag=True, help="Archives with SSP content alone, which `fmpy simulate` cannot run.")
def build(export: str, all_platforms: bool, plain_ssp: bool) -> None:
    """Build all FMUs and SSP archives; what is current stays untouched."""
    if all_platforms and export != "native":
        raise click.UsageError("--all-platforms is for the native export: a pythonfmu FMU has all that pythonfmu has.")
    platforms = TARGETS if all_platforms else ()
    built = session.build(*SYSTEMS.values(), export=export, platforms=platforms, plain=plain_ssp)
    for path, written in built.items():
        click.echo(f"{'built  ' if written else 'current'}  {path}")


@main.command()
@click.argument("system", type=options.SystemType())
@options.export
@options.coupling
@options.stop_time
@options.changes
@click.option("--output", type=click.Path(file_okay=False, path_type=Path), help="Folder for CSV and plot.")
def run(
    system: System | Path, export: str, coupling: str, stop_time: float | None, output: Path | None, **changes: Any
) -> None:
    """Run SYSTEM, a name from `list` or an .ssp file: CSV, plot and a table of results."""
    how = COUPLINGS[coupling]
    session.run(system, export=export, coupling=how, stop_time=stop_time, folder=output, **changes)


@main.command()
@click.argument("systems", type=options.SystemType(), nargs=-1, required=True)
@options.export
@options.coupling
@options.stop_time
@options.changes
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path), callback=options.png, help="The PNG.")
def compare(
    systems: tuple[System | Path, ...],
    export: str,
    coupling: str,
    stop_time: float | None,
    output: Path | None,
    **changes: Any,
) -> None:
    """Run several SYSTEMS and draw their errors into one figure."""
    runs: dict[str, Run] = {}
    for system in systems:
        with session.opened(system, export, **changes) as wiring:
            label = wiring.name if isinstance(system, System) else str(system)
            results = simulate(wiring, COUPLINGS[coupling], stop_time, warn=session.warn)
        if not assessable(results, wiring):
            raise click.UsageError(f"{label} has no vehicle with a pose eta: there is nothing to compare.")
        runs[label] = (results, wiring)
    path = output or session.results_folder() / f"compare-{'-'.join(Path(label).stem for label in runs)}.png"
    plot_comparison(runs, path)
    click.echo(path)


@main.group()
def handover() -> None:
    """Hand a component to another team, and check what they made of it."""


def _kit(name: str) -> click.Command:
    @click.option("--output", type=click.Path(file_okay=False, path_type=Path), help="Folder for the kit.")
    @click.option("--this-platform", is_flag=True, help="A binary for this machine alone, which is sooner built.")
    def write(output: Path | None, this_platform: bool) -> None:
        session.build()
        from ..handover import kit

        folder = output or session.project_root() / "build" / "handover"
        for path in kit.write(components()[name], folder, [host_platform()] if this_platform else TARGETS):
            click.echo(path)

    return click.command(name, help=f"Write the kit of {name}: FMU, guide, parameter sets, reference runs.")(write)


for _name in components():
    handover.add_command(_kit(_name))


@handover.command()
@click.argument("fmu", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option(
    "--component", type=click.Choice(list(components())), help="Whose behaviour; by the FMU's name if left out."
)
@click.option(
    "--map", "map_", type=click.Path(exists=True, dir_okay=False, path_type=Path), help='TOML: "theirs" = "ours".'
)
def check(fmu: Path, component: str | None, map_: Path | None) -> None:
    """Replay the reference runs through an FMU file; say signal by signal whether it conforms."""
    from ..handover import verdict

    lines, conforms = verdict.judge(fmu, component, map_)
    for line in lines:
        click.echo(line)
    sys.exit(0 if conforms else 1)


@handover.command()
def importers() -> None:
    """Run the controller and a system in the tools of others, and write docs/IMPORTERS.md."""
    session.build()
    from ..importers.page import write_page

    click.echo(write_page())


@main.command()
@click.argument("system", type=click.Choice(list(SYSTEMS)), default="station_keeping")
def benchmark(system: str) -> None:
    """Measure what a run costs in both exports, and the floor: steps, loops, whole commands."""
    for export in EXPORTS:
        session.build(SYSTEMS[system], export=export)
    from ..benchmark import report as benchmarking

    with TemporaryDirectory() as folder:
        for line in benchmarking.report(SYSTEMS[system], folder):
            click.echo(line)


main.add_command(matrix)


if __name__ == "__main__":
    main()
