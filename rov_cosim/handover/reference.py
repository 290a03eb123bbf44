"""Reference runs: made by the Python side, written in the form of the FMI cross-check, and as scripts for host.c."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from fmpy.util import write_csv
from numpy.typing import NDArray

from ..components.cases import Case
from ..components.interface import SAMPLE_TIME, Component
from ..exporters.model_description import describe
from ..ssp.wiring import Element
from ..ssp.writer import parameter_set

TOLERANCE = 1e-6
"""Part of a signal's largest value by which a conforming import may differ."""


@dataclass(frozen=True)
class Reference:
    """A run of a component: inputs, set at the begin of each step, and outputs, as tables with a field ``time``."""

    component: Component
    case: Case
    inputs: NDArray[Any]
    outputs: NDArray[Any]


def run(component: Component, case: Case) -> Reference:
    """Return the reference run of a case."""
    tables = []
    for names, values in (
        (component.u.names, case.input_values(component)),
        (component.y.names, case.output_values(component)),
    ):
        table = np.empty(len(values), dtype=[("time", float), *((name, float) for name in names)])
        table["time"] = case.times()
        for name, column in zip(names, values.T, strict=True):
            table[name] = column
        tables.append(table)
    return Reference(component, case, *tables)


def write(reference: Reference, folder: Path) -> None:
    """Write a run into a folder: NAME_in.csv, NAME_ref.csv, NAME_ref.opt, NAME.ssv and the script NAME_host.txt."""
    component, case = reference.component, reference.case
    folder.mkdir(parents=True, exist_ok=True)
    write_csv(folder / f"{component.name}_in.csv", reference.inputs)
    write_csv(folder / f"{component.name}_ref.csv", reference.outputs)
    options = {"StartTime": 0.0, "StopTime": case.steps * SAMPLE_TIME, "StepSize": SAMPLE_TIME, "RelTol": TOLERANCE}
    text = "".join(f"{name}, {value!r}\n" for name, value in options.items())
    (folder / f"{component.name}_ref.opt").write_text(text, encoding="utf-8")
    if case.parameters:
        element = Element(component.name, folder, describe(component), case.parameters)
        (folder / f"{component.name}.ssv").write_bytes(parameter_set(element))
    (folder / f"{component.name}_host.txt").write_text(script(reference), encoding="utf-8")


def script(reference: Reference) -> str:
    """Return a run as the calls that host.c makes: a letter for the type, a value reference, a value."""
    component, parameters = reference.component, reference.case.parameters
    groups = (component.inputs, component.outputs, component.parameters)
    kinds = {name: signal.type[0] for group in groups for signal in group for name in signal.names}
    places = {name: i for i, name in enumerate(kinds)}
    letters = {"R": "=", "B": "?"}

    def setting(row: Any, names: Iterable[str]) -> list[str]:
        return [f"{kinds[name]} {places[name]} {float(row[name])!r}" for name in names]

    def expecting(row: Any) -> list[str]:
        return [f"{letters[kinds[name]]} {places[name]} {float(row[name])!r}" for name in component.y.names]

    lines = [f"{kinds[name]} {places[name]} {value!r}" for name, value in parameters.items()]
    lines += [*setting(reference.inputs[0], component.u.names), "start 0", *expecting(reference.outputs[0])]
    for n in range(reference.case.steps):
        now, before = reference.inputs[n], reference.inputs[max(n - 1, 0)]
        lines += setting(now, [name for name in component.u.names if now[name] != before[name]])
        lines += [f"step {SAMPLE_TIME!r}", *expecting(reference.outputs[n + 1])]
    return "\n".join([*lines, f"end {reference.case.steps}", ""])
