"""The file of a campaign, in TOML: a system, what is changed in it, what varies, how often it runs."""

import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from math import isfinite
from pathlib import Path
from typing import Any

from ...errors import UserError
from ...exporters.build import EXPORTS
from ...master.exchange import COUPLINGS
from ...ssp import swap_map
from ...ssp.declaration import System
from ...ssp.values import Value
from ...ssp.wiring import WiringError, suggestion
from ...systems.catalogue import SYSTEMS
from ..changes import Changes
from ..scores import VERDICTS, Score
from ..settings import Settings
from ..troubles import TROUBLES

SAMPLINGS = ("sobol", "latin_hypercube", "random")
_SETTINGS = ("coupling", "start_time", "stop_time", "step", "allow_not_finite")
"""Those of `Settings` that a campaign can have."""
MOST_RUNS = 10_000_000
MEASURES = tuple(f.name for f in fields(Score) if f.name not in ("verdict", "reason", "lost_at"))
"""The scores that are numbers; the less, the better."""


@dataclass(frozen=True)
class Varied:
    """What a variable varies over: one of some values, or a distribution of `scipy.stats` with its arguments.

    `also` are variables that get the same value.
    """

    values: tuple[Value | str, ...] = ()
    distribution: str = ""
    arguments: Mapping[str, float] = field(default_factory=dict)
    also: tuple[str, ...] = ()


@dataclass(frozen=True)
class Declared:
    """A campaign as its file has it.

    Parameters
    ----------
    system : a system of this project, or the path of an SSP archive.
    changes : what holds in every run.
    vary : what is drawn anew for each run, by ``element.variable``, or ``trouble``.
    grid : values by ``element.variable``, or ``trouble``: the same draws are run for each combination of them.
    runs : draws, each a run of every combination.
    seed : of the draws.
    sampling : one of `SAMPLINGS`.
    limits : what a run must keep to pass, by score: at most this number, or no worse a verdict.
    scores : those of `MEASURES` that are reported.
    export, settings : as in `runs.run`; a run is always in the process of a worker.
    """

    system: System | Path
    changes: Changes
    vary: Mapping[str, Varied]
    grid: Mapping[str, tuple[Value | str, ...]]
    runs: int = 1
    seed: int = 0
    sampling: str = "sobol"
    limits: Mapping[str, float | str] = field(default_factory=lambda: {"verdict": "held"})
    scores: tuple[str, ...] = ("rms", "rms_yaw", "settling", "effort")
    export: str = "native"
    settings: Settings = field(default_factory=Settings)


