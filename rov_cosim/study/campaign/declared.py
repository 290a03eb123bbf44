"""The file of a campaign, in TOML: a system, what is changed in it, what varies, how often it runs."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from typing import Any

from ...ssp.declaration import System
from ...ssp.values import Value
from ...ssp.wiring import WiringError
from ..changes import Changes
from ..limits import MEASURES, Limits
from ..settings import Settings
from ..written import CHANGES, SETTINGS, Reader, content

SAMPLINGS = ("sobol", "latin_hypercube", "random")
MOST_RUNS = 10_000_000


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
    limits : what a run must keep to pass.
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
    limits: Limits = field(default_factory=lambda: {"verdict": "held"})
    scores: tuple[str, ...] = ("rms", "rms_yaw", "settling", "effort")
    export: str = "native"
    settings: Settings = field(default_factory=Settings)


def read(path: Path) -> Declared:
    """Return the campaign of a file; names of files in it are relative to its folder.

    Raises
    ------
    WiringError : everything in it that is not of a campaign; OSError if there is no such file.
    """
    problems: list[str] = []
    declared = _Reader(content(path), path.parent, problems).declared()
    if problems or declared is None:
        raise WiringError(str(path), problems)
    return declared


class _Reader(Reader):
    """Takes the file of a campaign apart."""

    def declared(self) -> Declared | None:
        """Return the campaign; None if its problems leave none."""
        known = ["system", "runs", "seed", "sampling", *SETTINGS, "export", "scores", "troubles", *CHANGES]
        known += ["vary", "grid", "pass"]
        flat = " A variable stands in quotes in [vary], [grid] or [values]."
        self.known(known, lambda key: flat if "." in key else "")
        troubles = self.names("troubles")
        self.troubles("troubles", troubles)
        system, changes = self.system(), replace(self.changes(), troubles=tuple(troubles))
        entries, lists = self.table("vary"), self.table("grid")
        vary = {end: varied for end, entry in entries.items() if (varied := self._varied(end, entry))}
        grid = {end: self._list(f"[grid] {end}", end, values) for end, values in lists.items()}
        if both := sorted(set(vary) & set(grid)):
            self.problem(f"{both[0]} stands in [vary] and in [grid]: leave one out.")
        for end in sorted({*vary, *grid} & set(changes.values)):
            self.problem(f"{end} stands in [values] and is varied besides: leave one out.")
        if not entries and not lists:
            self.problem('Nothing varies: write [vary] or [grid], for example "rov_plant.mass" = [70.0, 80.0].')
        default = None if entries else 1
        runs = self.number("runs", default, lambda v: 1 <= v <= MOST_RUNS, f"from 1 to {MOST_RUNS}", int)
        if lists and not entries and runs not in (1, None):
            self.problem("runs: without [vary] all runs of a combination are the same; leave it out.")
        settings = self.settings()
        found = {
            "seed": self.number("seed", 0, lambda v: v >= 0, "from 0", int),
            "sampling": self.one("sampling", SAMPLINGS),
            "export": self.export(),
            "scores": self._scores(),
        }
        limits = self.limits("pass", self.table("pass"))
        if self.problems or system is None or runs is None:
            return None
        given = {key: value for key, value in found.items() if key in self.content}
        given |= {"limits": limits} if limits else {}
        return Declared(system, changes, vary, grid, runs, **given, settings=settings)

    def _varied(self, end: str, entry: Any) -> Varied | None:
        where = f"[vary] {end}"
        if isinstance(entry, list):
            return Varied(self._list(where, end, entry))
        expected = 'expected { distribution = "NAME", ... } or a list of values'
        if not isinstance(entry, dict) or not isinstance(entry.get("distribution", entry.get("values")), str | list):
            nested = "; a name with a dot in it needs quotes" if isinstance(entry, dict) else ""
            self.problem(f"{where}: {expected}, got {entry!r:.60}{nested}.")
            return None
        also = entry.get("also", [])
        if not isinstance(also, list) or not all(isinstance(name, str) for name in also):
            self.problem(f"{where} also: expected a list of variables in quotes.")
            also = []
        if "values" in entry:
            for key in entry.keys() - {"values", "also"}:
                self.problem(f"{where}: {key} is unknown beside values; expected also.")
            return Varied(self._list(where, end, entry["values"]), also=tuple(also))
        arguments = {key: value for key, value in entry.items() if key not in ("distribution", "also")}
        for key, value in arguments.items():
            if type(value) not in (int, float) or not isfinite(value):
                self.problem(f"{where} {key} = {value!r}: expected a finite number.")
        return Varied((), entry["distribution"], arguments, tuple(also))

    def _list(self, where: str, end: str, values: Any) -> tuple[Value | str, ...]:
        if not isinstance(values, list) or not values:
            self.problem(f"{where}: expected a list of values, got {values!r:.60}.")
            return ()
        if end == "trouble":
            self.troubles(where, values)
        else:
            for value in values:
                self.value(where, value)
        if len(set(map(repr, values))) < len(values):
            self.problem(f"{where}: a value stands twice.")
        return tuple(values)

    def _scores(self) -> tuple[str, ...]:
        names = self.content.get("scores", ["rms"])
        if not isinstance(names, list) or not names:
            self.problem(f"scores: expected a list of some of {', '.join(MEASURES)}.")
            return ()
        for name in names:
            if name not in MEASURES:
                self.problem(f"scores: there is no {name}; expected some of {', '.join(MEASURES)}.")
        return tuple(names)
