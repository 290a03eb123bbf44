"""`rov-cosim build`: FMUs and archives."""

import click

from ...exporters.zig import TARGETS
from ...study import archives
from ...study.screen import say
from ...systems.catalogue import SYSTEMS
from .. import options


@click.command()
@options.export
@click.option("--all-platforms", is_flag=True, help="Native binaries for all platforms, not this machine's alone.")
@click.option("--plain-ssp", is_flag=True, help="Archives with SSP content alone, which `fmpy simulate` cannot run.")
def command(export: str, all_platforms: bool, plain_ssp: bool) -> None:
    """Build all FMUs and SSP archives; what is current stays untouched."""
    if all_platforms and export != "native":
        raise click.UsageError("--all-platforms is for the native export: a pythonfmu FMU has all that pythonfmu has.")
    platforms = TARGETS if all_platforms else ()
    built = archives.build(*SYSTEMS.values(), export=export, platforms=platforms, plain=plain_ssp, progress=say)
    for path, written in built.items():
        click.echo(f"{'built  ' if written else 'current'}  {path}")
