"""Parameter sets of SSP 1.0 (SSV), checked against the FMU that they are for."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from fmpy.model_description import ModelDescription
from lxml import etree

from .strict_xml import STANDARD, parse_strictly
from .units import BASE_UNITS, Base, same_unit, units_of
from .values import Value, parse
from .wiring import WiringError, suggestion

SCHEMA = "SystemStructureParameterValues.xsd"


class Bound(NamedTuple):
    """A parameter as it stands in a parameter set."""

    parameter_set: etree._Element
    name: str
    typed: etree._Element


def read_parameter_set(path: Path, description: ModelDescription) -> dict[str, Value]:
    """Return the values in a file, by variable of the FMU that is described.

    Raises
    ------
    WiringError : every problem found: what `parse_strictly` refuses, a parameter that stands twice, is unknown or
        cannot be set, a unit or type that differs, a literal that is no value.
    """
    document = parse_strictly(path, str(path), SCHEMA)
    problems: list[str] = []
    values = checked_values(parameters(document, problems), description.modelName, description, problems)
    if problems:
        raise WiringError(str(path), problems)
    return values


def parameters(parameter_set: etree._Element, problems: list[str], prefix: str = "") -> Iterator[Bound]:
    """Yield the parameters of a set, with a prefix to their names, and add to `problems` those that stand twice."""
    seen: set[str] = set()
    for parameter in parameter_set.iterfind("ssv:Parameters/ssv:Parameter", STANDARD):
        name = prefix + parameter.get("name")
        if name in seen:
            problems.append(f"Parameter {name} stands twice in one parameter set: remove one.")
        seen.add(name)
        yield Bound(parameter_set, name, parameter.find("ssv:*", STANDARD))


def checked_values(
    bound: Iterable[Bound], element: str, description: ModelDescription, problems: list[str]
) -> dict[str, Value]:
    """Return the values bound to an element, whose FMU is described, and add to `problems` what is wrong with them."""
    values: dict[str, Value] = {}
    variables = {variable.name: variable for variable in description.modelVariables}
    for parameter_set, name, typed in bound:
        variable = variables.get(name)
        if variable is None:
            hint = suggestion(name, variables, f"{element}.")
            problems.append(f"There is no parameter {element}.{name}." + hint)
            continue
        if variable.causality not in ("input", "parameter"):
            problems.append(f"{element}.{name} cannot be set: it is neither a parameter nor an input.")
            continue
        where, unit = f"Parameter {element}.{name}", typed.get("unit")
        type_ = etree.QName(typed).localname
        if type_ != variable.type and (type_, variable.type) != ("Integer", "Real"):
            problems.append(f"{where}: type {type_} does not match {variable.type}.")
            continue
        if not same_unit(unit, units_in(parameter_set), variable.unit, units_of(description)):
            problems.append(f"{where}: unit {unit} does not match {variable.unit}.")
        try:
            values[name] = parse(typed.get("value"), variable.type)
        except ValueError as error:
            problems.append(f"{where}: {error}.")
    return values


def units_in(root: etree._Element) -> dict[str, Base]:
    """Return what the units defined in an SSD or SSV mean, by name."""
    units = {}
    for unit in root.iterfind("{*}Units/ssc:Unit", STANDARD):
        base = unit.find("ssc:BaseUnit", STANDARD)
        exponents = (float(base.get(name, 0)) for name in BASE_UNITS)
        units[unit.get("name")] = (*exponents, float(base.get("factor", 1)), float(base.get("offset", 0)))
    return units
