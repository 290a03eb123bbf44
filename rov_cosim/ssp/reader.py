"""Strict reading of flat SSP 1.0 archives: everything that is wrong with one is told at once."""

import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from zipfile import BadZipFile, ZipFile

from lxml import etree

from ..components.interface import SAMPLE_TIME
from .checks import problems_of
from .fmu_file import FmuError, described
from .parameter_set import SCHEMA, Bound, checked_values, parameters, units_in
from .strict_xml import NAMESPACES, STANDARD, parse_strictly
from .units import Base, same_unit, units_of
from .values import TYPES, Value
from .wiring import Element, End, Link, Wiring, WiringError, converted, suggestion


@contextmanager
def opened(path: Path) -> Iterator[Wiring]:
    """Read an archive and yield its system; its FMUs lie in a temporary folder until the context ends.

    Raises
    ------
    WiringError : every problem found: a broken archive, XML that the standard or this reader does not know, a missing
        FMU, connectors that do not match, units or types that differ, unknown parameters.
    """
    with tempfile.TemporaryDirectory(prefix="rov_cosim_") as folder:
        try:
            with ZipFile(path) as archive:
                archive.extractall(folder)
        except FileNotFoundError:
            problem = "There is no such archive; `rov-cosim build` makes those of this project."
            raise WiringError(str(path), [problem]) from None
        except (BadZipFile, OSError, RuntimeError) as error:  # the last where it is encrypted
            problem = f"This is not a readable SSP archive ({error}); build or copy it again."
            raise WiringError(str(path), [problem]) from None
        yield _Reader(Path(folder), str(path)).read()


