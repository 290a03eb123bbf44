"""An FMU file as the import of a component: which of its variables stand for the component's."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..components.interface import Component
from ..exporters.build import components
from ..exporters.model_description import describe
from ..master.unpacked import unpack
from ..ssp import swap_map
from ..ssp.fmu_file import FmuError, described
from ..ssp.places import Place, Places
from ..ssp.swap_map import SwapMap
from ..ssp.wiring import Element, suggestion
from ..systems.loop import element_of
from . import of_fmi3
from .check import CheckError, Signals, replay
from .reference import Reference

MOST_PROBLEMS = 8


@dataclass(frozen=True)
class Imported:
    """An FMU that is taken for a component.

    Parameters
    ----------
    element, folder : the FMU, and where it lies unpacked.
    our : the component's description as an element of the same name.
    component : the component.
    places : the FMU's variables by those of the component.
    is_mapped : whether a map tells them; the FMU has all inputs and outputs, by the same names, if not.
    notes : what the map leaves to be guessed.
    """

    element: Element
    folder: Path
    our: Element
    component: Component
    places: Mapping[str, Place]
    is_mapped: bool
    notes: tuple[str, ...]

    def replay(self, run: Reference) -> Signals:
        """Return the outputs of the FMU over a reference run, by our names; errors as in `check.replay`."""
        if self.element.description.fmiMajorVersion == 3:
            return of_fmi3.replay(self.folder, self.element, run, self.places)
        return replay(self.element, run, self.places)

    def lacking(self, run: Reference) -> list[str]:
        """Return what a reference run does that the FMU has no place for, so that it could not follow.

        A switch that the FMU has not may be built in: a run in which it stays as it is can be followed.
        """
        starts = dict(zip(self.component.u.names, self.component.u.start, strict=True))
        absent = [name for name in self.component.u.names if name not in self.places]
        moved = [
            name
            for name in absent
            if np.ptp(run.inputs[name])
            or (self.our.variables[name].type == "Real" and run.inputs[name][0] != starts[name])
        ]
        return [*moved, *(name for name in run.case.parameters if name not in self.places)]


def opened(fmu: Path, folder: Path, name: str | None = None, map_: Path | None = None) -> Imported:
    """Return an FMU as an import, unpacked into a folder.

    Parameters
    ----------
    name : the component; that of the FMU's model name, or of the map's only section, if left out.
    map_ : a TOML file as `swap_map` reads it.

    Raises
    ------
    CheckError : it is not an FMU that can be run here, or lacks what the component has and the map does not leave out.
    WiringError : the file is no map.
    """
    maps = swap_map.read(map_) if map_ else {}
    told: list[str] = []
    try:
        description = described(fmu, warn=told.append, versions=(2, 3))
    except FmuError as error:
        raise CheckError(str(error)) from None
    unpack(Element(description.modelName, fmu, description), folder)
    component = _component(description.modelName, name, maps)
    if description.fmiMajorVersion == 3:
        description = of_fmi3.scalars(description, component)
    section = _section(component, maps, map_) if map_ else component.name
    told += (f"[{other}] of the map is for another element: not looked at." for other in maps if other != section)
    their, our = Element(section, fmu, description), Element(section, fmu, describe(component))
    chosen = maps.get(section, SwapMap())
    if fed := [*_fed_by_others(chosen, our)]:
        raise _error(fed)
    found = Places(our, their, chosen, {})
    if map_:
        found.pair(our.variables)
        places = found.of
    else:
        places = {name: Place(name, 1.0) for name in our.variables if name in their.variables}
    if problems := [*found.problems, *_misfits(our, their, places, found.left_out, bool(map_))]:
        raise _error(problems)
    notes = (f"The FMU declares no unit for {', '.join(v)}: taken as {unit}." for unit, v in found.undeclared.items())
    return Imported(their, folder, our, component, places, bool(map_), (*told, *notes))


def _fed_by_others(map_: SwapMap, our: Element) -> Iterator[str]:
    for theirs, entry in map_.variables.items():
        other, dot, _ = entry.ours.partition(".")
        if dot and other != our.name and not our.group(other):
            yield (
                f"The map feeds {theirs} from {entry.ours}, which is no variable of {our.description.modelName}: its "
                "reference runs have no such signal to replay."
            )


def _misfits(
    our: Element, their: Element, places: Mapping[str, Place], left_out: Iterable[str], is_mapped: bool
) -> Iterator[str]:
    """Yield a sentence for each input and output that the FMU lacks, and for each type that is not ours."""
    cures = {
        "input": f"name it in [{our.name}] without",
        "output": f"give it a constant in [{our.name}.constants]",
    }
    for ours in our.variables.values():
        place = places.get(ours.name)
        if place is None:
            if ours.causality in cures and ours.name not in left_out:
                cure = f" Map it in [{our.name}.variables], or {cures[ours.causality]}." if is_mapped else ""
                yield f"The FMU has no variable {ours.name}.{cure}{suggestion(ours.name, their.variables)}"
            continue
        type_ = their.variables[place.variable].type
        if type_ != ours.type:
            yield f"{place.variable} is of type {type_}, and {ours.name} of type {ours.type}."
        elif type_ != "Real" and place.factor != 1:
            yield f"The map has {place.variable} as {place.factor:g} of {ours.name}: a {type_} takes no factor."


def _error(problems: list[str]) -> CheckError:
    more = [f"... and {len(problems) - MOST_PROBLEMS} more."] if len(problems) > MOST_PROBLEMS else []
    return CheckError("\n".join([*problems[:MOST_PROBLEMS], *more]))


def _component(model: str, name: str | None, maps: Mapping[str, SwapMap]) -> Component:
    known = components()
    candidates = [name] if name else [model, *(maps if len(maps) == 1 else ())]
    for candidate in candidates:
        if candidate in known:
            return known[candidate]
    hint = suggestion(model, known) or f" Known: {', '.join(known)}."
    raise CheckError(f"{model:.60} is no component of this project.{hint} Name one by --component.")


def _section(component: Component, maps: Mapping[str, SwapMap], path: Path) -> str:
    """Return the section of a map for a component: that of its element in this project's loop, or of its name.

    The others may be for other elements of the loop, for a map is for several swaps; what is for none is refused.
    """
    wanted = (element_of(component.name), component.name)
    expected = f"expected [{wanted[0]}] or [{wanted[1]}] for {component.name}."
    known = {*wanted, *map(element_of, components())}
    if problems := swap_map.unwanted((name for name in maps if name not in known), wanted, "checked"):
        raise CheckError(f"{' '.join(problems)} In {path}: {expected}")
    for section in wanted:
        if section in maps:
            return section
    what = f"has the sections {', '.join(maps)}" if maps else "has no section"
    raise CheckError(f"{path} {what}; {expected}")
