"""`rov-cosim build`: FMUs and archives."""

from pathlib import Path

import click

from ...exporters.zig import TARGETS
from ...ssp.declaration import System
from ...study import archives
from ...study.screen import say
from ...systems.catalogue import SYSTEMS
from .. import options


@click.command()
@click.argument("systems", type=options.SystemType(), nargs=-1)
@options.export
@click.option("--all-platforms", is_flag=True, help="Native binaries for all platforms, not this machine's alone.")
@click.option(
    "--fmi",
    type=click.Choice(["2", "3"]),
    default="2",
    show_default=True,
    help="Version of FMI; 3 for FMUs alone, in build/fmi3.",
)
@click.option("--plain-ssp", is_flag=True, help="Archives with SSP content alone, which `fmpy simulate` cannot run.")
def command(systems: tuple[System | Path, ...], export: str, all_platforms: bool, fmi: str, plain_ssp: bool) -> None:
    """Build FMUs of all components, and FMUs and archives of SYSTEMS, or of all; what is current stays untouched."""
    if all_platforms and export != "native":
        raise click.UsageError("--all-platforms is for the native export: a pythonfmu FMU has all that pythonfmu has.")
    if fmi == "3" and (plain_ssp or export != "native"):
        raise click.UsageError("--fmi 3 is for native FMUs: leave out --export and --plain-ssp.")
    declared = [system for system in systems or SYSTEMS.values() if isinstance(system, System)]
    if theirs := [system for system in systems if isinstance(system, Path)]:
        raise click.UsageError(f"{theirs[0]} is an archive already; name the system that it is of.")
    if fmi == "3":
        built = archives.build_fmi3(*declared, all_platforms=all_platforms, progress=say)
    else:
        platforms = TARGETS if all_platforms else ()
        built = archives.build(*declared, export=export, platforms=platforms, plain=plain_ssp, progress=say)
    for path, written in built.items():
        click.echo(f"{'built  ' if written else 'current'}  {path}")
