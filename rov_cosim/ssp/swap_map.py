"""The map of a swap, in TOML: which variable of another FMU stands for which of the element that it replaces."""

import re
import tomllib
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any

from .units import KNOWN, conversion, units_of
from .values import Value
from .wiring import Element, WiringError, suggestion
from .z_down import sign

_PARTS = {"variables": dict, "constants": dict, "without": list}


@dataclass(frozen=True)
class Entry:
    """What a variable of theirs, or a group of them, is.

    Parameters
    ----------
    ours : the variable or group of the element, or an output of another element, ``element.variable``.
    factor : theirs is so many times ours, in their unit.
    unit : the unit of theirs, where the FMU declares none.
    z_down : whether theirs is in axes that count z downwards; nothing to what has no direction.
    """

    ours: str
    factor: float = 1.0
    unit: str = ""
    z_down: bool = False

    def conversion(self, our: Element, ours: str, their: Element, theirs: str) -> tuple[float, str]:
        """Return by what a variable of ours is multiplied to be one of theirs, and what forbids it or nothing."""
        declared, unit, units = their.variables[theirs].unit, our.variables[ours].unit, units_of(their.description)
        ratio = conversion(unit, units_of(our.description), declared or self.unit, units)
        problem = ""
        if self.unit and conversion(declared, units, self.unit, units) != 1:
            problem = f"The FMU declares {theirs} in {declared}, and the map says {self.unit}."
        elif self.unit and not unit:
            problem = f"{ours} has no unit that could be converted to the {self.unit} of {theirs}: give a factor."
        elif ratio is None:
            problem = f"{theirs} is in {declared or self.unit}, to which no factor converts the {unit} of {ours}."
        return self.factor * (sign(ours) if self.z_down else 1.0) * (ratio or 1.0), problem


@dataclass(frozen=True)
class SwapMap:
    """How another FMU takes the place of an element; inputs and outputs of the same name in both need no word.

    Parameters
    ----------
    variables : what is ours, by the name of theirs, a variable or a group; parameters that it leaves out are theirs.
    constants : values for outputs of ours that the FMU has not, by variable or group, in our units.
    without : inputs of ours that it has no place for, by variable or group.
    """

    variables: Mapping[str, Entry] = field(default_factory=dict)
    constants: Mapping[str, Value] = field(default_factory=dict)
    without: tuple[str, ...] = ()


def read(path: Path) -> dict[str, SwapMap]:
    """Return the maps in a TOML file by element.

    Raises
    ------
    WiringError : everything in it that is no map; OSError if there is no such file.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except ValueError as error:  # of TOML, of UTF-8, or of an integer with thousands of digits
        raise WiringError(str(path), [f"This is not TOML: {error}."]) from None
    except RecursionError:
        raise WiringError(str(path), ["Its tables or lists are nested too deeply for a map."]) from None
    if flat := [name for name, table in tables.items() if isinstance(table, str)]:
        line, where = f'"{flat[0]}" = "{tables[flat[0]]}"', "[ELEMENT.variables], for example [controller.variables],"
        raise WiringError(str(path), [f"{flat[0]} stands in no section: expected {where} before {line}."])
    if problems := [problem for element, table in tables.items() for problem in _problems(element, table)]:
        raise WiringError(str(path), problems)
    return {element: _map(table) for element, table in tables.items()}


def unwanted(sections: Iterable[str], wanted: Iterable[str], done: str) -> list[str]:
    """Return a sentence for each section that is for none of the elements wanted, to which something is `done`."""
    wanted = list(wanted)
    return [f"The map is for {name}, which is not {done}.{suggestion(name, wanted)}" for name in sections]


def stem(variable: str) -> str:
    """Return the name of the outermost group of a variable."""
    return re.split(r"[.\[]", variable)[0]


def folded(names: Collection[str], among: Iterable[str]) -> str:
    """Return names in a line, groups of `among` that are in it as a whole as ``group.*`` or ``group[*]``."""
    groups: dict[str, list[str]] = {}
    for name in among:
        groups.setdefault(stem(name), []).append(name)
    whole = {group for group, members in groups.items() if len(members) > 1 and {*members} <= {*names}}
    ends = {".": ".*", "[": "[*]", "": ""}
    words = (s + ends[name[len(s) :][:1]] if (s := stem(name)) in whole else name for name in names)
    return ", ".join(dict.fromkeys(words))


def _map(table: Mapping[str, Any]) -> SwapMap:
    entries = {
        their: Entry(entry) if isinstance(entry, str) else Entry(**entry)
        for their, entry in table.get("variables", {}).items()
    }
    return SwapMap(entries, table.get("constants", {}), tuple(table.get("without", ())))


def _problems(element: str, table: Any) -> Iterator[str]:
    if not isinstance(table, dict):
        yield f"{element} stands in no section: expected [ELEMENT], [ELEMENT.variables] or [ELEMENT.constants] before."
        return
    for part, content in table.items():
        where = f"[{element}] {part}"
        if part not in _PARTS:
            yield f"{where}: unknown; expected {', '.join(_PARTS)}.{suggestion(part, _PARTS)}"
        elif not isinstance(content, _PARTS[part]):
            yield f"{where}: expected a {'table' if _PARTS[part] is dict else 'list of names'}."
        elif part == "without":
            yield from (
                f"{where}: expected names in quotes, got {_shown(name)}." for name in content if type(name) is not str
            )
        elif part == "constants":
            for name, value in content.items():
                if type(value) is not bool and not _is_number(value):
                    expected = f"expected a finite number, true or false{_unquoted(value)}"
                    yield f"{where}: {name} = {_shown(value)}: {expected}."
        else:
            for name, entry in content.items():
                yield from (f"[{element}.variables] {name}: {problem}" for problem in _entry_problems(entry))


def _entry_problems(entry: Any) -> Iterator[str]:
    if isinstance(entry, str):
        return
    if not isinstance(entry, dict) or type(entry.get("ours")) is not str:
        yield f'expected "OURS" or {{ ours = "OURS", ... }}, got {_shown(entry)}{_unquoted(entry)}.'
        return
    for key, value in entry.items():
        if key == "factor":
            if not _is_number(value) or value == 0:
                yield f"factor = {_shown(value)}: expected a finite number that is not 0."
        elif key == "unit":
            if type(value) is not str or value not in KNOWN:
                yield f"unit = {_shown(value)} is not known; expected one of {', '.join(KNOWN)}."
        elif key == "z_down":
            if type(value) is not bool:
                yield f"z_down = {_shown(value)}: expected true or false."
        elif key != "ours":
            yield f"{key} is unknown; expected ours, factor, unit or z_down."


def _is_number(value: Any) -> bool:
    try:
        return type(value) in (int, float) and isfinite(value)
    except OverflowError:  # an integer beyond the floats
        return False


def _shown(value: Any) -> str:
    """Return a value as a line can hold it."""
    try:
        return f"{value!r:.40}"
    except (ValueError, RecursionError):  # an integer of thousands of digits, lists in lists
        return "what cannot be shown"


def _unquoted(value: Any) -> str:
    return "; a name with a dot in it needs quotes" if isinstance(value, dict) else ""
