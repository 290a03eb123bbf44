"""Which variable of another FMU stands for which of an element of ours, as a map tells."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from .swap_map import Entry, SwapMap
from .wiring import Element, End, Link, called_by_fmu, suggestion


class Place(NamedTuple):
    """The variable of theirs that stands for one of ours: theirs = factor * ours."""

    variable: str
    factor: float


class Places:
    """What a map comes to between two elements; collects what is wrong with it.

    Parameters
    ----------
    our : the element with the variables that the map calls ours.
    their : the FMU, under the same name.
    map_ : the map.
    others : elements by name whose outputs may feed variables of theirs.

    Attributes
    ----------
    of : the places by variable of ours.
    fed : links from outputs of other elements.
    mapped : variables of theirs that the map is for.
    constants, without : values of outputs of ours, and inputs of ours, that the FMU has not.
    undeclared : variables of theirs that are taken in our unit of an angle, by unit.
    problems : a sentence for everything that is wrong.
    """

    def __init__(self, our: Element, their: Element, map_: SwapMap, others: Mapping[str, Element]) -> None:
        self._our, self._their, self._elements = our, their, {**others, our.name: our}
        self.of: dict[str, Place] = {}
        self.fed: list[Link] = []
        self.mapped: set[str] = set()
        self.undeclared: dict[str, list[str]] = {}
        self.problems: list[str] = []
        for name, entry in map_.variables.items():
            self._map(name, entry)
        # A variable's own constant goes before that of its group.
        groups = sorted(map_.constants, key=len)
        self.constants = {v: map_.constants[group] for group in groups for v in self._ours(group, "output")}
        self.without = {v for group in map_.without for v in self._ours(group, "input")}
        for ours in sorted(self.of.keys() & self.left_out):
            self._problem(f"The map has {ours} both as {self.of[ours].variable} and as left out.")

    @property
    def left_out(self) -> set[str]:
        """Variables of ours that the FMU has not, by the map."""
        return self.constants.keys() | self.without

    def pair(self, names: Iterable[str]) -> None:
        """Give variables of ours that have no place that of their own name, if it is free."""
        for ours in dict.fromkeys(names):
            if ours in self._their.variables and ours not in self.mapped | self.left_out | self.of.keys():
                self.of[ours] = Place(ours, self._factor(self._our, ours, ours, Entry(ours)))

    def _map(self, name: str, entry: Entry) -> None:
        """Note the places of the variables that an entry of the map is for."""
        theirs = self._their.group(name)
        if not theirs:
            hint = suggestion(name, self._their.variables)
            self._problem(f"The map names {name}, which the FMU has not.{hint}")
        first = entry.ours.partition(".")[0]
        other = max((n for n in self._elements if entry.ours.startswith(f"{n}.")), key=len, default=first)
        variable = entry.ours[len(other) + 1 :]
        is_ours = bool(self._our.group(entry.ours)) or other not in self._elements
        owner, wanted = (self._our, entry.ours) if is_ours else (self._elements[other], variable)
        ours = owner.group(wanted)
        if not ours:
            known = [*self._our.variables, *(f"{e.name}.{v}" for e in self._elements.values() for v in e.variables)]
            what = f"which is neither a variable of {self._our.name} nor an output of another element"
            if variable and is_ours and not self._our.group(other):
                what = f"but there is no element {other} in the system, which has {', '.join(self._elements)}"
            by_fmu = called_by_fmu(other, self._elements.values(), f".{variable}") if variable and is_ours else ""
            reason = f". {by_fmu}" if by_fmu else f", {what}.{suggestion(entry.ours, known)}"
            self._problem(f"The map names {entry.ours}{reason}")
        for suffix, their in theirs.items() if ours else ():
            if their in self.mapped:
                self._problem(f"The map has {their} twice.")
            elif suffix not in ours:
                self._problem(f"The map has {name} for {entry.ours}, which has nothing for {their}.")
            else:
                self._place(owner, ours[suffix], their, entry)
            self.mapped.add(their)

    def _place(self, owner: Element, ours: str, their: str, entry: Entry) -> None:
        factor = self._factor(owner, ours, their, entry)
        kinds = [variable.causality for variable in (owner.variables[ours], self._their.variables[their])]
        if owner is not self._our:
            self.fed.append(Link(End(owner.name, ours), End(self._our.name, their), factor))
        elif kinds.count("output") == 1:
            self._problem(f"The map has {their}, of causality {kinds[1]}, for {ours}, of causality {kinds[0]}.")
        elif ours in self.of:
            self._problem(f"The map has {ours} twice: as {self.of[ours].variable} and as {their}.")
        else:
            self.of[ours] = Place(their, factor)

    def _factor(self, owner: Element, ours: str, their: str, entry: Entry) -> float:
        """Return by what one of ours is multiplied to be one of theirs; note an angle whose unit nobody tells."""
        factor, problem = entry.conversion(owner, ours, self._their, their)
        if problem:
            self._problem(problem)
        unit, stated = owner.variables[ours].unit or "", self._their.variables[their].unit or entry.unit
        if unit.startswith("rad") and not stated and abs(entry.factor) == 1:
            self.undeclared.setdefault(unit, []).append(their)
        return factor

    def _ours(self, group: str, causality: str) -> Iterable[str]:
        """Return the variables of ours that the map leaves out by a name."""
        found = [v for v in self._our.group(group).values() if self._our.variables[v].causality == causality]
        if not found:
            known = [v.name for v in self._our.variables.values() if v.causality == causality]
            part = "constants" if causality == "output" else "without"
            self._problem(f"The map has {group} in {part}, which is no {causality} of ours.{suggestion(group, known)}")
        return found

    def _problem(self, text: str) -> None:
        self.problems.append(f"{self._our.name}: {text}")
