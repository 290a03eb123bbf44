"""The command `rov-cosim`."""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import click

from ..exporters.build import EXPORTS, components
from ..exporters.zig import TARGETS, BuildError, host_platform
from ..handover.check import CheckError
from . import session
from .assessment import assessable
from .catalogue import SYSTEMS
from .declaration import System
from .master import COUPLINGS, SimulationError, simulate
from .plots import Run, plot_comparison
from .wiring import WiringError, suggestion


class _Command(click.Group):
    """A group that ends with one line on stderr and exit status 1 where the user's input is at fault."""

    def invoke(self, context: click.Context) -> Any:
        try:
            return super().invoke(context)
        except BrokenPipeError:
            raise  # click ends quietly
        except (BuildError, CheckError, WiringError, SimulationError, OSError) as error:
            raise click.ClickException(str(error)) from error


class _SystemType(click.ParamType[System | Path]):
    """The name of a system of this project, or the path of an SSP archive."""

    name = "system"

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> System | Path:
        if value in SYSTEMS:
            return SYSTEMS[value]
        if str(value).endswith(".ssp"):
            return Path(value)
        self.fail(
            f"there is no system {value}.{suggestion(value, SYSTEMS)} Known: {', '.join(SYSTEMS)}; or name an .ssp."
        )


def _values(context: click.Context, parameter: click.Parameter, assignments: tuple[str, ...]) -> dict[str, str]:
    values = {}
    for assignment in assignments:
        name, equals, value = assignment.partition("=")
        if not equals or not name:
            raise click.BadParameter(f"expected ELEMENT.VARIABLE=VALUE, got {assignment!r}")
        values[name.strip()] = value
    return values


def _swaps(context: click.Context, parameter: click.Parameter, assignments: tuple[str, ...]) -> dict[str, Path]:
    swaps = {}
    for assignment in assignments:
        element, equals, fmu = assignment.partition("=")
        if not equals or not element or not fmu:
            raise click.BadParameter(f"expected ELEMENT=FMU, got {assignment!r}")
        if element in swaps:
            raise click.BadParameter(f"{element} is swapped twice")
        swaps[element] = Path(fmu).expanduser()  # no shell does it after the equals sign
    return swaps


def _png(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    if path is not None and path.suffix != ".png":
        raise click.BadParameter(f"expected a name that ends in .png, got {path}")
    return path


_coupling = click.option(
    "--coupling",
    type=click.Choice(list(COUPLINGS)),
    default="jacobi",
    show_default=True,
    help="How values are handed on.",
)
_stop_time = click.option("--stop-time", type=click.FloatRange(min=0, min_open=True), help="End of the run in s.")
_export = click.option(
    "--export",
    type=click.Choice(EXPORTS),
    default="native",
    show_default=True,
    help="Which FMUs: compiled C, or Python in the FMU.",
)
_set = click.option(
    "--set", "values", multiple=True, callback=_values, metavar="ELEMENT.VARIABLE=VALUE", help="Another start value."
)
_swap = click.option(
    "--swap", "swaps", multiple=True, callback=_swaps, metavar="ELEMENT=FMU", help="An FMU in the place of an element."
)
_map = click.option(
    "--map",
    "map_",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="TOML: how the FMUs of --swap take their places; none if they have the same names.",
)


@click.group(cls=_Command)
@click.version_option(package_name="rov-cosim")
def main() -> None:
    """Hold an underwater vehicle in place: build, run and compare systems of FMUs."""


@main.command("list")
def list_systems() -> None:
    """List the systems."""
    width = max(map(len, SYSTEMS))
    for system in SYSTEMS.values():
        click.echo(f"{system.name:{width}}  {system.description}")


@main.command()
@_export
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
@click.argument("system", type=_SystemType())
@_export
@_coupling
@_stop_time
@_set
@_swap
@_map
@click.option("--output", type=click.Path(file_okay=False, path_type=Path), help="Folder for CSV and plot.")
def run(
    system: System | Path,
    export: str,
    coupling: str,
    stop_time: float | None,
    values: dict[str, str],
    swaps: dict[str, Path],
    map_: Path | None,
    output: Path | None,
) -> None:
    """Run SYSTEM, a name from `list` or an .ssp file: CSV, plot and a table of results."""
    session.run(
        system,
        export=export,
        coupling=COUPLINGS[coupling],
        stop_time=stop_time,
        values=values,
        folder=output,
        swaps=swaps,
        map_=map_,
    )


@main.command()
@click.argument("systems", type=_SystemType(), nargs=-1, required=True)
@_export
@_coupling
@_stop_time
@_set
@_swap
@_map
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path), callback=_png, help="The PNG.")
def compare(
    systems: tuple[System | Path, ...],
    export: str,
    coupling: str,
    stop_time: float | None,
    values: dict[str, str],
    swaps: dict[str, Path],
    map_: Path | None,
    output: Path | None,
) -> None:
    """Run several SYSTEMS and draw their errors into one figure."""
    runs: dict[str, Run] = {}
    for system in systems:
        label = system.name if isinstance(system, System) else str(system)
        with session.opened(system, export, swaps, map_) as wiring:
            wiring = wiring.with_values(values)
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
    """Run the controller and a system in the tools of others, and write handover/IMPORTERS.md."""
    session.build()
    from ..handover.importers import write_page

    click.echo(write_page())


@main.command()
@click.argument("system", type=click.Choice(list(SYSTEMS)), default="station_keeping")
def benchmark(system: str) -> None:
    """Measure what a run costs in both exports, and the floor: steps, loops, whole commands."""
    for export in EXPORTS:
        session.build(SYSTEMS[system], export=export)
    from . import benchmark as benchmarking  # needs what a light install has not, as the build has told

    with TemporaryDirectory() as folder:
        for line in benchmarking.report(SYSTEMS[system], folder):
            click.echo(line)


if __name__ == "__main__":
    main()
