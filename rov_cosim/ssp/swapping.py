"""Another FMU in the place of an element: its connections are led to the FMU's own variables, as a map tells."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from .fmu_file import FmuError, described
from .swap_map import Entry, SwapMap, folded, stem
from .wiring import Element, End, Link, Value, Wiring, WiringError, suggestion

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
            wiring = swapped(wiring, Element(name, fmu.absolute(), described(fmu)), maps.get(name), warn)
        except FmuError as error:
            problems.append(f"{name}: {error}")
        except WiringError as error:
            problems += error.problems
    problems += [
        wiring.no_element(name) or f"The map is for {name}, which is not swapped." for name in maps if name not in fmus
    ]
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
        problem = wiring.no_element(their.name) or f"There is no element {their.name}." + suggestion(their.name, names)
        raise WiringError(wiring.name, [problem])
    swap = _Swap(wiring, their, map_)
    result = swap.result()
    if problems := [*swap.problems, *result.problems()]:
        raise WiringError(wiring.name, problems)
    for note in swap.notes:
        warn(f"{their.name}: {note}")
    return result


class _Place(NamedTuple):
    """The variable of theirs that stands for one of ours: theirs = factor * ours."""

    variable: str
    factor: float


class _Swap:
    """One element replaced; collects problems, and notes for the user."""

    def __init__(self, wiring: Wiring, their: Element, map_: SwapMap | None) -> None:
        self.wiring, self.their, self.map, self.is_mapped = wiring, their, map_ or SwapMap(), map_ is not None
        self.elements = {element.name: element for element in wiring.elements}
        self.our = self.elements[their.name]
        self.problems: list[str] = []
        self.notes: list[str] = []
        self.undeclared: dict[str, list[str]] = {}
        self.places: dict[str, _Place] = {}
        self.fed: list[Link] = []

    def result(self) -> Wiring:
        """Return the system with the element replaced, as far as that can be."""
        mapped: set[str] = set()
        for name, entry in self.map.variables.items():
            self._map(name, entry, mapped)
        # A variable's own constant goes before that of its group.
        groups = sorted(self.map.constants, key=len)
        constants = {v: self.map.constants[group] for group in groups for v in self._ours(group, "output")}
        without = {v for group in self.map.without for v in self._ours(group, "input")}
        left_out = constants.keys() | without
        for ours in sorted(self.places.keys() & left_out):
            self._problem(f"The map has {ours} both as {self.places[ours].variable} and as left out.")
        ends = [end.variable for link in self.wiring.links for end in link[:2] if end.element == self.our.name]
        # A map is for a stranger, whose mass goes with its own inertia: an equal name alone carries no parameter to it.
        kinds = ("input",) if self.is_mapped else ("input", "parameter")
        ends += [v for v in self.our.start_values if self.our.variables[v].causality in kinds]
        for ours in dict.fromkeys(ends):
            if ours in self.their.variables and ours not in mapped | left_out | self.places.keys():
                self.places[ours] = _Place(ours, self._factor(self.our, ours, ours, Entry(ours)))
        held = {
            link.target: self._constant(constants[link.source.variable], link)
            for link in self.wiring.links
            if link.source.element == self.our.name and link.source.variable in constants
        }
        dropped = {End(self.our.name, variable) for variable in without}
        links = [link for link in self.wiring.links if link.target not in held.keys() | dropped]
        elements = tuple(
            self._started() if element is self.our else _with_values(element, held)
            for element in self.elements.values()
        )
        result = replace(self.wiring, elements=elements, links=(*self._led(links), *self.fed))
        self._note(result, mapped)
        return result

    def _map(self, name: str, entry: Entry, mapped: set[str]) -> None:
        """Note the places of the variables that an entry of the map is for."""
        theirs = self.their.group(name)
        if not theirs:
            hint = suggestion(name, self.their.variables)
            self._problem(f"The map names {name}, which the FMU has not.{hint}")
        other, _, variable = entry.ours.partition(".")
        is_ours = bool(self.our.group(entry.ours)) or other not in self.elements
        owner, wanted = (self.our, entry.ours) if is_ours else (self.elements[other], variable)
        ours = owner.group(wanted)
        if not ours:
            known = [*self.our.variables, *(f"{e.name}.{v}" for e in self.elements.values() for v in e.variables)]
            what = f"which is neither a variable of {self.our.name} nor an output of another element"
            if variable and is_ours and not self.our.group(other):
                what = f"but there is no element {other} in the system, which has {', '.join(self.elements)}"
            by_fmu = self.wiring.no_element(other, f".{variable}") if variable and is_ours else ""
            told = f". {by_fmu}" if by_fmu else f", {what}.{suggestion(entry.ours, known)}"
            self._problem(f"The map names {entry.ours}{told}")
        for suffix, their in theirs.items() if ours else ():
            if their in mapped:
                self._problem(f"The map has {their} twice.")
            elif suffix not in ours:
                self._problem(f"The map has {name} for {entry.ours}, which has nothing for {their}.")
            else:
                self._place(owner, ours[suffix], their, entry)
            mapped.add(their)

    def _place(self, owner: Element, ours: str, their: str, entry: Entry) -> None:
        factor = self._factor(owner, ours, their, entry)
        kinds = [variable.causality for variable in (owner.variables[ours], self.their.variables[their])]
        if owner is not self.our:
            self.fed.append(Link(End(owner.name, ours), End(self.our.name, their), factor))
        elif kinds.count("output") == 1:
            self._problem(f"The map has {their}, of causality {kinds[1]}, for {ours}, of causality {kinds[0]}.")
        elif ours in self.places:
            self._problem(f"The map has {ours} twice: as {self.places[ours].variable} and as {their}.")
        else:
            self.places[ours] = _Place(their, factor)

    def _factor(self, owner: Element, ours: str, their: str, entry: Entry) -> float:
        """Return by what one of ours is multiplied to be one of theirs; note an angle whose unit nobody tells."""
        factor, problem = entry.conversion(owner, ours, self.their, their)
        if problem:
            self._problem(problem)
        unit, stated = owner.variables[ours].unit or "", self.their.variables[their].unit or entry.unit
        if unit.startswith("rad") and not stated and abs(entry.factor) == 1:
            self.undeclared.setdefault(unit, []).append(their)
        return factor

    def _ours(self, group: str, causality: str) -> Iterable[str]:
        """Return the variables of ours that the map leaves out by a name."""
        found = [v for v in self.our.group(group).values() if self.our.variables[v].causality == causality]
        if not found:
            known = [v.name for v in self.our.variables.values() if v.causality == causality]
            part = "constants" if causality == "output" else "without"
            self._problem(f"The map has {group} in {part}, which is no {causality} of ours.{suggestion(group, known)}")
        return found

    def _constant(self, value: Value, link: Link) -> Value:
        """Return what the receiver of an output of ours gets instead of it."""
        type_ = self.our.variables[link.source.variable].type
        if type_ == "Real" and type(value) is not bool:
            return link.factor * value
        if type(value) is not {"Boolean": bool, "Integer": int}.get(type_):
            self._problem(f"The constant {value!r} is not for {link.source.variable}, a {type_}.")
        return value

    def _led(self, links: Iterable[Link]) -> Iterator[Link]:
        """Yield the links, those of the element led to the variables of theirs."""
        name = self.our.name
        constant, without = f"give a constant ([{name}.constants])", f"name it in [{name}] without"
        open_: dict[tuple[str, ...], dict[str, None]] = {}
        for source, target, factor in links:
            from_, to = self.places.get(source.variable), self.places.get(target.variable)
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
            place, type_ = self.places.get(ours), self.our.variables[ours].type
            their = self.their.variables[place.variable] if place else None
            if place is None or their is None or their.causality not in ("input", "parameter"):
                dropped.append(ours)
            elif their.type != type_ or (type_ != "Real" and place.factor != 1):
                self._problem(f"{ours}, a {type_}, cannot be set as {place.factor:g} of {their.name}, a {their.type}.")
            else:
                values[place.variable] = place.factor * value if type_ == "Real" else value
        if dropped:
            who = "map" if self.is_mapped else "FMU"
            what = folded(dropped, self.our.start_values)
            self.notes.append(f"The {who} has no place for {what}: the FMU's own values hold.")
        return replace(self.their, start_values={**values, **self.their.start_values})

    def _note(self, result: Wiring, mapped: set[str]) -> None:
        for unit, names in self.undeclared.items():
            self.notes.append(f"The FMU declares no unit for {', '.join(names)}: taken as {unit}.")
        fed = {link.target.variable for link in result.links if link.target.element == self.our.name}
        known = {*fed, *mapped, *self.our.variables, *self.their.start_values}
        unfed = [v.name for v in self.their.variables.values() if v.causality == "input" and v.name not in known]
        if unfed:
            self.notes.append(f"Nothing feeds {', '.join(unfed)} of the FMU: the start value holds.")

    def _problem(self, text: str) -> None:
        self.problems.append(f"{self.our.name}: {text}")


def _with_values(element: Element, values: Mapping[End, Value]) -> Element:
    own = {end.variable: value for end, value in values.items() if end.element == element.name}
    return replace(element, start_values={**element.start_values, **own}) if own else element
