"""What the page of a table of results knows: its columns, and what the vehicle looks like."""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..components.interface import POSE
from ..errors import UserError
from ..ssp.wiring import Wiring
from ..study.assessment import SETTLED
from .live import RECORDED, packed

_GEOMETRY = ("rov_plant", "passive_arm")
_NEEDED = tuple(f"rov_plant.eta.{axis}" for axis in POSE)


class ViewError(UserError):
    """A table has not what a picture needs; the message tells what."""


def data(path: Path, wiring: Wiring) -> dict[str, Any]:
    """Return it of a CSV that `rov-cosim run` or `fmpy simulate` wrote.

    Parameters
    ----------
    path : the CSV; columns ``time`` in s and ``element.variable``. What it lacks beside time and pose is not shown.
    wiring : a system of the same vehicle, whose values tell places of thrusters, arm and structure.

    Raises
    ------
    ViewError : it is no such table, or has no pose of `rov_plant`.
    """
    names, values = _read(path)
    if lacking := [name for name in ("time", *_NEEDED) if name not in names]:
        raise ViewError(
            f"{path} has no column {lacking[0]}: a picture takes the results of a system with the element rov_plant."
        )
    shown = ["time", *(name for name in RECORDED if name in names)]
    columns = np.stack([values[:, names.index(name)] for name in shown])
    return {
        "names": shown,
        "columns": packed(columns.astype("<f8").tobytes()),
        "geometry": _geometry(wiring),
        "settled": SETTLED,
    }


def _read(path: Path) -> tuple[list[str], np.ndarray]:
    words = {"True": 1.0, "False": 0.0, "true": 1.0, "false": 0.0}
    try:
        with path.open(newline="", encoding="utf-8") as file:
            names, *rows = (row for row in csv.reader(file) if row)
        wanted = [i for i, name in enumerate(names) if name == "time" or name in RECORDED]
        values = [[words[row[i]] if row[i] in words else float(row[i]) for i in wanted] for row in rows]
    except (OSError, ValueError, IndexError, csv.Error) as error:
        raise ViewError(f"{path} is no table of results ({error}): `rov-cosim run` writes one.") from None
    if len(values) < 2:
        raise ViewError(f"{path} has {len(values)} rows; a moving picture takes two at least.")
    return [names[i] for i in wanted], np.array(values)


def _geometry(wiring: Wiring) -> Mapping[str, float]:
    return {
        f"{element.name}.{variable.name}": float(element.value(variable.name))
        for element in wiring.elements
        if element.name in _GEOMETRY
        for variable in element.description.modelVariables
        if variable.causality in ("parameter", "input") and element.has_value(variable.name)
    }
