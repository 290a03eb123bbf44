"""The file of a gate, in TOML: systems, troubles, and what each run of one in the other must keep."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from ...ssp.declaration import System
from ...ssp.wiring import WiringError
from ..changes import Changes
from ..limits import Limits
from ..settings import Settings
from ..troubles import TROUBLES
from ..written import CHANGES, SETTINGS, Reader, content

TIMEOUT = 60.0
"""Time in s that a call of an FMU may take, unless the file says otherwise."""
_DEFAULT: Limits = {"verdict": "held"}


@dataclass(frozen=True)
class Column:
    """A system of a gate.

    Parameters
    ----------
    name : what it is called.
    system : a system of this project, or the path of an SSP archive.
    changes : what holds in every run, FMUs of the user in the place of elements above all.
    limits : what a run must keep, by the trouble that it is in.
    left_out : troubles that are known to mean nothing here.
    is_ours : whether the plant's terms, if it has our names, are to be those of ours.
    """

    name: str
    system: System | Path
    changes: Changes
    limits: Mapping[str, Limits]
    left_out: tuple[str, ...] = ()
    is_ours: bool = True


@dataclass(frozen=True)
class Gate:
    """A gate as its file has it; export and settings as in `runs.run`, each run in a process of its own."""

    name: str
    columns: tuple[Column, ...]
    export: str
    settings: Settings


def read(path: Path) -> Gate:
    """Return the gate of a file; names of files in it are relative to its folder.

    Raises
    ------
    WiringError : everything in it that is not of a gate; OSError if there is no such file.
    """
    problems: list[str] = []
    gate = _File(content(path), path.parent, problems).gate(path.stem)
    if problems:
        raise WiringError(str(path), problems)
    return gate


class _File(Reader):
    """Takes the file of a gate apart."""

    def gate(self, name: str) -> Gate:
        self.known([*SETTINGS, "export", "timeout", "troubles", "limits", "systems"])
        troubles, limits = self.names("troubles"), self.table("limits")
        self.troubles("troubles", troubles)
        systems = self.table("systems")
        if not systems:
            self.problem("Nothing runs: write [systems.NAME] for each system, for example [systems.station_keeping].")
        columns: list[Column] = []
        for called, table in systems.items():
            if not isinstance(table, dict):
                self.problem(f"systems.{called}: expected a table, [systems.{called}].")
                continue
            column = _Table(table, self.folder, self.problems, f"[systems.{called}] ").column(called, troubles, limits)
            columns += [column] if column else []
        whole = len(columns) == len(systems)
        self._checked(limits, {trouble for column in columns for trouble in column.limits} if whole else {*TROUBLES})
        timeout = self.number("timeout", TIMEOUT, lambda v: v > 0 and isfinite(v), "of seconds above 0", float)
        settings = self.settings(isolate=True, timeout=timeout)
        return Gate(name, tuple(columns), self.export(), settings)

    def _checked(self, limits: Mapping[str, Any], troubles: set[str]) -> None:
        """Tell what is wrong with limits, those of a trouble in a table of its name."""
        for name, limit in limits.items():
            if not isinstance(limit, dict):
                self.limits("limits", {name: limit})
            elif name not in TROUBLES:
                self.troubles(f"[limits.{name}]", [name])
            elif name not in troubles:
                self.problem(f"[limits.{name}]: the trouble is none of those that run: {', '.join(sorted(troubles))}.")
            else:
                self.limits(f"limits.{name}", limit)


class _Table(_File):
    """Takes the table of a system apart."""

    def column(self, name: str, troubles: list[str], general: Mapping[str, Any]) -> Column | None:
        self.known(["system", *CHANGES, "troubles", "without", "terms", "limits"])
        own, left_out = self.names("troubles"), self.names("without")
        self.troubles("troubles", own)
        run, limits = own or troubles, self.table("limits")
        if not run:
            self.problem('There are no troubles: name some, here or for all, for example troubles = ["still_water"].')
        if len({*run}) < len(run):
            self.problem("troubles: one stands twice.")
        for trouble in left_out:
            if trouble not in run:
                self.problem(f"without: {trouble} is none of the troubles: leave it out.")
        self._checked(limits, {*run})
        if run and set(run) <= set(left_out):
            self.problem("without: all troubles are in it, so that nothing runs.")
        if type(terms := self.content.get("terms", True)) is not bool:
            self.problem("terms: expected true, or false for a plant with our names and other terms.")
        system, changes = self.system(name=name), self.changes()
        found = {trouble: _of(trouble, _DEFAULT, general, limits) for trouble in run}
        return Column(name, system, changes, found, tuple(left_out), terms is True) if system else None


def _of(trouble: str, *tables: Mapping[str, Any]) -> Limits:
    """Return the limits in a trouble: those of later tables go before, in each those of the trouble."""
    limits: dict[str, float | str] = {}
    for table in tables:
        own = table.get(trouble, {})
        limits |= {name: limit for name, limit in table.items() if not isinstance(limit, dict)}
        limits |= own if isinstance(own, dict) else {}
    return limits
