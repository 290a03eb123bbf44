"""Inputs of a system that are fed from a table over time, as FMPy feeds them."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ssp.values import LARGEST_INTEGER
from ..ssp.wiring import End, Wiring, suggestion

_FED = ("Real", "Integer", "Boolean", "Enumeration")


def problems_of_given(table: NDArray[Any], wiring: Wiring) -> Iterator[str]:
    """Yield a sentence for everything that keeps a table from feeding a system.

    A table is a structured array: first the time in s, then a field for each input, ``element.variable``.
    """
    names = table.dtype.names or ()
    if not names or names[0] != "time" or len(table) < 1:
        yield "The table of inputs has no rows, or its first column is not `time`."
        return
    if len(names) == 1:
        yield "The table of inputs has the column `time` alone, and feeds nothing."
    variables = {f"{e.name}.{v.name}": v for e in wiring.elements for v in e.variables.values()}
    for name in names[1:]:
        variable = variables.get(name)
        if variable is None:
            yield f"The table of inputs: there is no variable {name}." + suggestion(name, variables)
        elif variable.causality != "input" or variable.type not in _FED:
            yield f"The table of inputs: {name} is a {variable.type} {variable.causality}; expected an input."
        elif link := wiring.link_to(name):
            yield f"The table of inputs: {name} is connected: its value comes from {link.source}."
        elif variable.type != "Real" and not _are_of(variable.type, table[name]):
            yield f"The table of inputs: the column {name} has a value that is no {variable.type}."
    for name in names:
        if table.dtype[name].kind not in "fiub" or not np.isfinite(table[name]).all():
            yield f"The table of inputs: the column {name} has a value that is not a finite number."
        elif name == "time" and (np.diff(table["time"]) < 0).any():
            yield "The table of inputs: the time goes back; expected rows in order of time."


def _are_of(type_: str, column: NDArray[Any]) -> bool:
    least, most = (0, 1) if type_ == "Boolean" else (-LARGEST_INTEGER, LARGEST_INTEGER)
    return bool(np.all((column >= least) & (column <= most) & (column == np.floor(column))))


def with_fed(results: NDArray[Any], given: "Given | None") -> NDArray[Any]:
    """Return results with a field for each input that was fed besides, as it is at the time of each row."""
    if given is None or not len(results):
        return results
    fed = [str(end) for end in given.ends]
    whole = np.empty(len(results), [*results.dtype.descr, *((name, np.float64) for name in fed)])
    for name in results.dtype.names or ():
        whole[name] = results[name]
    for name, values in zip(fed, given.at(results["time"]).T, strict=True):
        whole[name] = values
    return whole


class Given:
    """The values of inputs over time: Reals that are continuous between two rows linear, the rest held.

    Before the first row its values hold, after the last one those.
    """

    def __init__(self, table: NDArray[Any], wiring: Wiring) -> None:
        parted = [wiring.parted(name) for name in (table.dtype.names or ())[1:]]
        self.ends = [End(element.name, name) for element, name in parted if element]
        variables = [element.variables[name] for element, name in parted if element]
        self._tolerance = 1e-9 * wiring.step_size
        self._linear = [v.type == "Real" and v.variability in (None, "continuous") for v in variables]
        self._time = np.asarray(table["time"], np.float64)
        self._columns = [np.asarray(table[str(end)], np.float64) for end in self.ends]

    def at(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values at some times in s, a row a time, a column for each of `ends`."""
        values = np.empty((len(times), len(self.ends)))
        # A time is a product, and may be just below the number that the table has.
        held = np.maximum(np.searchsorted(self._time, times + self._tolerance, side="right") - 1, 0)
        for i, (column, is_linear) in enumerate(zip(self._columns, self._linear, strict=True)):
            values[:, i] = np.interp(times, self._time, column) if is_linear else column[held]
        return values
