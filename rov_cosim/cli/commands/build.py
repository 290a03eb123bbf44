"""`rov-cosim build`: FMUs and archives."""

import click

from ...exporters.build import FMI3, build_fmus, project_root
from ...exporters.zig import PLATFORMS
from ...study import archives
from ...study.screen import say
from ...systems.catalogue import SYSTEMS
from .. import options


@click.command()
@options.export
@click.option(
    "--all-platforms", is_flag=True, help="Native binaries for Linux, Windows and macOS, not this machine's alone."
)
@click.option(
    "--fmi",
    type=click.Choice(["2", "3"]),
    default="2",
    show_default=True,
    help="Version of FMI; 3 for the components alone, in build/fmi3.",
)
@click.option("--plain-ssp", is_flag=True, help="Archives with SSP content alone, which `fmpy simulate` cannot run.")
def command(export: str, all_platforms: bool, fmi: str, plain_ssp: bool) -> None:
    """Build all FMUs and SSP archives; what is current stays untouched."""
    if all_platforms and export != "native":
        raise click.UsageError("--all-platforms is for the native export: a pythonfmu FMU has all that pythonfmu has.")
    if fmi == "3" and (plain_ssp or export != "native"):
        raise click.UsageError("--fmi 3 is for the native FMUs of components: leave out --export and --plain-ssp.")
    platforms = PLATFORMS[int(fmi)] if all_platforms else ()
    if fmi == "3":
        built = build_fmus(project_root(), FMI3, platforms, progress=say)
    else:
        built = archives.build(*SYSTEMS.values(), export=export, platforms=platforms, plain=plain_ssp, progress=say)
    for path, written in built.items():
        click.echo(f"{'built  ' if written else 'current'}  {path}")
