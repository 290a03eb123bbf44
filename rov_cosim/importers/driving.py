"""What the drivers of other tools share: the loop that they run, and how far their results are from ours."""

import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..components.interface import Component
from ..exporters.model_description import literal
from ..handover.reference import Reference
from ..ssp.values import Value, parse
from ..ssp.wiring import Wiring


@dataclass(frozen=True)
class Loop:
    """A system in its archive, its wiring, and the results of this project's Jacobi master."""

    archive: Path
    wiring: Wiring
    results: NDArray[Any]

    def fmus(self) -> dict[str, Path]:
        """Return the FMU of each element."""
        return {element.name: element.fmu for element in self.wiring.elements}

    def start_values(self, connected: bool = False) -> dict[str, dict[str, Value]]:
        """Return the start values by element and variable, and, if wanted, what the links hand on at the start."""
        values = {element.name: dict(element.start_values) for element in self.wiring.elements}
        for source, target, _ in self.wiring.links if connected else ():
            values[target.element][target.variable] = self.results[str(source)][0].item()
        return values

    def outputs(self) -> list[tuple[str, str]]:
        """Return element and variable of each output."""
        ends = (name.partition(".") for name in signals(self.results))
        return [(element, variable) for element, _, variable in ends]


def signals(table: NDArray[Any]) -> tuple[str, ...]:
    """Return the fields of a table but its first, the time."""
    return tuple(table.dtype.names or ())[1:]


def deviation(theirs: Mapping[str, Any] | NDArray[Any], ours: NDArray[Any]) -> float:
    """Return the largest absolute difference of any signal over a run.

    Parameters
    ----------
    theirs : the signals by name, a value after each step; the start before the first, if the tool shows it.
    ours : a table with the field ``time``, then the signals, and a row for the start and each step's end.
    """
    worst = 0.0
    for name in signals(ours):
        values = np.asarray(theirs[name], dtype=float)
        missing = len(ours) - len(values)
        if missing not in (0, 1):
            raise ValueError(f"{name}: {len(values)} rows; expected {len(ours)}, or one less.")
        worst = float(np.maximum(worst, np.abs(values - ours[name][missing:]).max()))  # passes NaN on
    return worst


def types(component: Component) -> dict[str, str]:
    """Return the FMI type of each variable."""
    signals = (*component.inputs, *component.outputs, *component.parameters)
    return {name: signal.type for signal in signals for name in signal.names}


def parameters(reference: Reference) -> dict[str, Value]:
    """Return the parameters of a reference run in their types."""
    kinds = types(reference.component)
    return {name: typed(value, kinds[name]) for name, value in reference.case.parameters.items()}


def typed(value: float, type_: str) -> Value:
    """Return a number in an FMI type."""
    return parse(literal(value, type_), type_)


def by_name(names: Sequence[str], rows: Sequence[Sequence[float]]) -> dict[str, NDArray[np.float64]]:
    """Return the columns of rows, one after each step, by name."""
    return dict(zip(names, np.array(rows, dtype=float).T, strict=True))


def tool(*command: object, cwd: Path) -> str:
    """Run a program in a folder and return what it says; RuntimeError with that if it fails."""
    done = subprocess.run(
        [str(part) for part in command], cwd=cwd, capture_output=True, encoding="utf-8", errors="replace", check=False
    )
    if done.returncode:
        raise RuntimeError(f"{command[:4]}: status {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout
