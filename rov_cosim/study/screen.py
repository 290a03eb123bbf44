"""What a command shows besides its results: progress, and warnings, each kind once and how many more."""

import re
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click

_NUMBER = re.compile(r"(?<![\w\[.])[-+]?\d[\d.]*(e[-+]?\d+)?")
"""A number, but none that is part of a name."""


def say(line: str) -> None:
    """Show what takes a while, beside the results."""
    click.echo(line, err=True)


@contextmanager
def counted() -> Iterator[Callable[[str], None]]:
    """Yield what shows a warning; those that differ in numbers alone are of one kind."""
    seen: Counter[str] = Counter()

    def warn(message: str) -> None:
        kind = _NUMBER.sub("#", message)
        seen[kind] += 1
        if seen[kind] == 1:
            click.echo(f"warning: {message}", err=True)

    try:
        yield warn
    finally:
        for kind, times in seen.items():
            if times > 1:
                click.echo(f"warning: {times - 1} more of the kind: {kind}", err=True)
