"""`rov-cosim troubles`: what can go wrong."""

import click

from ...study.troubles import TROUBLES
from ..listing import echo_named


@click.command("troubles")
def command() -> None:
    """List what can go wrong, for --trouble, in the systems of the fleet."""
    echo_named(TROUBLES.values())
