"""Parameter sets of SSP 1.0 (SSV) and their mappings (SSM), checked against the FMU that they are for."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path

from fmpy.model_description import ModelDescription, ModelVariable
from lxml import etree

from .strict_xml import STANDARD, parse_strictly
from .transformation import Linear, Table, transformation
from .units import BASE_UNITS, Base, is_defined, line_between, units_of
from .values import Value, is_settable, value_of
from .wiring import Wiring, WiringError, suggestion

_FITTING = {("Integer", "Real"), ("Integer", "Enumeration")}
"""Types of a parameter and of a variable that differ, and yet fit."""


@dataclass(frozen=True)
class Bound:
    """A value as it stands in a parameter set, bound to a name.

    Parameters
    ----------
    name : of a variable of the element, or as the system has it, for example ``element.variable``.
    type, literal, unit : as in the set, which defines `units`.
    transformation : what the mapping does to it.
    is_converted : whether its unit is converted to the variable's.
    via, factor : the unit of the system's connector that it goes through, with what the units there mean, and by what
        it is multiplied on the way from there.
    """

    name: str
    type: str
    literal: str
    unit: str | None
    units: Mapping[str, Base]
    transformation: Linear | Table | None = None
    is_converted: bool = True
    via: tuple[str, Mapping[str, Base]] | None = None
    factor: float = 1.0

    def value_for(self, variable: ModelVariable, units: Mapping[str, Base]) -> Value:
        """Return the value for a variable in whose FMU units mean `units`; ValueError if there is none."""
        value = self._value_for(variable, units)
        if isinstance(value, float) and not isfinite(value):
            raise ValueError(f"{self.literal} becomes {value:g} by units and factors on its way")
        return value

    def _value_for(self, variable: ModelVariable, units: Mapping[str, Base]) -> Value:
        if self.type != variable.type and (self.type, variable.type) not in _FITTING:
            raise ValueError(f"type {self.type} does not match {variable.type}")
        value = value_of(self._tabled(variable), variable)
        if variable.type == "Real" and self.is_converted:
            unit, known = self.via or (variable.unit, units)
            line = line_between(self.unit, self.units, unit, known)
            if line is None and not self.undefined(variable, units):
                raise ValueError(f"unit {self.unit} does not match {unit}")
            factor, offset = line or (1.0, 0.0)
            value = factor * float(value) + (0.0 if variable.relativeQuantity else offset)
        if isinstance(self.transformation, Linear):
            value = self.transformation(value)
        if self.factor == 1:
            return value
        if variable.type != "Real":
            raise ValueError(f"the factor {self.factor:g} on its way is not for a {variable.type}")
        return self.factor * float(value)

    def undefined(self, variable: ModelVariable, units: Mapping[str, Base]) -> str:
        """Return the unit of which nobody says what it means, so that it cannot be converted; nothing if all do."""
        unit, known = self.via or (variable.unit, units)
        if not self.unit or not unit or self.unit == unit or not self.is_converted:
            return ""
        return next((u for u, of in ((self.unit, self.units), (unit, known)) if not is_defined(u, of)), "")

    def _tabled(self, variable: ModelVariable) -> str:
        table, literal = self.transformation, self.literal
        if not isinstance(table, Table):
            return literal
        if table.type == "Integer" and self.type == "Enumeration":
            literal = str(value_of(literal, variable))
        elif table.type != self.type:
            raise ValueError(f"a {table.type}MappingTransformation is not for type {self.type}")
        return table(literal)


def read_parameter_set(path: Path, description: ModelDescription) -> dict[str, Value]:
    """Return the values in a file, by variable of the FMU that is described.

    Raises
    ------
    WiringError : every problem found: what `parse_strictly` refuses, a parameter that stands twice, is unknown or
        cannot be set, a unit or type that differs, a literal that is no value.
    """
    document = parse_strictly(path, str(path), "ssv")
    bound = list(parameters(document))
    problems = list(repeated(bound))
    values = checked_values(bound, description.modelName, description, problems, problems.append)
    if problems:
        raise WiringError(str(path), problems)
    return values


def read_values(path: Path, wiring: Wiring, warn: Callable[[str], None]) -> dict[str, Value]:
    """Return the values in a file whose names are ``element.variable``, by these names.

    Raises
    ------
    WiringError : every problem found, as in `read_parameter_set`, and elements that the system has not.
    """
    bound = list(parameters(parse_strictly(path, str(path), "ssv")))
    problems, values = list(repeated(bound)), {}
    by_element: dict[str, list[Bound]] = {}
    for one in bound:
        element, variable = wiring.parted(one.name)
        if element is None:
            known = ", ".join(each.name for each in wiring.elements)
            problems.append(f"{one.name} is of none of the elements {known}: expected names like controller.K_P.x.")
        else:
            by_element.setdefault(element.name, []).append(replace(one, name=variable))
    for each in wiring.elements:
        found = checked_values(by_element.get(each.name, ()), each.name, each.description, problems, warn)
        values.update({f"{each.name}.{variable}": value for variable, value in found.items()})
    if problems:
        raise WiringError(str(path), problems)
    return values


def parameters(parameter_set: etree._Element, prefix: str = "") -> Iterator[Bound]:
    """Yield the parameters of a set, with a prefix to their names."""
    units = units_in(parameter_set)
    for parameter in parameter_set.iterfind("ssv:Parameters/ssv:Parameter", STANDARD):
        name = prefix + parameter.get("name")
        typed = parameter.find("ssv:*", STANDARD)
        yield Bound(name, etree.QName(typed).localname, typed.get("value"), typed.get("unit"), units)


def repeated(bound: Iterable[Bound], where: str = "in one parameter set: remove one") -> Iterator[str]:
    """Yield a sentence for each parameter that stands twice, `where` with the cure."""
    for name, times in Counter(one.name for one in bound).items():
        if times > 1:
            yield f"Parameter {name} stands twice {where}."


def mapped(
    bound: Iterable[Bound], mapping: etree._Element, problems: list[str], warn: Callable[[str], None]
) -> Iterator[Bound]:
    """Yield what a parameter mapping makes of a set: the parameters that it names alone, by its names for them.

    Those of them that stand twice are added to `problems`; `warn` is told of those that are not in the set.
    """
    bound, lacking = list(bound), []
    by_name = {one.name: one for one in bound}
    wanted = {entry.get("source") for entry in mapping.iterfind("ssm:MappingEntry", STANDARD)}
    problems += repeated(one for one in bound if one.name in wanted)
    for entry in mapping.iterfind("ssm:MappingEntry", STANDARD):
        source = entry.get("source")
        if source not in by_name:
            lacking += [source] if source else []  # tools list what is to be mapped one day with an empty source
            continue
        transformed = transformation(next(entry.iterchildren("{*}*"), None))
        is_converted = entry.get("suppressUnitConversion") not in ("true", "1")
        yield replace(by_name[source], name=entry.get("target"), transformation=transformed, is_converted=is_converted)
    if lacking:
        few = ", ".join(lacking[:3]) + (", ..." if len(lacking) > 3 else "")
        warn(f"The parameter mapping is for {len(lacking)} parameters that its set has not: {few}")


def checked_values(
    bound: Iterable[Bound],
    element: str,
    description: ModelDescription,
    problems: list[str],
    warn: Callable[[str], None],
) -> dict[str, Value]:
    """Return the values bound to an element, whose FMU is described, and add to `problems` what is wrong with them.

    `warn` is told of units that cannot be converted because nobody defines them.
    """
    values: dict[str, Value] = {}
    undefined: list[str] = []
    variables = {variable.name: variable for variable in description.modelVariables}
    units = units_of(description)
    for one in bound:
        variable, where = variables.get(one.name), f"Parameter {element}.{one.name}"
        if variable is None:
            hint = suggestion(one.name, variables, f"{element}.")
            problems.append(f"There is no parameter {element}.{one.name}." + hint)
        elif not is_settable(variable):
            problems.append(f"{element}.{one.name} cannot be set: it is neither a parameter nor an input, nor exact.")
        else:
            try:
                values[one.name] = one.value_for(variable, units)
            except ValueError as error:
                problems.append(f"{where}: {error}.")
            if unit := one.undefined(variable, units):
                undefined.append(f"{where}: the unit {unit} is not defined; {one.literal} is taken as it is.")
    if undefined:
        more = f" Likewise {len(undefined) - 1} more." if len(undefined) > 1 else ""
        warn(undefined[0] + more)
    return values


def units_in(root: etree._Element) -> dict[str, Base]:
    """Return what the units defined in an SSD or SSV mean, by name."""
    units = {}
    for unit in root.iterfind("{*}Units/ssc:Unit", STANDARD):
        base = unit.find("ssc:BaseUnit", STANDARD)
        exponents = (float(base.get(name, 0)) for name in BASE_UNITS)
        units[unit.get("name")] = (*exponents, float(base.get("factor", 1)), float(base.get("offset", 0)))
    return units
