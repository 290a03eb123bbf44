"""Values of FMI variables, and the literals that stand for them."""

import numpy as np
from fmpy.model_description import ModelVariable

Value = float | int | bool | str
TYPES = ("Real", "Integer", "Boolean", "String", "Enumeration")
LARGEST_INTEGER = 2**31 - 1


def parse(literal: str, type_: str) -> Value:
    """Return the value that a literal stands for in a variable of an FMI type; ValueError if it is none.

    An Enumeration is a number here; `value_of` knows its items.
    """
    if type_ not in TYPES:
        raise ValueError(f"type {type_} is not supported; {', '.join(TYPES)} are")
    if type_ == "String":
        return literal
    text = literal.strip()
    if "_" in text or not text.isascii():  # Python reads 1_000, and the digits of every script
        raise ValueError(f"expected {'true or false' if type_ == 'Boolean' else 'a number'}, got {literal!r}")
    if type_ == "Boolean":
        values = {"true": True, "1": True, "false": False, "0": False}
        if text.lower() not in values:
            raise ValueError(f"expected true or false, got {literal!r}")
        return values[text.lower()]
    try:
        value = float(text)
        if type_ != "Real" and (value != int(value) or abs(value) > LARGEST_INTEGER):
            raise ValueError
    except (ValueError, OverflowError):
        kind = "a number" if type_ == "Real" else f"a whole number of at most {LARGEST_INTEGER}"
        raise ValueError(f"expected {kind}, got {literal!r}") from None
    if not np.isfinite(value):
        raise ValueError(f"expected a finite number, got {literal!r}")
    return value if type_ == "Real" else int(value)


def value_of(literal: str, variable: ModelVariable) -> Value:
    """Return what `parse` does for a variable, an item of whose enumeration may be given by name or number."""
    items = items_of(variable)
    if not items:
        return parse(literal, variable.type)
    if literal in items:
        return items[literal]
    try:
        number = parse(literal, variable.type)
    except ValueError:
        number = ""
    if number not in items.values():
        known = ", ".join(f"{name} ({number})" for name, number in items.items())
        raise ValueError(f"expected one of {known}, got {literal!r}")
    return number


def are_alike(type_: str, other: str) -> bool:
    """Tell whether values of a type are values of another too: an Enumeration is an Integer."""
    return type_ == other or {type_, other} == {"Integer", "Enumeration"}


def function_type(variable: ModelVariable) -> str:
    """Return the type that a variable has in the names of the functions that set and read it."""
    return "Integer" if variable.type == "Enumeration" else str(variable.type)


def items_of(variable: ModelVariable) -> dict[str, int]:
    """Return the items of a variable's enumeration by name; none if it is of another type, or the FMU tells none.

    Items without a whole number, a formal fault, cannot be given.
    """
    declared = variable.declaredType
    if variable.type != "Enumeration" or declared is None:
        return {}
    return {item.name: int(item.value) for item in declared.items if is_value(item.value, "Integer")}


def is_value(literal: str | None, type_: str) -> bool:
    """Tell whether a literal stands for a value of an FMI type."""
    try:
        parse(str(literal), type_)
    except ValueError:
        return False
    return True


def is_settable(variable: ModelVariable) -> bool:
    """Tell whether a variable can be set before the initialization."""
    if variable.variability == "constant":
        return False
    return variable.causality in ("input", "parameter") or variable.initial in ("exact", "approx")
