"""Lists of named things on the screen."""

from collections.abc import Iterable

import click

from ..ssp.declaration import System
from ..study.troubles import Trouble


def echo_named(named: Iterable[System | Trouble]) -> None:
    """Print name and description of each, in columns."""
    width = max(len(one.name) for one in named)
    for one in named:
        click.echo(f"{one.name:{width}}  {one.description}")
