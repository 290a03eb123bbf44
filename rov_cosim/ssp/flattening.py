"""A tree of systems made flat: links between variables of FMUs, and the values bound to these.

Connections lead through the connectors of systems and the signals of dictionaries, so they are followed from each input
back to the output that feeds it. Units are converted from one connector that has a unit to the next that has one.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from .parameter_set import Bound
from .ssd import Component, Connector, DictionaryReference, Structure, Subsystem
from .units import Base, conversion, is_defined, units_of
from .wiring import Element, End, Link, suggestion

Path = tuple[str, ...]
"""Names from the root system to an element; that of the root itself is empty."""

_SIDES = {"input": -1, "parameter": -1, "output": 1, "calculatedParameter": 1}
"""Whether a connector of an element takes values (-1) or gives them (1), seen from outside."""


class _Node(NamedTuple):
    """A connector of an element or system, or a signal of a dictionary that the system at the path has."""

    path: Path
    name: str
    dictionary: str = ""

    def __str__(self) -> str:
        return ".".join(filter(None, (*self.path, self.dictionary, self.name)))


class _Edge(NamedTuple):
    source: _Node
    target: _Node
    factor: float
    is_converted: bool


def _side(connector: Connector | None) -> int:
    return 0 if connector is None else _SIDES.get(connector.kind, 0)


def components(system: Subsystem, path: Path = ()) -> Iterator[tuple[Path, Component]]:
    """Yield the components of a system and of those in it, each with its path."""
    for element in system.elements:
        if isinstance(element, Component):
            yield (*path, element.name), element
        elif isinstance(element, Subsystem):
            yield from components(element, (*path, element.name))


class Flattening:
    """The links and bound values of a structure.

    Parameters
    ----------
    structure : the tree.
    elements : its components by path, None those whose FMU cannot be read.
    warn : called with what is left out.

    Attributes
    ----------
    links : links between variables, in the order of the connections that end in an FMU.
    bound : parameters by path of the component, the later of two of a name going before.
    problems : a sentence for everything that is wrong.
    """

    def __init__(
        self, structure: Structure, elements: Mapping[Path, Element | None], warn: Callable[[str], None]
    ) -> None:
        self._elements, self._units, self._warn = elements, structure.units, warn
        self._systems: dict[Path, Subsystem] = {}
        self._list_systems(structure.root, ())
        self.problems: list[str] = []
        self._into: dict[_Node, list[_Edge]] = {}
        self._out_of: dict[_Node, list[_Edge]] = {}
        edges = [edge for path in self._systems for edge in self._edges(path)]
        for edge in edges:
            self._into.setdefault(edge.target, []).append(edge)
            self._out_of.setdefault(edge.source, []).append(edge)
        self._unfed: dict[_Node, list[_Node]] = {}
        self.links = [link for edge in edges if self._is_leaf(edge.target) for link in self._links(edge)]
        self._started: set[_Node] = set()
        self.bound: dict[Path, list[Bound]] = {path: [] for path in elements}
        self._bind(structure.root, ())
        for node, targets in self._unfed.items():
            if node not in self._started and not self._is_parameter(node):
                warn(f"Nothing feeds {node} of the archive: the start values hold of {', '.join(map(str, targets))}.")

    def _list_systems(self, system: Subsystem, path: Path) -> None:
        self._systems[path] = system
        for element in system.elements:
            if isinstance(element, Subsystem):
                self._list_systems(element, (*path, element.name))

    def _is_parameter(self, node: _Node) -> bool:
        connector = self._systems[node.path].connectors.get(node.name)
        return connector is not None and connector.kind == "parameter"

    def _is_leaf(self, node: _Node) -> bool:
        return node.path not in self._systems

    def _edges(self, path: Path) -> Iterator[_Edge]:
        """Yield the connections of a system in the direction of the signals, which SSP does not ask of them."""
        for connection in self._systems[path].connections:
            first, last = self._end(path, *connection.start), self._end(path, *connection.end)
            if first is None or last is None:
                continue
            (start, side), (end, other) = first, last
            if side == other != 0 and not (self._is_leaf(start) and self._is_leaf(end)):
                what = "give a value" if side > 0 else "take one"
                self.problems.append(f"Connection {start} -> {end}: both ends {what}.")
            elif (side < 0 or other > 0) and side != other:
                yield _Edge(end, start, connection.factor, connection.is_converted)
            else:
                yield _Edge(start, end, connection.factor, connection.is_converted)

    def _end(self, path: Path, name: str | None, connector: str) -> tuple[_Node, int] | None:
        """Return an end of a connection of a system, and its side as in `_SIDES`, 0 if it may have either.

        None if that is told already.
        """
        system = self._systems[path]
        if name is None:
            return _Node(path, connector), -_side(system.connectors.get(connector))
        element = next((element for element in system.elements if element.name == name), None)
        place = (*path, name)
        if isinstance(element, Subsystem):
            return _Node(place, connector), _side(element.connectors.get(connector))
        if isinstance(element, DictionaryReference):
            scope = self._scope(path, element.dictionary)
            if scope is None:
                self.problems.append(f"{'.'.join(place)}: there is no signal dictionary {element.dictionary}.")
                return None
            return _Node(scope, connector, element.dictionary), _side(element.connectors.get(connector))
        leaf = _Node(place, connector)
        if place not in self._elements:  # `checks` tells of unknown elements
            return leaf, 0
        fmu = self._elements[place]
        if fmu is None:
            return None
        variable = fmu.variables.get(connector)
        return leaf, 0 if variable is None else _SIDES.get(variable.causality, 0)

    def _scope(self, path: Path, dictionary: str) -> Path | None:
        """Return the innermost system around a place that has a dictionary."""
        around = (path[:n] for n in range(len(path), -1, -1))
        return next((outer for outer in around if dictionary in self._systems[outer].dictionaries), None)

    def _links(self, edge: _Edge) -> Iterator[Link]:
        """Yield the link that ends with an edge into an FMU, if an FMU is at its other end."""
        way = [edge]
        while not self._is_leaf(node := way[0].source):
            into = self._into.get(node, [])
            if len(into) > 1:
                self.problems.append(f"{node} has {len(into)} sources, {into[0].source} and {into[1].source}.")
            elif not into:
                self._unfed.setdefault(node, []).append(edge.target)
            elif into[0] in way:
                self.problems.append(f"The connections of {node} go round in a loop.")
            else:
                way.insert(0, into[0])
                continue
            return
        source, target = (End(".".join(node.path), node.name) for node in (way[0].source, edge.target))
        yield Link(source, target, self._factor(way))

    def _factor(self, way: Sequence[_Edge]) -> float:
        """Return by what a value is multiplied on its way, units converted; tell of those that cannot be."""
        factor = 1.0
        unit, units = self._unit(way[0].source)
        for edge in way:
            next_, known = self._unit(edge.target)
            ratio = conversion(unit, units, next_, known) if edge.is_converted else 1.0
            if ratio is None:
                where = f"Connection {way[0].source} -> {way[-1].target}"
                lacking = [u for u, of in ((unit, units), (next_, known)) if not is_defined(u, of)]
                if lacking:
                    self._warn(f"{where}: the unit {lacking[0]} is not defined; the number is taken as {next_}.")
                else:
                    self.problems.append(
                        f"{where}: unit {unit} does not match {next_}: no factor converts one to the other."
                    )
            factor *= (ratio or 1.0) * edge.factor
            if next_ or not edge.is_converted:
                unit, units = next_, known
        return factor

    def _unit(self, node: _Node) -> tuple[str | None, Mapping[str, Base]]:
        if not self._is_leaf(node):
            connector = None if node.dictionary else self._systems[node.path].connectors.get(node.name)
            return connector.unit if connector else None, self._units
        element = self._elements.get(node.path)
        variable = element.variables.get(node.name) if element else None
        return (variable.unit, units_of(element.description)) if element and variable else (None, {})

    def _bind(self, system: Subsystem, path: Path) -> None:
        """Bind the parameters of a system and of those in it, inner ones first, for the outer go before them."""
        for element in system.elements:
            place = (*path, element.name)
            if isinstance(element, Subsystem):
                self._bind(element, place)
            elif isinstance(element, Component):
                self.bound[place] += element.bound
        strays = []
        for one in system.bound:
            found = self._targets(system, path, one, one.name)
            strays += [one.name] if found is None else []
            for place, led in found or ():
                self.bound[place].append(led)
        if strays:
            inside = {p[len(path) :]: e for p, e in self._elements.items() if e and p[: len(path)] == path}
            known = [f"{'.'.join(p)}.{variable}" for p, e in inside.items() for variable in e.variables]
            hint = suggestion(strays[0], known)
            of = f"the system {'.'.join(path)}" if path else "the archive"
            what = f"{strays[0]} is" if len(strays) == 1 else f"{len(strays)} parameters are, as {strays[0]},"
            self._warn(f"{what} bound to {of} for nothing that is in it, and left out.{hint}")

    def _targets(self, system: Subsystem, path: Path, one: Bound, name: str) -> list[tuple[Path, Bound]] | None:
        """Return what a parameter sets by a name in a system, component by component; None if there is no such name.

        It may be that of a connector, from where the connections lead on, and that of a variable below an element's.
        """
        found: list[tuple[Path, Bound]] | None = None
        connector = system.connectors.get(name)
        if _side(connector) < 0:
            self._started.add(_Node(path, name))
            ways = [(way[-1].target.path, way) for way in self._ways(_Node(path, name))]
            found = [(place, self._led(one, way)) for place, way in ways if place in self._elements]
        for element in system.elements:
            rest, place = name.removeprefix(f"{element.name}."), (*path, element.name)
            if rest == name:
                continue
            within = None
            if isinstance(element, Subsystem):
                within = self._targets(element, place, one, rest)
            elif isinstance(element, Component):
                fmu = self._elements[place]
                if fmu is None:
                    within = []
                elif rest in fmu.variables:
                    within = [(place, replace(one, name=rest))]
            found = found if within is None else [*(found or ()), *within]
        return found

    def _ways(self, node: _Node, before: tuple[_Edge, ...] = ()) -> Iterator[tuple[_Edge, ...]]:
        """Yield the ways that lead from a connector to FMUs, but for those through what has two sources, a problem."""
        for edge in self._out_of.get(node, ()):
            if self._is_leaf(edge.target):
                yield (*before, edge)
            elif edge not in before and len(self._into[edge.target]) == 1:
                yield from self._ways(edge.target, (*before, edge))

    def _led(self, one: Bound, way: tuple[_Edge, ...]) -> Bound:
        unit, units = self._unit(way[0].source)
        via = (unit, units) if unit else None
        return replace(one, name=way[-1].target.name, via=via, factor=self._factor(way))
