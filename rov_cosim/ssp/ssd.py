"""A SystemStructure.ssd as a tree: systems in systems, components, connectors, connections and bound parameters."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote

from lxml import etree

from .parameter_set import Bound, mapped, parameters, repeated, units_in
from .strict_xml import NAMESPACES, STANDARD, check, parse_strictly
from .units import Base
from .wiring import WiringError


class Connector(NamedTuple):
    """A connector as the SSD declares it; type and unit may be left out."""

    kind: str
    type: str | None = None
    unit: str | None = None


class Connection(NamedTuple):
    """A connection; each end is the name of an element of the system, None for the system itself, and a connector."""

    start: tuple[str | None, str]
    end: tuple[str | None, str]
    factor: float = 1.0
    is_converted: bool = True


@dataclass(frozen=True)
class Component:
    """An FMU; `source` is where the archive has it."""

    name: str
    connectors: Mapping[str, Connector]
    bound: tuple[Bound, ...]
    source: str


@dataclass(frozen=True)
class DictionaryReference:
    """The signals of a dictionary, as a system sees them."""

    name: str
    connectors: Mapping[str, Connector]
    dictionary: str


@dataclass(frozen=True)
class Subsystem:
    """A system: the root, or one in another."""

    name: str
    connectors: Mapping[str, Connector]
    bound: tuple[Bound, ...]
    elements: "tuple[Component | DictionaryReference | Subsystem, ...]"
    connections: tuple[Connection, ...]
    dictionaries: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Structure:
    """What a SystemStructure.ssd says; times in s, inf and None where it says none."""

    name: str
    description: str
    root: Subsystem
    units: Mapping[str, Base]
    start_time: float
    stop_time: float
    step_size: float | None


def read(path: Path, problems: list[str], warn: Callable[[str], None]) -> Structure | None:
    """Return what an SSD says, and add to `problems` what is wrong with it or with the files that it names.

    None if it cannot be read at all. `warn` is told what is not quite as it should be.
    """
    reader = _Reader(path.parent, problems, warn)
    document = reader.parse(path.name, "ssd")
    if document is None:
        return None
    experiment = document.find("ssd:DefaultExperiment", STANDARD)
    times = {} if experiment is None else experiment.attrib
    return Structure(
        name=document.get("name"),
        description=document.get("description", ""),
        root=reader.system(document.find("ssd:System", STANDARD)),
        units=units_in(document),
        start_time=float(times.get("startTime", "0")),
        stop_time=float(times.get("stopTime", inf)),
        step_size=reader.step_size(document),
    )


def located(root: Path, source: str) -> Path | None:
    """Return the file in an unpacked archive that a URI names, or None if there is none."""
    for name in (source, unquote(source).replace("\\", "/")):
        with suppress(OSError, ValueError):  # of a name that cannot be one
            path = root / name
            if path.is_file() and ".." not in path.parts and path.is_relative_to(root):
                return path
    return None


class _Reader:
    """Reads the parts of an SSD, whose folder is `root`, and collects problems."""

    def __init__(self, root: Path, problems: list[str], warn: Callable[[str], None]) -> None:
        self._root, self._problems, self._warn = root, problems, warn

    def parse(self, source: str, kind: str) -> etree._Element | None:
        """Return the root of a file in the archive, or None."""
        path = located(self._root, source)
        try:
            if path is None:
                raise WiringError(source, ["The archive has no such file."])
            return parse_strictly(path, source, kind, self._warn)
        except WiringError as error:
            self._problems += str(error).splitlines()
            return None

    def system(self, node: etree._Element) -> Subsystem:
        """Return a system with all that is in it."""
        listed = [] if (elements := node.find("ssd:Elements", STANDARD)) is None else elements
        return Subsystem(
            name=node.get("name", ""),
            connectors=self._connectors(node),
            bound=self._bound(node),
            elements=tuple(self._element(child) for child in listed),
            connections=tuple(map(_connection, node.iterfind("ssd:Connections/ssd:Connection", STANDARD))),
            dictionaries=frozenset(
                dictionary.get("name")
                for dictionary in node.iterfind("ssd:SignalDictionaries/ssd:SignalDictionary", STANDARD)
            ),
        )

    def _element(self, node: etree._Element) -> Component | DictionaryReference | Subsystem:
        kind = etree.QName(node).localname
        if kind == "System":
            return self.system(node)
        if kind == "SignalDictionaryReference":
            return DictionaryReference(node.get("name"), self._connectors(node), node.get("dictionary"))
        return Component(node.get("name"), self._connectors(node), self._bound(node), node.get("source"))

    def _connectors(self, node: etree._Element) -> dict[str, Connector]:
        found = {}
        for connector in node.iterfind("ssd:Connectors/ssd:Connector", STANDARD):
            typed = connector.find("ssc:*", STANDARD)
            type_, unit = (None, None) if typed is None else (etree.QName(typed).localname, typed.get("unit"))
            found[connector.get("name")] = Connector(connector.get("kind"), type_, unit)
        return found

    def _bound(self, node: etree._Element) -> tuple[Bound, ...]:
        """Return the parameters bound to a component or system, the later of two of a name going before."""
        found: list[Bound] = []
        for binding in node.iterfind("ssd:ParameterBindings/ssd:ParameterBinding", STANDARD):
            parameter_set = self._attached(binding, binding.find("ssd:ParameterValues", STANDARD), "ssv")
            if parameter_set is None:
                continue
            bound = list(parameters(parameter_set, binding.get("prefix", "")))
            entry = binding.find("ssd:ParameterMapping", STANDARD)
            if entry is None:
                self._problems += repeated(bound)
            else:
                mapping = self._attached(entry, entry, "ssm")
                bound = [] if mapping is None else list(mapped(bound, mapping, self._problems, self._warn))
                self._problems += repeated(bound, "as a target of one parameter mapping: remove an entry")
            found += bound
        return tuple(found)

    def _attached(self, node: etree._Element, inline: etree._Element | None, kind: str) -> etree._Element | None:
        """Return the document that a node names as its source, or has in it."""
        source = node.get("source")
        if source:
            return self.parse(source, kind)
        where = f"SystemStructure.ssd, line {node.sourceline}"
        try:
            if inline is None or not len(inline):
                raise WiringError(where, [f"This {etree.QName(node).localname} has neither a source nor content."])
            check(inline[0], where, kind, self._warn)
        except WiringError as error:
            self._problems += str(error).splitlines()
            return None
        return inline[0]

    def step_size(self, document: etree._Element) -> float | None:
        """Return the step that the annotations of Open Simulation Platform or OpenModelica name."""
        for path, attribute in ((".//osp:FixedStepAlgorithm", "baseStepSize"), (".//oms:FixedStepMaster", "stepSize")):
            found = document.find(path, NAMESPACES)
            if found is not None and found.get(attribute):
                try:
                    return float(found.get(attribute))
                except ValueError:
                    self._problems.append(f"SystemStructure.ssd: the {attribute} {found.get(attribute)} is no number.")
        return None


def _connection(node: etree._Element) -> Connection:
    linear = node.find("ssc:LinearTransformation", STANDARD)
    return Connection(
        (node.get("startElement") or None, node.get("startConnector")),  # some tools leave the name empty
        (node.get("endElement") or None, node.get("endConnector")),
        1.0 if linear is None else float(linear.get("factor", "1")),
        node.get("suppressUnitConversion") not in ("true", "1"),
    )