class _Reader:
    """One pass over an extracted archive that collects problems."""

    def __init__(self, root: Path, where: str) -> None:
        self.root, self.where = root, where
        self.problems: list[str] = []
        self.unreadable: set[str] = set()

    def read(self) -> Wiring:
        document = self._parse("SystemStructure.ssd", "SystemStructureDescription.xsd")
        if document is None:
            raise WiringError(self.where, self.problems)
        system = document.find("ssd:System", STANDARD)
        units = units_in(document)
        components = system.findall("ssd:Elements/ssd:Component", STANDARD)
        if not components:
            self.problems.append("SystemStructure.ssd: the system has no component.")
        elements = [self._element(component, units) for component in components]
        wiring = Wiring(
            name=document.get("name"),
            elements=tuple(self._system_parameters(system, [element for element in elements if element])),
            links=tuple(self._links(system, {element.name: element for element in elements if element})),
            start_time=self._time(document, "startTime", "0"),
            stop_time=self._time(document, "stopTime", None),
            step_size=self._step_size(document),
            description=document.get("description", ""),
        )
        self.problems += problems_of(wiring)
        if self.problems:
            raise WiringError(self.where, self.problems)
        return wiring

    def _parse(self, name: str, schema: str) -> etree._Element | None:
        try:
            return parse_strictly(self.root / name, name, schema)
        except WiringError as error:
            self.problems += str(error).splitlines()
            return None

    def _element(self, component: etree._Element, units: Mapping[str, Base]) -> Element | None:
        name, source = component.get("name"), component.get("source")
        self.unreadable.add(name)
        fmu = self.root / source
        if ".." in fmu.parts or not fmu.is_relative_to(self.root) or not fmu.is_file():
            self.problems.append(f"{name}: the archive has no FMU {source}.")
            return None
        try:
            description = described(fmu, source)
        except FmuError as error:
            self.problems.append(f"{name}: {error}")
            return None
        self.unreadable.discard(name)
        element = Element(name, fmu, description)
        self._check_connectors(component, element, units)
        return replace(element, start_values=self._values(self._bound(component), element))

    def _check_connectors(self, component: etree._Element, element: Element, units: Mapping[str, Base]) -> None:
        for connector in component.iterfind("ssd:Connectors/ssd:Connector", STANDARD):
            name, kind = connector.get("name"), connector.get("kind")
            where, variable = f"Connector {element.name}.{name}", element.variables.get(name)
            if variable is None:
                self.problems.append(f"{where}: the FMU has no such variable." + suggestion(name, element.variables))
                continue
            if kind != variable.causality:
                self.problems.append(f"{where}: kind {kind} does not match causality {variable.causality}.")
            for typed in connector:
                type_, unit = etree.QName(typed).localname, typed.get("unit")
                if type_ in TYPES and type_ != variable.type:
                    self.problems.append(f"{where}: type {type_} does not match {variable.type}.")
                elif not same_unit(unit, units, variable.unit, units_of(element.description)):
                    self.problems.append(f"{where}: unit {unit} does not match {variable.unit}.")

    def _values(self, bound: Iterable[Bound], element: Element) -> dict[str, Value]:
        return checked_values(bound, element.name, element.description, self.problems)

    def _bound(self, owner: etree._Element) -> Iterator[Bound]:
        """Yield the parameters bound to a component or system."""
        for binding in owner.iterfind("ssd:ParameterBindings/ssd:ParameterBinding", STANDARD):
            prefix, source = binding.get("prefix", ""), binding.get("source")
            if source is None:
                parameter_set = binding.find("ssd:ParameterValues/ssv:ParameterSet", STANDARD)
            else:
                parameter_set = self._parse(source, SCHEMA)
            if parameter_set is None:
                continue
            yield from parameters(parameter_set, self.problems, prefix)

    def _system_parameters(self, system: etree._Element, elements: list[Element]) -> Iterator[Element]:
        """Yield the elements with the values bound to the system as ``element.parameter``, which come first."""
        names = {element.name for element in elements} | self.unreadable
        bound: dict[str, list[Bound]] = {}
        for parameter_set, name, typed in self._bound(system):
            element, _, variable = name.partition(".")
            bound.setdefault(element, []).append(Bound(parameter_set, variable, typed))
            if element not in names:
                self.problems.append(f"Parameter {name}: there is no element {element}." + suggestion(element, names))
        for e in elements:
            values = {**e.start_values, **self._values(bound.get(e.name, ()), e)}
            yield replace(e, start_values=values)

    def _links(self, system: etree._Element, elements: Mapping[str, Element]) -> Iterator[Link]:
        for connection in system.iterfind("ssd:Connections/ssd:Connection", STANDARD):
            source, target = connection.get("startElement"), connection.get("endElement")
            start, end = connection.get("startConnector"), connection.get("endConnector")
            if source is None:
                self.problems.append(
                    f"Connection {start} -> {target}.{end} wants an external signal; none can be fed in."
                )
            # An output that leaves the system is recorded all the same; an unreadable element is told already.
            elif target is not None and not {source, target} & self.unreadable:
                transformation = connection.find("ssc:LinearTransformation", STANDARD)
                factor = 1.0 if transformation is None else float(transformation.get("factor", "1"))
                link = Link(End(source, start), End(target, end), factor)
                suppressed = connection.get("suppressUnitConversion") in ("true", "1")
                yield link if suppressed else converted(link, elements)

    def _time(self, document: etree._Element, attribute: str, default: str | None) -> float:
        experiment = document.find("ssd:DefaultExperiment", STANDARD)
        literal = default if experiment is None else experiment.get(attribute, default)
        if literal is None:
            self.problems.append(f"SystemStructure.ssd: the DefaultExperiment has no {attribute}: give it one.")
            return 1.0
        return float(literal)

    def _step_size(self, document: etree._Element) -> float:
        """Return the step that the annotations of Open Simulation Platform or OpenModelica name, or the paper's."""
        for path, attribute in ((".//osp:FixedStepAlgorithm", "baseStepSize"), (".//oms:FixedStepMaster", "stepSize")):
            found = document.find(path, NAMESPACES)
            if found is not None and found.get(attribute):
                try:
                    return float(found.get(attribute))
                except ValueError:
                    self.problems.append(f"SystemStructure.ssd: the {attribute} {found.get(attribute)} is no number.")
        return SAMPLE_TIME
