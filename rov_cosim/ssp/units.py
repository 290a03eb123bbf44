"""What the units of FMUs and archives mean, and the factor from one to another."""

from collections.abc import Mapping
from math import isclose, pi

from fmpy.model_description import BaseUnit, ModelDescription, Unit

from ..errors import UserError
from ..exporters.model_description import UNITS
from .remembered import remembered

Base = tuple[float, ...]
"""Exponents of the base units, factor and offset: what a unit means."""

BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


def base_of(unit: BaseUnit) -> Base:
    """Return what a unit means."""
    return (*(float(getattr(unit, name)) for name in BASE_UNITS), float(unit.factor), float(unit.offset))


KNOWN: dict[str, Base] = {
    **{name: base_of(unit.baseUnit) for name, unit in UNITS.items()},
    "deg": base_of(BaseUnit(rad=1, factor=pi / 180)),
    "deg/s": base_of(BaseUnit(rad=1, s=-1, factor=pi / 180)),
    "mm": base_of(BaseUnit(m=1, factor=1e-3)),
    "cm": base_of(BaseUnit(m=1, factor=1e-2)),
    "kN": base_of(BaseUnit(kg=1, m=1, s=-2, factor=1e3)),
    "kN.m": base_of(BaseUnit(kg=1, m=2, s=-2, factor=1e3)),
}
"""What a name means where it is not defined: many tools name units and leave the definition out."""


@remembered
def units_of(description: ModelDescription) -> Mapping[str, Base]:
    """Return what the units that an FMU defines mean, by name."""
    return {unit.name: base_of(unit.baseUnit) for unit in description.unitDefinitions if unit.baseUnit is not None}


def defined_units(descriptions: Mapping[str, ModelDescription]) -> dict[str, Unit]:
    """Return the units that the FMUs of some elements define, by name.

    Raises
    ------
    UserError : two of them mean different things by one name, which an archive cannot say.
    """
    found: dict[str, tuple[str, Unit]] = {}
    for element, description in descriptions.items():
        for unit in description.unitDefinitions:
            other, known = found.setdefault(unit.name, (element, unit))
            both = known.baseUnit is not None and unit.baseUnit is not None
            if both and base_of(known.baseUnit) != base_of(unit.baseUnit):
                raise UserError(f"The FMUs of {other} and {element} define unit {unit.name} differently: rename one.")
    return {name: unit for name, (_, unit) in found.items()}


def conversion(a: str | None, units_a: Mapping[str, Base], b: str | None, units_b: Mapping[str, Base]) -> float | None:
    """Return the factor from numbers in unit `a` to numbers in unit `b`, or None if no factor turns one into the other.

    Units are compared by definition, else by what their names are known for, else by name; no unit fits any.
    """
    line = line_between(a, units_a, b, units_b)
    return line[0] if line and not line[1] else None


def line_between(
    a: str | None, units_a: Mapping[str, Base], b: str | None, units_b: Mapping[str, Base]
) -> tuple[float, float] | None:
    """Return factor and offset from numbers in unit `a` to numbers in `b`, or None; units are as in `conversion`."""
    if not a or not b:
        return 1.0, 0.0
    base_a, base_b = units_a.get(a, KNOWN.get(a)), units_b.get(b, KNOWN.get(b))
    if base_a is None or base_b is None:
        return (1.0, 0.0) if a == b else None
    (*dimension_a, factor_a, offset_a), (*dimension_b, factor_b, offset_b) = base_a, base_b
    if dimension_a != dimension_b:
        return None
    # Tools write pi/180 to twelve digits or so, which is no other unit.
    if offset_a == offset_b and isclose(factor_a, factor_b):
        return 1.0, 0.0
    if not factor_a or not factor_b:
        return None
    return factor_a / factor_b, (offset_a - offset_b) / factor_b


def is_defined(unit: str | None, units: Mapping[str, Base]) -> bool:
    """Tell whether it is known what a unit means."""
    return not unit or unit in units or unit in KNOWN


def same_unit(a: str | None, units_a: Mapping[str, Base], b: str | None, units_b: Mapping[str, Base]) -> bool:
    """Tell whether numbers in two units mean the same."""
    return conversion(a, units_a, b, units_b) == 1.0
