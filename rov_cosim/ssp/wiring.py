"""A flat system of FMUs: elements, links between their variables, start values, and what is wrong with them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import cached_property
from math import inf
from pathlib import Path
from typing import NamedTuple

from fmpy.model_description import ModelDescription, ModelVariable

from ..errors import UserError
from .remembered import remembered
from .units import conversion, units_of
from .values import Value, is_settable, parse, value_of


class WiringError(UserError):
    """A system that cannot run; `problems` lists every reason."""

    def __init__(self, where: str, problems: Iterable[str]) -> None:
        self.where, self.problems = where, list(problems)
        super().__init__("\n".join(f"{where}: {problem}" for problem in self.problems))


class End(NamedTuple):
    """One end of a link: a variable of an element."""

    element: str
    variable: str

    def __str__(self) -> str:
        return f"{self.element}.{self.variable}"


class Link(NamedTuple):
    """A connection from an output to an input, which receives the output times the factor, units converted thereby."""

    source: End
    target: End
    factor: float = 1.0


@dataclass(frozen=True)
class Element:
    """An FMU in a system.

    Parameters
    ----------
    name : name of the element in the system.
    fmu : the FMU, an archive.
    description : its model description.
    start_values : values set before the initialization, by variable.
    """

    name: str
    fmu: Path
    description: ModelDescription
    start_values: Mapping[str, Value] = field(default_factory=dict)

    @property
    def variables(self) -> Mapping[str, ModelVariable]:
        """Variables by name."""
        return variables_of(self.description)

    def runs_as(self, other: "Element") -> bool:
        """Tell whether this is another element by another path: name, content of the FMU, and all values."""
        if self.name != other.name or self.fmu.read_bytes() != other.fmu.read_bytes():
            return False
        named = {*self.start_values, *other.start_values}
        return all(one.has_value(name) for one in (self, other) for name in named) and all(
            self.value(name) == other.value(name) for name in named
        )

    def group(self, name: str) -> dict[str, str]:
        """Return the variables ``name``, ``name.*`` and ``name[*]``, by what follows the name."""
        return {
            variable[len(name) :]: variable
            for variable in self.variables
            if variable == name or variable.startswith((f"{name}.", f"{name}["))
        }

    def has_value(self, variable: str) -> bool:
        """Tell whether an input or parameter has a start value."""
        return variable in self.start_values or self.variables[variable].start is not None

    def value(self, variable: str) -> Value:
        """Return the start value of an input or parameter."""
        if variable in self.start_values:
            return self.start_values[variable]
        declared = self.variables[variable]
        return parse(str(declared.start), declared.type)


@dataclass(frozen=True)
class Wiring:
    """A system of elements, listed in the order in which a sequential master steps them.

    The name of an element may have dots: those of an archive's inner systems stand before it. Without a stop time, inf,
    it runs to one that is given.
    """

    name: str
    elements: tuple[Element, ...]
    links: tuple[Link, ...]
    stop_time: float
    step_size: float
    start_time: float = 0.0
    description: str = ""

    @property
    def outputs(self) -> set[str]:
        """All outputs, as ``element.variable``."""
        return {f"{e.name}.{output}" for e in self.elements for output in outputs_of(e.description)}

    def runs_as(self, other: "Wiring") -> bool:
        """Tell whether a run of this system is one of another: the same FMUs, links, values and times."""
        mine, its = ((w.links, w.start_time, w.stop_time, w.step_size, len(w.elements)) for w in (self, other))
        return mine == its and all(map(Element.runs_as, self.elements, other.elements))

    @property
    def has_stop_time(self) -> bool:
        """Tell whether the system says when a run ends."""
        return self.stop_time != inf

    def value(self, end: str) -> Value | None:
        """Return the start value of ``element.variable``, or None if there is none, or no such variable."""
        element, variable = self.parted(end)
        known = element is not None and variable in element.variables and element.has_value(variable)
        return element.value(variable) if element and known else None

    def parted(self, end: str) -> tuple[Element | None, str]:
        """Return element and variable of ``element.variable``, either of which may have dots in its name.

        The element is None if there is none; one that has the variable goes before one that has not.
        """
        found = [element for element in self.elements if end.startswith(f"{element.name}.")]
        for element in found:
            if (variable := end[len(element.name) + 1 :]) in element.variables:
                return element, variable
        longest = max(found, key=lambda element: len(element.name), default=None)
        return longest, end[len(longest.name) + 1 :] if longest else end.partition(".")[2]

    def link_to(self, end: str) -> Link | None:
        """Return the connection that feeds the input ``element.variable``, or None if there is none."""
        return self._links_by_target.get(end)

    @cached_property
    def _links_by_target(self) -> dict[str, Link]:
        return {str(link.target): link for link in reversed(self.links)}  # of two to one target, the first

    def with_values(self, values: Mapping[str, str | Value]) -> "Wiring":
        """Return the system with other start values, given by ``element.variable``, as values or literals.

        Raises
        ------
        WiringError : an unknown variable, one that cannot be set, or a literal that is not of its type.
        """
        problems, elements = [], {element.name: element for element in self.elements}
        for end, value in values.items():
            found, variable = self.parted(end)
            if found is None or variable not in found.variables:
                problems.append(self._unknown(end))
                continue
            name, element = found.name, elements[found.name]
            declared = element.variables[variable]
            if not is_settable(declared):
                what = "inputs and parameters can be set, and what has an exact or approximate start value"
                problems.append(f"{end} is of causality {declared.causality}: only {what}.")
                continue
            if link := self.link_to(end):
                source = link.source.element
                problems.append(f"{end} is connected: its value comes from {link.source}; set a parameter of {source}.")
                continue
            try:
                parsed = value_of(str(value), declared)
            except ValueError as error:
                problems.append(f"{end}: {error}")
                continue
            elements[name] = replace(element, start_values={**element.start_values, variable: parsed})
        if problems:
            raise WiringError(self.name, problems)
        return replace(self, elements=tuple(elements.values()))

    def _unknown(self, end: str) -> str:
        """Return a sentence on a variable that there is not, with what may be meant."""
        element, variable = self.parted(end)
        name = element.name if element else end.partition(".")[0]
        if element and (group := list(element.group(variable).values())):
            return f"{end} is a group: set {name}.{group[0]} ... {name}.{group[-1]}, one by one."
        known = [f"{e.name}.{v}" for e in self.elements for v in e.variables]
        whole = [f"{e.name}.{end}" for e in self.elements if end in e.variables]
        hint = f" Did you mean {' or '.join(whole)}?" if whole else suggestion(end, known)
        by_fmu = "" if element else called_by_fmu(name, self.elements, f".{variable}")
        return by_fmu or f"There is no variable {end}.{hint}"


@remembered
def variables_of(description: ModelDescription) -> Mapping[str, ModelVariable]:
    """Return the variables of an FMU by name."""
    return {variable.name: variable for variable in description.modelVariables}


@remembered
def inputs_of(description: ModelDescription) -> frozenset[str]:
    """Return the names of an FMU's inputs."""
    return frozenset(variable.name for variable in description.modelVariables if variable.causality == "input")


