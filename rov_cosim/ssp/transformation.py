"""Transformations of SSP 1.0 on the way of a parameter from its set to a variable."""

from collections.abc import Mapping
from dataclasses import dataclass

from lxml import etree

from .values import Value, parse

_TABLE = "MappingTransformation"


@dataclass(frozen=True)
class Linear:
    """target = factor * source + offset, after the conversion of units."""

    factor: float = 1.0
    offset: float = 0.0

    def __call__(self, value: Value) -> Value:
        """Return the number that it makes of one; ValueError if it is none, or was whole and is no more."""
        if type(value) not in (int, float):
            raise ValueError(f"a LinearTransformation is not for {value!r}")
        result = self.factor * value + self.offset  # type: ignore[operator]
        return result if type(value) is float else parse(repr(result), "Integer")


@dataclass(frozen=True)
class Table:
    """A literal for each value of a type."""

    type: str
    entries: Mapping[str, str]

    def __call__(self, literal: str) -> str:
        """Return the literal that it has for another; ValueError if it has none."""
        key = _key(literal, self.type)
        if key not in self.entries:
            raise ValueError(f"its {self.type}{_TABLE} has no entry for {literal!r}")
        return self.entries[key]


def transformation(node: etree._Element | None) -> Linear | Table | None:
    """Return what an XML element says, None if there is none."""
    if node is None:
        return None
    name = etree.QName(node).localname
    if name == "LinearTransformation":
        return Linear(float(node.get("factor", "1")), float(node.get("offset", "0")))
    type_ = name.removesuffix(_TABLE)
    return Table(type_, {_key(entry.get("source"), type_): entry.get("target") for entry in node})


def _key(literal: str, type_: str) -> str:
    return literal if type_ == "Enumeration" else repr(parse(literal, type_))
