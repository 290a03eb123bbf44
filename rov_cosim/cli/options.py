"""The options and arguments that several commands share."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click

from ..exporters.build import EXPORTS
from ..master.master import COUPLINGS
from ..ssp.declaration import System
from ..ssp.wiring import suggestion
from ..study.troubles import TROUBLES
from ..systems.catalogue import SYSTEMS


class SystemType(click.ParamType[System | Path]):
    """The name of a system of this project, or the path of an SSP archive."""

    name = "system"

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> System | Path:
        """Return the system, or the archive's path."""
        if value in SYSTEMS:
            return SYSTEMS[value]
        if str(value).endswith(".ssp"):
            return Path(value)
        self.fail(
            f"there is no system {value}.{suggestion(value, SYSTEMS)} Known: {', '.join(SYSTEMS)}; or name an .ssp."
        )


class OneOf(click.ParamType[str]):
    """One of the names of a kind of thing."""

    def __init__(self, kind: str, known: Iterable[str]) -> None:
        self.name, self._known = kind, list(known)

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> str:
        """Return the name."""
        if value in self._known:
            return str(value)
        self.fail(f"there is no {self.name} {value}.{suggestion(value, self._known)} Known: {', '.join(self._known)}.")


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


def png(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """Refuse the name of a picture that is not a PNG."""
    if path is not None and path.suffix != ".png":
        raise click.BadParameter(f"expected a name that ends in .png, got {path}")
    return path


coupling = click.option(
    "--coupling",
    type=click.Choice(list(COUPLINGS)),
    default="jacobi",
    show_default=True,
    help="How values are handed on.",
)
stop_time = click.option("--stop-time", type=click.FloatRange(min=0, min_open=True), help="End of the run in s.")
export = click.option(
    "--export",
    type=click.Choice(EXPORTS),
    default="native",
    show_default=True,
    help="Which FMUs: compiled C, or Python in the FMU.",
)
set_ = click.option(
    "--set", "values", multiple=True, callback=_values, metavar="ELEMENT.VARIABLE=VALUE", help="Another start value."
)
swap = click.option(
    "--swap", "swaps", multiple=True, callback=_swaps, metavar="ELEMENT=FMU", help="An FMU in the place of an element."
)
map_ = click.option(
    "--map",
    "map_",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="TOML: how the FMUs of --swap take their places; none if they have the same names.",
)
trouble = click.option(
    "--trouble",
    "troubles",
    type=OneOf("trouble", TROUBLES),
    multiple=True,
    metavar="NAME",
    help="What goes wrong, in a system of the fleet; `rov-cosim troubles` lists. Several come together.",
)


def changes(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options that change a system: those of `session.opened`."""
    return set_(trouble(swap(map_(command))))
