"""What files in TOML that ask for runs have in common: systems, changes, settings, limits, and strict reading."""

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

from ..errors import UserError
from ..exporters.build import EXPORTS
from ..master.exchange import COUPLINGS
from ..ssp import swap_map
from ..ssp.declaration import System
from ..ssp.wiring import WiringError, suggestion
from ..systems import fleet
from ..systems.catalogue import SYSTEMS
from .changes import Changes
from .limits import Limits, problem_of
from .settings import Settings
from .troubles import TROUBLES

SETTINGS = ("coupling", "start_time", "stop_time", "step", "allow_not_finite")
"""Those of `Settings` that such a file can have."""
CHANGES = ("swaps", "map", "parameters", "values")
"""The keys of what is changed in a system."""


def content(path: Path) -> dict[str, Any]:
    """Return what a file holds.

    Raises
    ------
    WiringError : it is not TOML; OSError if there is no such file.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except ValueError as error:  # of TOML, of UTF-8, or of an integer with thousands of digits
        raise WiringError(str(path), [f"This is not TOML: {error}."]) from None
    except RecursionError:
        raise WiringError(str(path), ["Its tables or lists are nested too deeply."]) from None


class Reader:
    """Takes a table apart; collects a sentence for everything that is wrong.

    Parameters
    ----------
    content : the table.
    folder : what names of files in it are relative to.
    problems : where the sentences go.
    where : what stands before each of them.
    """

    def __init__(self, content: Mapping[str, Any], folder: Path, problems: list[str], where: str = "") -> None:
        self.content, self.folder, self.problems, self._where = content, folder, problems, where

    def known(self, keys: Sequence[str], hint: Callable[[str], str] = lambda key: "") -> None:
        """Tell which keys are unknown; `hint` is what may be meant by one."""
        for key in self.content:
            if key not in keys:
                self.problem(f"{key} is unknown; expected {', '.join(keys)}.{suggestion(key, keys)}{hint(key)}")

    def system(self, key: str = "system", name: Any = None) -> System | Path | None:
        """Return the system that a key, or else a name, stands for: one of this project, a vehicle's, an archive."""
        name = self.content.get(key, name)
        if not isinstance(name, str):
            first = next(iter(SYSTEMS))
            self.problem(f'{key}: expected a name in quotes, or an .ssp, for example {key} = "{first}".')
        elif name.endswith(".ssp"):
            return self.folder / name
        elif vehicle := fleet.of_file(name):
            try:
                return fleet.holding(str(self.folder / vehicle[0]), vehicle[1])
            except (UserError, OSError) as error:
                self.problem(f"{key}: {error}")
        elif name not in SYSTEMS:
            known = suggestion(name, SYSTEMS) or f" Known: {', '.join(SYSTEMS)}; or name an .ssp."
            self.problem(f"{key}: there is no system {name}.{known}")
        else:
            return SYSTEMS[name]
        return None

    def changes(self) -> Changes:
        """Return what `CHANGES` tell."""
        swaps: dict[str, Path] = {}
        for element, fmu in self.table("swaps").items():
            if isinstance(fmu, str):
                swaps[element] = self.folder / Path(fmu).expanduser()
            else:
                self.problem(f"[swaps] {element}: expected the path of an FMU in quotes, got {fmu!r}.")
        maps: Mapping[str, swap_map.SwapMap] = {}
        file = self.content.get("map")
        if isinstance(file, str):
            try:
                maps = swap_map.read(self.folder / file)
            except (UserError, OSError) as error:
                self.problem(f"map: {error}")
        elif file is not None:
            self.problem(f"map: expected the path of a map in quotes, got {file!r}.")
        values = self.table("values")
        for end, value in values.items():
            self.value(f"[values] {end}", value)
        files = self.names("parameters", "paths of SSV files")
        return Changes(swaps, maps, values, parameters=tuple(self.folder / file for file in files))

    def settings(self, **others: Any) -> Settings:
        """Return what `SETTINGS` tell, with others."""
        times = {
            "start_time": self.number("start_time", 0.0, lambda v: True, "of seconds", float),
            "stop_time": self.number("stop_time", 0.0, lambda v: True, "of seconds", float),
            "step": self.number("step", 0.0, lambda v: v > 0, "of seconds above 0", float),
        }
        found = {name: time for name, time in times.items() if name in self.content}
        if type(self.content.get("allow_not_finite", False)) is not bool:
            self.problem("allow_not_finite: expected true or false.")
        allows = self.content.get("allow_not_finite") is True
        coupling = self.one("coupling", list(COUPLINGS)) or "jacobi"
        return Settings(coupling, **found, allow_not_finite=allows, **others)

    def export(self) -> str:
        """Return the export that is asked for."""
        return self.one("export", EXPORTS) or "native"

    def troubles(self, where: str, names: Iterable[Any]) -> None:
        """Tell which names are of no trouble."""
        for name in names:
            if name not in TROUBLES:
                self.problem(f"{where}: there is no trouble {name}.{suggestion(str(name), TROUBLES)}")

    def limits(self, where: str, limits: Mapping[str, Any]) -> Limits:
        """Return limits, having told what is wrong with them."""
        for name, limit in limits.items():
            if problem := problem_of(name, limit):
                self.problem(f"[{where}] {problem}")
        return limits

    def names(self, key: str, what: str = "names") -> list[str]:
        """Return a list of texts."""
        names = self.content.get(key, [])
        if isinstance(names, list) and all(isinstance(name, str) for name in names):
            return names
        self.problem(f"{key}: expected a list of {what} in quotes.")
        return []

    def value(self, where: str, value: Any) -> None:
        """Tell whether a start value is none."""
        if type(value) not in (bool, int, float, str):
            nested = "; a name with a dot in it needs quotes" if isinstance(value, dict) else ""
            self.problem(f"{where}: expected a number, true or false, or a text, got {value!r:.60}{nested}.")

    def table(self, name: str) -> dict[str, Any]:
        """Return the table of a name; an empty one if there is none."""
        table = self.content.get(name, {})
        if isinstance(table, dict):
            return table
        self.problem(f"{name}: expected a table, [{name}].")
        return {}

    def one(self, key: str, known: Iterable[str]) -> str:
        """Return one of some words; an empty one if there is none."""
        value = self.content.get(key, "")
        if key in self.content and value not in known:
            self.problem(f"{key}: expected {' or '.join(known)}, got {value!r:.60}.")
        return str(value)

    def number(self, key: str, default: Any, fits: Callable[[Any], bool], expected: str, type_: type) -> Any:
        """Return a number of a type that fits; the default if there is none, or None, told, if there has to be one."""
        value = self.content.get(key, default)
        right = type(value) is int or (type_ is float and type(value) is float and isfinite(value))
        if key not in self.content and default is not None:
            return default
        if right and fits(value):
            return value
        kind, got = "a whole number" if type_ is int else "a number", "" if value is None else f", got {value!r:.60}"
        self.problem(f"{key}: expected {kind} {expected}{got}.")
        return None

    def problem(self, text: str) -> None:
        """Collect a sentence."""
        self.problems.append(f"{self._where}{text}")
