"""What the page of a table of results knows: its columns, and what the vehicle looks like."""

import csv
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..components.interface import POSE
from ..errors import UserError
from ..ssp.swap_map import folded
from ..ssp.wiring import Wiring, suggestion
from ..study import assessment
from .live import RECORDED, packed

_GEOMETRY = ("rov_plant", "passive_arm")
_POSE = tuple(f"rov_plant.eta.{axis}" for axis in POSE)
_SET_POINT = tuple(f"scenario.eta_d.{axis}" for axis in POSE)
_NEEDED = ("time", *(f"rov_plant.eta.{axis}" for axis in assessment.AXES))
_FORCES = ("rov_plant.dB", "rov_plant.F_C.")  # which act on the vehicle that has them
_WORDS = {"True": 1.0, "False": 0.0, "true": 1.0, "false": 0.0}


class ViewError(UserError):
    """A table has not what a picture needs; the message tells what."""


def data(
    path: Path, wiring: Wiring, looks: Mapping[str, float], columns: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """Return it of a CSV that `rov-cosim run` or `fmpy simulate` wrote, or another tool.

    Parameters
    ----------
    path : the CSV; columns ``time`` in s and ``element.variable``. What it lacks beside time and pose is not shown.
    wiring : the system that it is of. The pose is what its arm receives, in our axes and units, of whatever vehicle.
    looks : by `geometry`, what a vehicle looks like that does not tell all of it; of another make, say.
    columns : for some of `RECORDED`, or groups of them, a column or group, with ``-`` or a factor and ``*`` before it.

    Raises
    ------
    ViewError : it is no such table, or nothing in it is the pose of a vehicle.
    """
    names, rows = _read(path)
    shown = _chosen(path, names, columns or {})
    sources = {str(link.source) for link in wiring.links}
    wanted = {"time", *RECORDED, *sources, *(name for name, _ in shown.values())}
    table = _numbers(path, names, rows, wanted)
    found = {name: table[name] for name in ("time", *RECORDED) if name in names}
    found |= _received(table, wiring, found) | {
        name: factor * table[theirs] for name, (theirs, factor) in shown.items()
    }
    if lacking := [name for name in _NEEDED if name not in found]:
        raise ViewError(
            f"{path} has no {lacking[0]}, and nothing that stands for it. Name the system that it is a run of by "
            f"--system, with --swap and --map as in the run, or a column by --column {lacking[0]}=COLUMN. "
            f"It has {folded(names, names)}."
        )
    listed = [name for name in ("time", *RECORDED) if name in found]
    return {
        "names": listed,
        "columns": packed(np.stack([found[name] for name in listed]).astype("<f8").tobytes()),
        "geometry": {end: v for end, v in looks.items() if not end.startswith(_FORCES)} | geometry(wiring),
        "settled": assessment.SETTLED,
    }


def _read(path: Path) -> tuple[list[str], list[list[str]]]:
    try:
        with path.open(newline="", encoding="utf-8") as file:
            names, *rows = (row for row in csv.reader(file) if row)
    except (OSError, ValueError, csv.Error) as error:
        raise ViewError(f"{path} is no table of results ({error}): `rov-cosim run` writes one.") from None
    if len(rows) < 2:
        raise ViewError(f"{path} has {len(rows)} rows; a moving picture takes two at least.")
    return names, rows


def _numbers(path: Path, names: list[str], rows: list[list[str]], wanted: set[str]) -> NDArray[Any]:
    """Return the columns that are wanted, each a field."""
    places = {name: i for i, name in enumerate(names) if name in wanted}
    table = np.empty(len(rows), dtype=[(name, float) for name in places])
    try:
        for name, i in places.items():
            table[name] = [_WORDS[row[i]] if row[i] in _WORDS else float(row[i]) for row in rows]
    except (ValueError, IndexError) as error:
        raise ViewError(f"{path} is no table of results ({error}): `rov-cosim run` writes one.") from None
    return table


def _chosen(path: Path, names: list[str], columns: Mapping[str, str]) -> dict[str, tuple[str, float]]:
    """Return column and factor for each of `RECORDED` that the user names one for."""
    found: dict[str, tuple[str, float]] = {}
    for ours, text in columns.items():
        factor, star, theirs = text.rpartition("*")
        if not star and text.startswith("-"):
            factor, theirs = "-1", text[1:]
        try:
            times = float(factor or 1)
        except ValueError:
            raise ViewError(f"--column {ours}={text}: {factor!r} is no factor.") from None
        members = [name for name in ("time", *RECORDED) if name == ours or name.startswith((f"{ours}.", f"{ours}["))]
        if not members:
            raise ViewError(f"--column {ours}: nothing of that name is drawn." + suggestion(ours, RECORDED))
        pairs = {name: theirs.strip() + name.removeprefix(ours) for name in members}
        there = {name: (column, times) for name, column in pairs.items() if column in names}
        if not there:
            raise ViewError(f"{path} has no column {theirs}." + suggestion(theirs, names))
        found |= there
    return found


def _received(
    table: NDArray[Any], wiring: Wiring, found: Mapping[str, NDArray[np.float64]]
) -> dict[str, NDArray[np.float64]]:
    """Return the pose that the arm of a system receives and, if it was not found, the set-point of its controller.

    Nothing if the table has not what they receive: it is of another system.
    """
    if not assessment.assessable(wiring):
        return {}
    with suppress(ValueError):
        received = dict(zip(_POSE, assessment.pose(table, wiring), strict=True))
        if _SET_POINT[0] not in found:
            end = f"{assessment.controller_of(wiring)}.eta_d"
            received |= zip(_SET_POINT, assessment.received(table, wiring, end), strict=True)
        return received
    return {}


def geometry(wiring: Wiring) -> dict[str, float]:
    """Return what the elements of a vehicle and its arm look like, by ``element.variable``."""
    return {
        f"{element.name}.{variable.name}": float(element.value(variable.name))
        for element in wiring.elements
        if element.name in _GEOMETRY
        for variable in element.description.modelVariables
        if variable.causality in ("parameter", "input") and element.has_value(variable.name)
    }
