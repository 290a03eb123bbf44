"""`rov-cosim benchmark`: what a run costs."""

from tempfile import TemporaryDirectory

import click

from ...exporters.build import EXPORTS
from ...study import archives
from ...study.screen import say
from ...systems.catalogue import SYSTEMS


@click.command()
@click.argument("system", type=click.Choice(list(SYSTEMS)), default="station_keeping", metavar="[SYSTEM]")
def command(system: str) -> None:
    """Measure what a run costs in both exports, and the floor: steps, loops, whole commands."""
    for export in EXPORTS:
        archives.build(SYSTEMS[system], export=export, progress=say)
    from ...benchmark import report as benchmarking

    with TemporaryDirectory() as folder:
        for line in benchmarking.report(SYSTEMS[system], folder):
            click.echo(line)
