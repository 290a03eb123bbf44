"""A flat system of FMUs: elements, links between their variables, start values, and what is wrong with them."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path
from typing import NamedTuple

import numpy as np
from fmpy.model_description import ModelDescription, ModelVariable

from ..errors import UserError
from .units import conversion, units_of
from .values import TYPES, Value, parse

MOST_STEPS = 10_000_000


class WiringError(UserError):
    """A system that cannot run; `problems` lists every reason."""

    def __init__(self, where: str, problems: Iterable[str]) -> None:
        self.problems = list(problems)
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
    def variables(self) -> dict[str, ModelVariable]:
        """Variables by name."""
        return {variable.name: variable for variable in self.description.modelVariables}

    def group(self, name: str) -> dict[str, str]:
        """Return the variables ``name``, ``name.*`` and ``name[*]``, by what follows the name."""
        return {
            variable[len(name) :]: variable
            for variable in self.variables
            if variable == name or variable.startswith((f"{name}.", f"{name}["))
        }

    def value(self, variable: str) -> Value:
        """Return the start value of an input or parameter."""
        if variable in self.start_values:
            return self.start_values[variable]
        declared = self.variables[variable]
        return parse(str(declared.start), declared.type)


@dataclass(frozen=True)
class Wiring:
    """A system of elements, listed in the order in which a sequential master steps them."""

    name: str
    elements: tuple[Element, ...]
    links: tuple[Link, ...]
    stop_time: float
    step_size: float
    start_time: float = 0.0
    description: str = ""

    def value(self, end: str) -> Value | None:
        """Return the start value of ``element.variable``, or None if the system has no such variable."""
        name, _, variable = end.partition(".")
        known = {element.name: element for element in self.elements}
        return known[name].value(variable) if name in known and variable in known[name].variables else None

    def link_to(self, end: str) -> Link | None:
        """Return the connection that feeds the input ``element.variable``, or None if there is none."""
        return next((link for link in self.links if str(link.target) == end), None)

    def with_values(self, values: Mapping[str, str | Value]) -> "Wiring":
        """Return the system with other start values, given by ``element.variable``, as values or literals.

        Raises
        ------
        WiringError : an unknown variable, one that cannot be set, or a literal that is not of its type.
        """
        problems, elements = [], {element.name: element for element in self.elements}
        known = [f"{e.name}.{v}" for e in self.elements for v in e.variables]
        for end, value in values.items():
            name, _, variable = end.partition(".")
            element = elements.get(name)
            if element is None or variable not in element.variables:
                by_fmu = called_by_fmu(name, self.elements, f".{variable}") if element is None else ""
                problems.append(by_fmu or f"There is no variable {end}." + suggestion(end, known))
                continue
            declared = element.variables[variable]
            if declared.causality not in ("input", "parameter"):
                problems.append(f"{end} is of causality {declared.causality}: only inputs and parameters can be set.")
                continue
            if link := self.link_to(end):
                problems.append(f"{end} is connected: its value comes from {link.source}.")
                continue
            try:
                parsed = parse(str(value), declared.type)
            except ValueError as error:
                problems.append(f"{end}: {error}")
                continue
            elements[name] = replace(element, start_values={**element.start_values, variable: parsed})
        if problems:
            raise WiringError(self.name, problems)
        return replace(self, elements=tuple(elements.values()))

    def problems(self) -> list[str]:
        """Return a sentence for everything that keeps the system from running."""
        return [*self._element_problems(), *self._link_problems(), *self._experiment_problems()]

    def _element_problems(self) -> Iterable[str]:
        for name, times in Counter(element.name for element in self.elements).items():
            if times > 1:
                yield f"There are {times} elements of the name {name}: give each a name of its own."
            if "." in name or "/" in name or "\\" in name:
                yield f"The element name {name} holds a dot or a slash: rename it."
        for element in self.elements:
            for variable in element.start_values:
                if variable not in element.variables:
                    hint = suggestion(variable, element.variables, f"{element.name}.")
                    yield f"There is no parameter {element.name}.{variable}." + hint
                elif element.variables[variable].causality not in ("input", "parameter"):
                    yield f"{element.name}.{variable} cannot be set: it is neither a parameter nor an input."

    def _link_problems(self) -> Iterable[str]:
        known = {element.name: element for element in self.elements}
        driven: dict[End, End] = {}
        for source, target, factor in self.links:
            ends = []
            where = f"Connection {source} -> {target}"
            for end, causality in ((source, "output"), (target, "input")):
                element = known.get(end.element)
                variable = element.variables.get(end.variable) if element else None
                if element is None:
                    yield f"{where}: there is no element {end.element}." + suggestion(end.element, known)
                elif variable is None:
                    hint = suggestion(end.variable, element.variables)
                    yield f"{where}: the FMU of {element.name} has no variable {end.variable}." + hint
                elif variable.causality != causality:
                    yield f"{where}: {end} is of causality {variable.causality}, not {causality}."
                else:
                    ends.append((element, variable))
            if len(ends) == 2:
                yield from _mismatches(where, *ends[0], *ends[1])
                if factor != 1 and (ends[0][1].type != "Real" or not np.isfinite(factor)):
                    yield f"{where}: the factor {factor:g} is not for a {ends[0][1].type}, or not finite."
            if target in driven:
                yield f"Input {target} has two sources, {driven[target]} and {source}: remove one connection."
            driven[target] = source

    def _experiment_problems(self) -> Iterable[str]:
        start, stop, step = self.start_time, self.stop_time, self.step_size
        if not start < stop < np.inf or start == -np.inf:
            yield f"The run is from {start} s to {stop} s; expected finite times, the stop after the start."
        elif not 0 < step < np.inf:
            yield f"The step size is {step} s; expected a positive number of seconds."
        elif (stop - start) / step * (1 + 1e-9) < 1:
            yield f"The run from {start} s to {stop} s is shorter than a step of {step} s."
        elif (stop - start) / step > MOST_STEPS:
            n = (stop - start) / step
            yield f"The run has {n:.3g} steps; expected at most {MOST_STEPS:.3g}: take longer steps."


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


def _mismatches(where: str, from_: Element, source: ModelVariable, to: Element, target: ModelVariable) -> Iterable[str]:
    if source.type != target.type:
        yield f"{where}: type {source.type} does not match {target.type}."
    elif source.type not in TYPES:
        yield f"{where}: type {source.type} is not supported; {', '.join(TYPES)} are."
    if conversion(source.unit, units_of(from_.description), target.unit, units_of(to.description)) is None:
        yield f"{where}: unit {source.unit} does not match {target.unit}: no factor converts one to the other."