def read(path: Path) -> Declared:
    """Return the campaign of a file; names of files in it are relative to its folder.

    Raises
    ------
    WiringError : everything in it that is not of a campaign; OSError if there is no such file.
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:  # of TOML, of UTF-8, or of an integer with thousands of digits
        raise WiringError(str(path), [f"This is not TOML: {error}."]) from None
    except RecursionError:
        raise WiringError(str(path), ["Its tables or lists are nested too deeply for a campaign."]) from None
    found = _Reader(content, path.parent)
    declared = found.declared()
    if found.problems or declared is None:
        raise WiringError(str(path), found.problems)
    return declared


class _Reader:
    """Takes the file apart; collects a sentence for everything that is wrong."""

    def __init__(self, content: Mapping[str, Any], folder: Path) -> None:
        self._content, self._folder = content, folder
        self.problems: list[str] = []

    def declared(self) -> Declared | None:
        known = ["system", "runs", "seed", "sampling", *_SETTINGS, "export", "scores", "map", "troubles"]
        known += ["swaps", "values", "vary", "grid", "pass"]
        for key in self._content:
            if key not in known:
                flat = " A variable stands in quotes in [vary], [grid] or [values]." if "." in key else ""
                self._problem(f"{key} is unknown; expected {', '.join(known)}.{suggestion(key, known)}{flat}")
        system, changes = self._system(), self._changes()
        entries, lists = self._table("vary"), self._table("grid")
        vary = {end: varied for end, entry in entries.items() if (varied := self._varied(end, entry))}
        grid = {end: self._list(f"[grid] {end}", end, values) for end, values in lists.items()}
        if both := sorted(set(vary) & set(grid)):
            self._problem(f"{both[0]} stands in [vary] and in [grid]: leave one out.")
        for end in sorted({*vary, *grid} & set(changes.values)):
            self._problem(f"{end} stands in [values] and is varied besides: leave one out.")
        if not entries and not lists:
            self._problem('Nothing varies: write [vary] or [grid], for example "rov_plant.mass" = [70.0, 80.0].')
        default = None if entries else 1
        runs = self._number("runs", default, lambda v: 1 <= v <= MOST_RUNS, f"from 1 to {MOST_RUNS}", int)
        if lists and not entries and runs not in (1, None):
            self._problem("runs: without [vary] all runs of a combination are the same; leave it out.")
        settings = self._settings()
        found = {
            "seed": self._number("seed", 0, lambda v: v >= 0, "from 0", int),
            "sampling": self._one("sampling", SAMPLINGS),
            "export": self._one("export", EXPORTS),
            "scores": self._scores(),
        }
        limits = self._limits()
        if self.problems or system is None or runs is None:
            return None
        given = {key: value for key, value in found.items() if key in self._content}
        given |= {"limits": limits} if limits else {}
        return Declared(system, changes, vary, grid, runs, **given, settings=settings)

    def _settings(self) -> Settings:
        times = {
            "start_time": self._number("start_time", 0.0, lambda v: True, "of seconds", float),
            "stop_time": self._number("stop_time", 0.0, lambda v: True, "of seconds", float),
            "step": self._number("step", 0.0, lambda v: v > 0, "of seconds above 0", float),
        }
        found = {name: time for name, time in times.items() if name in self._content}
        if type(self._content.get("allow_not_finite", False)) is not bool:
            self._problem("allow_not_finite: expected true or false.")
        allows = self._content.get("allow_not_finite") is True
        return Settings(self._one("coupling", list(COUPLINGS)) or "jacobi", **found, allow_not_finite=allows)

    def _system(self) -> System | Path | None:
        name = self._content.get("system")
        if isinstance(name, str) and name.endswith(".ssp"):
            return self._folder / name
        if not isinstance(name, str):
            self._problem(
                f'system: expected a name in quotes, or an .ssp, for example system = "{next(iter(SYSTEMS))}".'
            )
        elif name not in SYSTEMS:
            known = suggestion(name, SYSTEMS) or f" Known: {', '.join(SYSTEMS)}; or name an .ssp."
            self._problem(f"system: there is no system {name}.{known}")
        else:
            return SYSTEMS[name]
        return None

    def _changes(self) -> Changes:
        swaps: dict[str, Path] = {}
        for element, fmu in self._table("swaps").items():
            if isinstance(fmu, str):
                swaps[element] = self._folder / Path(fmu).expanduser()
            else:
                self._problem(f"[swaps] {element}: expected the path of an FMU in quotes, got {fmu!r}.")
        maps: Mapping[str, swap_map.SwapMap] = {}
        file = self._content.get("map")
        if isinstance(file, str):
            try:
                maps = swap_map.read(self._folder / file)
            except (UserError, OSError) as error:
                self._problem(f"map: {error}")
        elif file is not None:
            self._problem(f"map: expected the path of a map in quotes, got {file!r}.")
        values = self._table("values")
        for end, value in values.items():
            self._value(f"[values] {end}", value)
        troubles = self._content.get("troubles", [])
        if isinstance(troubles, list) and all(isinstance(name, str) for name in troubles):
            self._troubles("troubles", troubles)
        else:
            self._problem("troubles: expected a list of names in quotes.")
            troubles = []
        return Changes(swaps, maps, values, tuple(troubles))

    def _varied(self, end: str, entry: Any) -> Varied | None:
        where = f"[vary] {end}"
        if isinstance(entry, list):
            return Varied(self._list(where, end, entry))
        expected = 'expected { distribution = "NAME", ... } or a list of values'
        if not isinstance(entry, dict) or not isinstance(entry.get("distribution", entry.get("values")), str | list):
            nested = "; a name with a dot in it needs quotes" if isinstance(entry, dict) else ""
            self._problem(f"{where}: {expected}, got {entry!r:.60}{nested}.")
            return None
        also = entry.get("also", [])
        if not isinstance(also, list) or not all(isinstance(name, str) for name in also):
            self._problem(f"{where} also: expected a list of variables in quotes.")
            also = []
        if "values" in entry:
            for key in entry.keys() - {"values", "also"}:
                self._problem(f"{where}: {key} is unknown beside values; expected also.")
            return Varied(self._list(where, end, entry["values"]), also=tuple(also))
        arguments = {key: value for key, value in entry.items() if key not in ("distribution", "also")}
        for key, value in arguments.items():
            if type(value) not in (int, float) or not isfinite(value):
                self._problem(f"{where} {key} = {value!r}: expected a finite number.")
        return Varied((), entry["distribution"], arguments, tuple(also))

    def _list(self, where: str, end: str, values: Any) -> tuple[Value | str, ...]:
        if not isinstance(values, list) or not values:
            self._problem(f"{where}: expected a list of values, got {values!r:.60}.")
            return ()
        if end == "trouble":
            self._troubles(where, values)
        else:
            for value in values:
                self._value(where, value)
        if len(set(map(repr, values))) < len(values):
            self._problem(f"{where}: a value stands twice.")
        return tuple(values)

    def _value(self, where: str, value: Any) -> None:
        if type(value) not in (bool, int, float, str):
            nested = "; a name with a dot in it needs quotes" if isinstance(value, dict) else ""
            self._problem(f"{where}: expected a number, true or false, or a text, got {value!r:.60}{nested}.")

    def _troubles(self, where: str, names: Iterable[Any]) -> None:
        for name in names:
            if name not in TROUBLES:
                self._problem(f"{where}: there is no trouble {name}.{suggestion(str(name), TROUBLES)}")

    def _limits(self) -> dict[str, float | str]:
        limits = self._table("pass")
        for name, limit in limits.items():
            if name == "verdict":
                if limit not in VERDICTS[:-1]:
                    self._problem(f"[pass] verdict: expected the worst that passes, {' or '.join(VERDICTS[:-1])}.")
            elif name not in MEASURES:
                known = ["verdict", *MEASURES]
                self._problem(f"[pass] there is no score {name}; expected {', '.join(known)}.{suggestion(name, known)}")
            elif type(limit) not in (int, float) or not isfinite(limit):
                self._problem(f"[pass] {name}: expected the largest number that passes, got {limit!r:.60}.")
        return limits

    def _scores(self) -> tuple[str, ...]:
        names = self._content.get("scores", ["rms"])
        if not isinstance(names, list) or not names:
            self._problem(f"scores: expected a list of some of {', '.join(MEASURES)}.")
            return ()
        for name in names:
            if name not in MEASURES:
                self._problem(f"scores: there is no {name}; expected some of {', '.join(MEASURES)}.")
        return tuple(names)

    def _table(self, name: str) -> dict[str, Any]:
        table = self._content.get(name, {})
        if isinstance(table, dict):
            return table
        self._problem(f"{name}: expected a table, [{name}].")
        return {}

    def _one(self, key: str, known: Iterable[str]) -> str:
        value = self._content.get(key, "")
        if key in self._content and value not in known:
            self._problem(f"{key}: expected {' or '.join(known)}, got {value!r:.60}.")
        return str(value)

    def _number(self, key: str, default: Any, fits: Callable[[Any], bool], expected: str, type_: type) -> Any:
        value = self._content.get(key, default)
        right = type(value) is int or (type_ is float and type(value) is float and isfinite(value))
        if key not in self._content and default is not None:
            return default
        if right and fits(value):
            return value
        kind, got = "a whole number" if type_ is int else "a number", "" if value is None else f", got {value!r:.60}"
        self._problem(f"{key}: expected {kind} {expected}{got}.")
        return None

    def _problem(self, text: str) -> None:
        self.problems.append(text)