@remembered
def outputs_of(description: ModelDescription) -> frozenset[str]:
    """Return the names of an FMU's outputs."""
    return frozenset(variable.name for variable in description.modelVariables if variable.causality == "output")


def suggestion(name: str, known: Iterable[str], prefix: str = "") -> str:
    """Return a hint at the names most like an unknown one, each shown with a prefix, or nothing."""
    close = get_close_matches(name, list(known), n=3)
    return f" Did you mean {' or '.join(prefix + match for match in close)}?" if close else ""


def called_by_fmu(name: str, elements: Iterable[Element], after: str = "") -> str:
    """Return a sentence on an element that there is not, called by the name of an FMU; nothing if it is none.

    `after` is what follows the name in what the user meant.
    """
    elements = list(elements)
    found = [element.name for element in elements if element.description.modelName == name]
    if not found or name in [element.name for element in elements]:
        return ""
    wanted = " or ".join(f"{element}{after}" for element in found)
    return f"There is no element {name}: {name} is the FMU of {found[0]}; write {wanted}."


def converted(link: Link, elements: Mapping[str, Element]) -> Link:
    """Return a link whose factor converts the source's unit to the target's besides, where it can be."""
    return link._replace(factor=link.factor * (unit_factor(link, elements) or 1.0))


def unit_factor(link: Link, elements: Mapping[str, Element]) -> float | None:
    """Return the factor from the source's unit to the target's; None if there is none, or an end is missing."""
    found = [(elements[end.element], end.variable) for end in link[:2] if end.element in elements]
    ends = [(element, element.variables[name]) for element, name in found if name in element.variables]
    if len(ends) < 2:
        return None
    (from_, source), (to, target) = ends
    return conversion(source.unit, units_of(from_.description), target.unit, units_of(to.description))
