"""Values of FMI variables, and the literals that stand for them."""

import numpy as np

Value = float | int | bool
TYPES = ("Real", "Integer", "Boolean")
LARGEST_INTEGER = 2**31 - 1


def parse(literal: str, type_: str) -> Value:
    """Return the value that a literal stands for in a variable of an FMI type; ValueError if it is none."""
    text = literal.strip()
    if "_" in text or not text.isascii():  # Python reads 1_000, and the digits of every script
        raise ValueError(f"expected {'true or false' if type_ == 'Boolean' else 'a number'}, got {literal!r}")
    if type_ not in TYPES:
        raise ValueError(f"type {type_} is not supported; {', '.join(TYPES)} are")
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
