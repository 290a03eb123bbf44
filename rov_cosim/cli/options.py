"""The options and arguments that several commands share."""

import functools
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, cast

import click
from click.shell_completion import CompletionItem

from ..exporters.build import EXPORTS, LackingError
from ..exporters.zig import BuildError
from ..master.exchange import COUPLINGS
from ..ssp import swap_map
from ..ssp.declaration import System
from ..ssp.wiring import suggestion
from ..study.changes import Changes
from ..study.scores import VERDICTS, Score, Verdict
from ..study.settings import Settings
from ..study.troubles import TROUBLES
from ..systems import fleet
from ..systems.catalogue import SYSTEMS


class Finite(click.FloatRange):
    """Numbers of a range, without infinity and what is no number."""

    name = "float"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number; errors as of click."""
        found = super().convert(value, param, ctx)
        if not math.isfinite(found):
            self.fail(f"{value} is not finite.", param, ctx)
        return found


_POSITIVE = Finite(min=0, min_open=True)


class SystemType(click.ParamType[System | Path]):
    """The name of a system of this project, or the path of an SSP archive or of a vehicle's SSV."""

    name = "system"

    def shell_complete(
        self, context: click.Context, parameter: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Return the systems whose names begin so."""
        return [CompletionItem(name) for name in SYSTEMS if name.startswith(incomplete)]

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> System | Path:
        """Return the system, or the archive's path."""
        if value in SYSTEMS:
            return SYSTEMS[value]
        if str(value).endswith(".ssp"):
            return Path(value)
        if vehicle := fleet.of_file(str(value)):
            return fleet.holding(*vehicle)
        kinds = {
            ".fmu": f"is an FMU: it takes a place in a system by --swap ELEMENT={value}",
            ".py": f"is a script: run it by python {value}",
        }
        if (suffix := Path(value).suffix) in kinds or os.path.exists(value):  # of any length
            neither = "is neither a system's archive (.ssp) nor a vehicle's parameters (.ssv)"
            self.fail(f"{value} {kinds.get(suffix, neither)}.")
        known = suggestion(value, SYSTEMS) or f" Known: {', '.join(SYSTEMS)}; or name an .ssp."
        self.fail(f"there is no system {value}.{known}")


class OneOf(click.ParamType[str]):
    """One of the names of a kind of thing."""

    def __init__(self, kind: str, known: Iterable[str]) -> None:
        self.name, self._known = kind, list(known)

    def shell_complete(
        self, context: click.Context, parameter: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Return the names that begin so."""
        return [CompletionItem(name) for name in self._known if name.startswith(incomplete)]

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> str:
        """Return the name."""
        if value in self._known:
            return str(value)
        known = suggestion(value, self._known) or f" Known: {', '.join(self._known)}."
        self.fail(f"there is no {self.name} {value}.{known}")


def _values(context: click.Context, parameter: click.Parameter, assignments: tuple[str, ...]) -> dict[str, str]:
    return dict(assigned(assignments, "ELEMENT.VARIABLE=VALUE"))


def _swaps(context: click.Context, parameter: click.Parameter, assignments: tuple[str, ...]) -> dict[str, Path]:
    # No shell expands the tilde after the equals sign.
    return {element: Path(fmu).expanduser() for element, fmu in assigned(assignments, "ELEMENT=FMU")}


def assigned(assignments: Iterable[str], form: str) -> Iterator[tuple[str, str]]:
    """Yield the names and values of ``NAME=VALUE``; refuse another form, and a name that stands twice."""
    known: dict[str, str] = {}
    for assignment in assignments:
        name, equals, value = (part.strip() for part in assignment.partition("="))
        if not equals or not name or not value:
            raise click.BadParameter(f"expected {form}, got {assignment!r}")
        if name in known:
            raise click.BadParameter(f"{name} stands twice, as {known[name]} and as {value}: leave one out")
        known[name] = value
        yield name, value


def gate(scores: Mapping[str, Score | None], worst: str) -> None:
    """Raise ClickException unless each score, by the name of its run, is better than the verdict `worst`."""
    failed = []
    for name, found in scores.items():
        if found is None:
            failed.append(f"{name} has no vehicle with a pose eta: there is no verdict")
        elif VERDICTS.index(found.verdict) >= VERDICTS.index(cast(Verdict, worst)):
            failed.append(f"{name}: {found}")
    if failed:
        raise click.ClickException("; ".join(failed))


def export(command: Callable[..., None]) -> Callable[..., None]:
    """Add the option that tells which FMUs are built; it is named where the native ones lack something."""

    @functools.wraps(command)
    def gathered(**given: Any) -> None:
        try:
            command(**given)
        except LackingError as error:
            raise BuildError(f"{error}, or take --export pythonfmu") from None

    help_ = "Which FMUs: compiled C, or Python in the FMU."
    option = click.option("--export", type=click.Choice(EXPORTS), default="native", show_default=True, help=help_)
    return option(gathered)


set_ = click.option(
    "--set", "values", multiple=True, callback=_values, metavar="ELEMENT.VARIABLE=VALUE", help="Another start value."
)
parameters = click.option(
    "--parameters",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    multiple=True,
    metavar="FILE.ssv",
    help="Start values by ELEMENT.VARIABLE, as `rov-cosim tune` writes them; --set goes before them.",
)
swap = click.option(
    "--swap", "swaps", multiple=True, callback=_swaps, metavar="ELEMENT=FMU", help="An FMU in the place of an element."
)
map_option = click.option(
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
    help="What goes wrong; `rov-cosim troubles` lists. Several come together, but no two for one thing.",
)


_SETTINGS = [
    click.option(
        "--coupling",
        type=click.Choice(list(COUPLINGS)),
        default="jacobi",
        show_default=True,
        help="How values are handed on.",
    ),
    click.option("--start-time", type=float, help="Begin of the run in s."),
    click.option("--stop-time", type=float, help="End of the run in s."),
    click.option("--step", type=_POSITIVE, help="Communication step in s."),
    click.option(
        "--output-interval", type=_POSITIVE, help="Time in s between two rows of the results; a step if left out."
    ),
    click.option(
        "--input",
        type=click.Path(exists=True, dir_okay=False, path_type=Path),
        help="CSV of unconnected inputs over time: columns time and ELEMENT.VARIABLE.",
    ),
    click.option("--allow-not-finite", is_flag=True, help="Go on when an output is not finite."),
    click.option(
        "--isolate/--no-isolate",
        default=None,
        help="Run the FMUs in a process of their own, which may crash or hang; if not said, those of others.",
    ),
    click.option(
        "--timeout", type=_POSITIVE, help="Time in s that a call of an FMU may take, in a process of its own."
    ),
]


def settings(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options that tell how a run is taken, handed to the command as one `Settings`."""
    names = [field.name for field in fields(Settings)]

    @functools.wraps(command)
    def gathered(**given: Any) -> None:
        taken = {name: given.pop(name) for name in names}
        if taken["timeout"] is not None and not taken["timeout"] < float("inf"):
            raise click.BadParameter(f"--timeout is {taken['timeout']}; expected a number of seconds")
        if taken["timeout"] is not None and taken["isolate"] is False:
            raise click.UsageError("--timeout needs a process of its own: leave out --no-isolate.")
        command(settings=Settings(**taken), **given)

    return functools.reduce(lambda wrapped, option: option(wrapped), reversed(_SETTINGS), gathered)


jobs = click.option(
    "--jobs", type=click.IntRange(min=1), default=os.cpu_count() or 1, help="Processes; one a core if left out."
)
scheduler = click.option(
    "--scheduler", default="", metavar="ADDRESS", help="Run on the workers of a Dask cluster, not on this machine."
)
fail_on = click.option(
    "--fail-on", type=click.Choice(VERDICTS[1:]), help="End with status 1 if the verdict is this one or a worse one."
)


def changes_but_troubles(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options that change a system but for --trouble, handed to the command as one `Changes`."""

    @functools.wraps(command)
    def gathered(
        *,
        values: dict[str, str],
        swaps: dict[str, Path],
        map_: Path | None,
        parameters: tuple[Path, ...],
        **others: Any,
    ) -> None:
        if map_ and not swaps:
            raise click.UsageError("--map tells how the FMUs of --swap take their places: name one by --swap.")
        maps = swap_map.read(map_) if map_ else {}
        command(changes=Changes(swaps, maps, values, parameters=parameters), **others)

    return set_(parameters(swap(map_option(gathered))))


def changes(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options that change a system, handed to the command as one `Changes`."""

    @functools.wraps(command)
    def gathered(*, changes: Changes, troubles: tuple[str, ...], **others: Any) -> None:
        command(changes=replace(changes, troubles=troubles), **others)

    return trouble(changes_but_troubles(gathered))
