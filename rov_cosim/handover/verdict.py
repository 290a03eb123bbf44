"""The verdict on an FMU file: all reference runs of a component, signal by signal."""

import tempfile
import tomllib
from collections.abc import Mapping
from pathlib import Path

from ..components.cases import cases_of
from ..components.interface import Component
from ..exporters.build import components
from ..exporters.model_description import describe
from ..master.unpacked import unpack
from ..ssp.wiring import Element, parse, suggestion
from . import reference
from .check import CheckError, Departure, departures, opened, replay, theirs


def judge(fmu: Path, name: str | None = None, map_: Path | None = None) -> tuple[list[str], bool]:
    """Return a line for each output of a component and a summary, and whether the FMU conforms.

    Parameters
    ----------
    fmu : the FMU file.
    name : the component that it should be; that of the FMU's model name if left out.
    map_ : a TOML file with lines ``"their.name" = "our.name"``.

    Raises
    ------
    CheckError : the FMU, or the map, cannot be used at all.
    """
    names = _names(map_) if map_ else {}
    with tempfile.TemporaryDirectory(prefix="rov_cosim_") as folder:
        element = opened(fmu)
        unpack(element, Path(folder) / "fmu")
        component = _component(element, name)
        by_ours = theirs(element, component, names)
        first: dict[str, Departure] = {}
        others = _declared_otherwise(element, component, by_ours)
        for case in cases_of(component):
            run = reference.run(component, case)
            try:
                first = departures(replay(element, Path(folder) / "fmu", run, by_ours), run) | first
            except CheckError as error:  # the other runs have their say all the same
                others.append(f"The run {error}")
    width = max(map(len, component.y.names))
    lines = [f"{signal:{width}}  {first.get(signal, 'conforms')}" for signal in component.y.names]
    runs = f"{len(cases_of(component))} reference runs of {component.name}"
    if not first and not others:
        return [*lines, f"All {len(lines)} signals conform in {runs}."], True
    return [*lines, *others, f"{len(first)} of {len(lines)} signals depart in {runs}."], False


def _declared_otherwise(element: Element, component: Component, by_ours: Mapping[str, str]) -> list[str]:
    """Return a sentence for each unit or start value that the FMU declares and that is not the component's."""
    found = []
    for ours in describe(component).modelVariables:
        their = element.variables.get(by_ours[ours.name])
        if their is None:
            found.append(f"The FMU has no variable {by_ours[ours.name]}.")
        elif their.unit and ours.unit and their.unit != ours.unit:
            found.append(f"{their.name} is declared in {their.unit}; expected {ours.unit}.")
        elif their.start and ours.start and parse(str(their.start), ours.type) != parse(str(ours.start), ours.type):
            found.append(f"{their.name} starts at {their.start}; expected {ours.start}.")
    return found


def _names(path: Path) -> Mapping[str, str]:
    try:
        names = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise CheckError(f"{path} is not TOML: {error}.") from None
    if wrong := [their for their, ours in names.items() if not isinstance(ours, str)]:
        raise CheckError(
            f'{path}: expected lines "their.name" = "our.name", with quotes on both sides; got {wrong[0]}.'
        )
    return names


def _component(element: Element, name: str | None) -> Component:
    known = components()
    model = name or element.description.modelName
    if model not in known:
        hint = suggestion(model, known) or f" Known: {', '.join(known)}."
        raise CheckError(f"{model} is no component of this project.{hint} Name one by --component.")
    return known[model]
