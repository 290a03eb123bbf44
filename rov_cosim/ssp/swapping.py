"""Another FMU in the place of an element: its connections are led to the FMU's own variables, as a map tells."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from math import isfinite
from pathlib import Path

from .checks import faults_of
from .fmu_file import FmuError, described
from .places import Places
from .swap_map import SwapMap, folded, stem, unwanted
from .values import LARGEST_INTEGER, Value, is_settable
from .wiring import Element, End, Link, Wiring, WiringError, called_by_fmu, suggestion

Warn = Callable[[str], None]


def with_swaps(
    wiring: Wiring, fmus: Mapping[str, Path], maps: Mapping[str, SwapMap], warn: Warn = lambda message: None
) -> Wiring:
    """Return a system with other FMUs in the place of elements.

    Parameters
    ----------
    wiring : the system.
    fmus : FMU files by element, swapped in this order: the map of each sees the names of those before it.
    maps : how, by element; an element needs none whose FMU has the same names.
    warn : called with what `swapped` tells.

    Raises
    ------
    WiringError : everything that keeps an FMU from taking the place.
    """
    problems: list[str] = []
    for name, fmu in fmus.items():
        try:
            wiring = swapped(wiring, Element(name, fmu.absolute(), described(fmu, warn=warn)), maps.get(name), warn)
        except FmuError as error:
            problems.append(f"{name}: {error}")
        except WiringError as error:
            problems += error.problems
    over = [name for name in maps if name not in fmus]
    by_fmu = {name: said for name in over if (said := called_by_fmu(name, wiring.elements))}
    there = [element.name for element in wiring.elements if element.name in fmus]
    problems += [*by_fmu.values(), *unwanted((name for name in over if name not in by_fmu), there, "swapped")]
    if problems:
        raise WiringError(wiring.name, problems)
    return wiring


def swapped(wiring: Wiring, their: Element, map_: SwapMap | None = None, warn: Warn = lambda message: None) -> Wiring:
    """Return the system with another element in the place of the one that has its name.

    Results and further start values have the FMU's own names. Parameters of the system go to the variables that the map
    has for them, without a map to those of equal names; `warn` is told of start values without a place, of inputs that
    nothing feeds, and of angles whose unit nobody tells.

    Raises
    ------
    WiringError : everything that is wrong with the map, and each connection that it leaves open.
    """
    names = [element.name for element in wiring.elements]
    if their.name not in names:
        problem = called_by_fmu(their.name, wiring.elements) or f"There is no element {their.name}." + suggestion(
            their.name, names
        )
        raise WiringError(wiring.name, [problem])
    swap = _Swap(wiring, their, map_)
    result = swap.result()
    if problems := [*swap.problems, *faults_of(result)]:
        raise WiringError(wiring.name, problems)
    for note in swap.notes:
        warn(f"{their.name}: {note}")
    return result


class _Swap:
    """One element replaced; collects problems, and notes for the user."""

    def __init__(self, wiring: Wiring, their: Element, map_: SwapMap | None) -> None:
        self.wiring, self.their, self.is_mapped = wiring, their, map_ is not None
        self.elements = {element.name: element for element in wiring.elements}
        self.our = self.elements[their.name]
        self.places = Places(self.our, their, map_ or SwapMap(), self.elements)
        self.problems = self.places.problems
        self.notes: list[str] = []

    def result(self) -> Wiring:
        """Return the system with the element replaced, as far as that can be."""
        ends = [end.variable for link in self.wiring.links for end in link[:2] if end.element == self.our.name]
        # A map is for a stranger, whose mass goes with its own inertia: an equal name alone carries no parameter to it.
        kinds = ("input",) if self.is_mapped else ("input", "parameter")
        ends += [v for v in self.our.start_values if self.our.variables[v].causality in kinds]
        self.places.pair(ends)
        constants = self.places.constants
        held = {
            link.target: self._constant(constants[link.source.variable], link)
            for link in self.wiring.links
            if link.source.element == self.our.name and link.source.variable in constants
        }
        dropped = {End(self.our.name, variable) for variable in self.places.without}
        links = [link for link in self.wiring.links if link.target not in held.keys() | dropped]
        elements = tuple(
            self._started() if element is self.our else _with_values(element, held)
            for element in self.elements.values()
        )
        result = replace(self.wiring, elements=elements, links=(*self._led(links), *self.places.fed))
        self._note(result)
        return result

    def _constant(self, value: Value, link: Link) -> Value:
        """Return what the receiver of an output of ours gets instead of it."""
        type_ = self.our.variables[link.source.variable].type
        if type_ == "Real" and type(value) is not bool:
            handed = link.factor * float(value)
            if isfinite(handed):
                return handed
        elif type(value) is {"Boolean": bool, "Integer": int}.get(type_) and abs(int(value)) <= LARGEST_INTEGER:
            return value
        self._problem(f"The constant {value!r} is not for {link.source.variable}, a {type_}.")
        return value

    def _led(self, links: Iterable[Link]) -> Iterator[Link]:
        """Yield the links, those of the element led to the variables of theirs."""
        name = self.our.name
        constant, without = f"give a constant ([{name}.constants])", f"name it in [{name}] without"
        open_: dict[tuple[str, ...], dict[str, None]] = {}
        for source, target, factor in links:
            from_, to = self.places.of.get(source.variable), self.places.of.get(target.variable)
            if source.element == name and from_ is None:
                key = (constant, "nothing for", stem(source.variable), f"which {target.element} receives")
                open_.setdefault(key, {})[source.variable] = None
            elif target.element == name and to is None:
                key = (without, "no place for", stem(target.variable), f"which {source.element} feeds")
                open_.setdefault(key, {})[target.variable] = None
            else:
                if source.element == name and from_:
                    source, factor = End(name, from_.variable), factor / from_.factor
                if target.element == name and to:
                    target, factor = End(name, to.variable), factor * to.factor
                yield Link(source, target, factor)
        for (cure, lacks, _, who), variables in open_.items():
            what = f"{lacks} {', '.join(variables)}, {who}"
            self._problem(f"The FMU has {what}: map it ([{name}.variables]) or {cure}.")

    def _started(self) -> Element:
        """Return their element with the start values of ours that it has a place for."""
        values, dropped = {}, []
        for ours, value in self.our.start_values.items():
            place, type_ = self.places.of.get(ours), self.our.variables[ours].type
            their = self.their.variables[place.variable] if place else None
            if place is None or their is None or not is_settable(their):
                dropped.append(ours)
            elif their.type != type_ or (type_ != "Real" and place.factor != 1):
                self._problem(f"{ours}, a {type_}, cannot be set as {place.factor:g} of {their.name}, a {their.type}.")
            else:
                values[place.variable] = place.factor * float(value) if type_ == "Real" else value
        if dropped:
            who = "map" if self.is_mapped else "FMU"
            what = folded(dropped, self.our.start_values)
            self.notes.append(f"The {who} has no place for {what}: the FMU's own values hold.")
        return replace(self.their, start_values={**values, **self.their.start_values})

    def _note(self, result: Wiring) -> None:
        for unit, names in self.places.undeclared.items():
            self.notes.append(f"The FMU declares no unit for {', '.join(names)}: taken as {unit}.")
        fed = {link.target.variable for link in result.links if link.target.element == self.our.name}
        known = {*fed, *self.places.mapped, *self.our.variables, *self.their.start_values}
        unfed = [v.name for v in self.their.variables.values() if v.causality == "input" and v.name not in known]
        if unfed:
            self.notes.append(f"Nothing feeds {', '.join(unfed)} of the FMU: the start value holds.")

    def _problem(self, text: str) -> None:
        self.problems.append(f"{self.our.name}: {text}")


def _with_values(element: Element, values: Mapping[End, Value]) -> Element:
    own = {end.variable: value for end, value in values.items() if end.element == element.name}
    return replace(element, start_values={**element.start_values, **own}) if own else element
