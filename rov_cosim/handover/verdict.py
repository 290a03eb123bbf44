"""The verdict on an FMU file: all reference runs of a component, signal by signal."""

import tempfile
from collections.abc import Iterator
from math import isclose
from pathlib import Path

from ..components.cases import cases_of
from ..ssp.swap_map import folded
from ..ssp.values import parse
from . import reference
from .check import CheckError, Departure, RunError, departures
from .imported import Imported, opened


def judge(fmu: Path, name: str | None = None, map_: Path | None = None) -> tuple[list[str], bool]:
    """Return a line for each output of a component and a summary, and whether the FMU conforms.

    Parameters
    ----------
    fmu : the FMU file.
    name : the component that it should be; see `imported.opened` if left out.
    map_ : a TOML file that tells the FMU's names, as for a swap.

    Raises
    ------
    CheckError, WiringError : the FMU, or the map, cannot be used at all, or all runs fail for one reason at once.
    """
    with tempfile.TemporaryDirectory(prefix="rov_cosim_") as folder:
        imported = opened(fmu, Path(folder) / "fmu", name, map_)
        component = imported.component
        first: dict[str, Departure] = {}
        others = [*_declared_otherwise(imported)]
        left_out, failed, is_compared, is_whole = [], [], False, False
        for case in cases_of(component):
            run = reference.run(component, case)
            if imported.is_mapped and (lacking := imported.lacking(run)):
                what = folded(lacking, imported.our.variables)
                left_out.append(f"left out: {case.name}, for which the FMU has no place for {what}.")
                continue
            try:
                outputs = imported.replay(run)
                is_whole = True
            except RunError as error:  # what it gave until then, and the other runs, have their say all the same
                others.append(f"The run {error}")
                failed.append(error.reason)
                outputs = error.outputs
            is_compared |= any(values.size for values in outputs.values())
            first = departures(outputs, run) | first
        if len(failed) == len(cases_of(component)) and len(set(failed)) == 1 and not is_compared:
            raise CheckError(failed[0])
    cases, there = cases_of(component), [name for name in component.y.names if name in imported.places]
    agrees = "conforms" if is_whole else "conforms as far as the runs go" if is_compared else "not compared"
    width = max(map(len, component.y.names))
    findings = {name: str(first.get(name, agrees)) for name in there}
    lines = [f"{name:{width}}  {findings.get(name, 'not there, by the map')}" for name in component.y.names]
    lines += [*imported.notes, *left_out, *others]
    runs = f"{f'{len(cases) - len(left_out)} of ' if left_out else ''}{len(cases)} reference runs of {component.name}"
    if not there or not is_compared:
        return [*lines, f"Nothing could be compared in the reference runs of {component.name}."], False
    if first or others:
        ends = f", of which {len(failed)} failed" if failed else ""
        return [*lines, f"{len(first)} of {len(there)} signals depart in {runs}{ends}."], False
    those = "signals" if len(there) == component.y.size else "signals that are there"
    return [*lines, f"All {len(there)} {those} conform in {runs}."], True


def _declared_otherwise(imported: Imported) -> Iterator[str]:
    """Yield a sentence for each unit or start value that the FMU declares and that is not the component's."""
    for ours in imported.our.variables.values():
        place = imported.places.get(ours.name)
        if place is None:
            if not imported.is_mapped:
                yield f"The FMU has no variable {ours.name}."
            continue
        their = imported.element.variables[place.variable]
        if not imported.is_mapped and their.unit and ours.unit and their.unit != ours.unit:
            yield f"{their.name} is declared in {their.unit}; expected {ours.unit}."
        elif their.start and ours.start:
            expected = place.factor * float(parse(str(ours.start), ours.type))
            if not isclose(float(parse(str(their.start), their.type)), expected, rel_tol=1e-9, abs_tol=1e-12):
                yield f"{their.name} starts at {their.start}; expected {expected if place.factor != 1 else ours.start}."
