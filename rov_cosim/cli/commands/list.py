"""`rov-cosim list`: the systems."""

import click

from ...systems.catalogue import SYSTEMS
from ..listing import echo_named


@click.command("list")
def command() -> None:
    """List the systems."""
    echo_named(SYSTEMS.values())
