"""Strict reading of flat SSP 1.0 archives: everything that is wrong with one is told at once."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from zipfile import BadZipFile, ZipFile

from fmpy import read_model_description
from lxml import etree

from .ssp_writer import NAMESPACES
from .wiring import Element, End, Link, Value, Wiring, WiringError, parse, same_unit, suggestion

STEP_SIZE = 0.03
"""Communication step in s of an archive that names none."""

_STANDARD = {prefix: NAMESPACES[prefix] for prefix in ("ssd", "ssc", "ssv")}
_READ = {
    "ssd": {
        "SystemStructureDescription",
        "System",
        "Elements",
        "Component",
        "Connectors",
        "Connector",
        "Connections",
        "Connection",
        "ParameterBindings",
        "ParameterBinding",
        "ParameterValues",
        "Units",
        "DefaultExperiment",
    },
    "ssc": {"Unit", "BaseUnit", "Real", "Integer", "Boolean"},
    "ssv": {"ParameterSet", "Parameters", "Parameter", "Real", "Integer", "Boolean", "Units"},
}
_IGNORED = {
    "Annotations",
    "ElementGeometry",
    "ConnectorGeometry",
    "ConnectionGeometry",
    "SystemGeometry",
    "GraphicalElements",
}


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
            raise WiringError(
                str(path), ["There is no such archive; `rov-cosim build` makes those of this project."]
            ) from None
        except (BadZipFile, OSError) as error:
            raise WiringError(
                str(path), [f"This is not a readable SSP archive ({error}); build or copy it again."]
            ) from None
        yield _Reader(Path(folder), str(path)).read()


class _Reader:
    """One pass over an extracted archive that collects problems."""

    def __init__(self, root: Path, where: str) -> None:
        self.root, self.where = root, where
        self.problems: list[str] = []

    def read(self) -> Wiring:
        document = self._parse("SystemStructure.ssd", "SystemStructureDescription.xsd")
        if document is None:
            raise WiringError(self.where, self.problems)
        system = document.find("ssd:System", _STANDARD)
        components = system.iterfind("ssd:Elements/ssd:Component", _STANDARD)
        elements = [element for component in components if (element := self._element(component)) is not None]
        elements = self._system_parameters(system, elements)
        links = self._links(system)
        experiment = document.find("ssd:DefaultExperiment", _STANDARD)
        start, stop = (None, None) if experiment is None else (experiment.get("startTime"), experiment.get("stopTime"))
        wiring = Wiring(
            name=document.get("name"),
            elements=tuple(elements),
            links=tuple(links),
            start_time=float(start or 0.0),
            stop_time=float(stop or 1.0),
            step_size=self._step_size(document),
        )
        if not elements:
            self.problems.append("SystemStructure.ssd: the system has no component.")
        # An element that could not be read is a problem told already; its connections would only repeat it.
        self.problems += wiring.problems() if not self.problems else []
        if self.problems:
            raise WiringError(self.where, self.problems)
        return wiring

    def _parse(self, name: str, schema: str) -> etree._Element | None:
        """Return the root of an XML file that is valid and holds nothing that this reader would pass over."""
        try:
            root = etree.parse(self.root / name).getroot()
        except OSError:
            self.problems.append(f"The archive has no {name}.")
            return None
        except etree.XMLSyntaxError as error:
            self.problems.append(f"{name} is not well-formed XML: {error}.")
            return None
        return root if self._understood(root, name, schema) else None

    def _understood(self, root: etree._Element, name: str, schema: str) -> bool:
        validator = etree.XMLSchema(file=str(files("fmpy.ssp") / "schema" / schema))
        if not validator.validate(root):
            self.problems += [f"{name}, line {entry.line}: {entry.message}" for entry in validator.error_log]
            return False
        unknown = [f"{name}, line {line}: {what} is not supported." for line, what in _unsupported(root)]
        self.problems += unknown
        return not unknown

    def _element(self, component: etree._Element) -> Element | None:
        name, source = component.get("name"), component.get("source")
        fmu = self.root / source
        if not fmu.is_relative_to(self.root) or ".." in fmu.parts or not fmu.is_file():
            self.problems.append(f"{name}: the archive has no FMU {source}.")
            return None
        folder = self.root / "extracted" / name
        try:
            with ZipFile(fmu) as archive:
                archive.extractall(folder)
            description = read_model_description(str(folder))
        except Exception as error:  # FMPy raises plain exceptions of many types
            self.problems.append(f"{name}: {source} is not a readable FMU: {' '.join(str(error).split())}")
            return None
        element = Element(name, folder, description)
        self._check_connectors(component, element)
        values: dict[str, Value] = {}
        for parameter, unit, value in self._bound(component):
            self._apply(element, parameter, unit, value, values)
        return Element(name, folder, description, values)

    def _check_connectors(self, component: etree._Element, element: Element) -> None:
        for connector in component.iterfind("ssd:Connectors/ssd:Connector", _STANDARD):
            name, kind = connector.get("name"), connector.get("kind")
            variable = element.variables.get(name)
            if variable is None:
                hint = suggestion(name, element.variables)
                self.problems.append(f"Connector {element.name}.{name}: the FMU has no such variable." + hint)
                continue
            if kind != variable.causality:
                self.problems.append(
                    f"Connector {element.name}.{name}: kind {kind} does not match causality {variable.causality}."
                )
            for typed in connector:
                local = etree.QName(typed).localname
                if local in ("Real", "Integer", "Boolean") and local != variable.type:
                    self.problems.append(
                        f"Connector {element.name}.{name}: type {local} does not match {variable.type}."
                    )
                elif (
                    local == "Real" and typed.get("unit") and not _unit_fits(typed.get("unit"), element, variable.unit)
                ):
                    self.problems.append(
                        f"Connector {element.name}.{name}: unit {typed.get('unit')} does not match {variable.unit}."
                    )

    def _bound(self, owner: etree._Element) -> Iterator[tuple[str, str | None, str]]:
        """Yield name, unit and literal of the parameters bound to a component or system."""
        for binding in owner.iterfind("ssd:ParameterBindings/ssd:ParameterBinding", _STANDARD):
            prefix, source = binding.get("prefix", ""), binding.get("source")
            if source is None:
                parameter_set = binding.find("ssd:ParameterValues/ssv:ParameterSet", _STANDARD)
            else:
                parameter_set = self._parse(source, "SystemStructureParameterValues.xsd")
            if parameter_set is None:
                continue
            for parameter in parameter_set.iterfind("ssv:Parameters/ssv:Parameter", _STANDARD):
                typed = parameter[0]
                yield prefix + parameter.get("name"), typed.get("unit"), typed.get("value")

    def _apply(self, element: Element, name: str, unit: str | None, literal: str, values: dict[str, Value]) -> None:
        variable = element.variables.get(name)
        if variable is None:
            self.problems.append(f"There is no parameter {element.name}.{name}." + suggestion(name, element.variables))
            return
        if unit and not _unit_fits(unit, element, variable.unit):
            self.problems.append(f"Parameter {element.name}.{name}: unit {unit} does not match {variable.unit}.")
        try:
            values[name] = parse(literal, variable.type)
        except ValueError as error:
            self.problems.append(f"Parameter {element.name}.{name}: {error}.")

    def _system_parameters(self, system: etree._Element, elements: list[Element]) -> list[Element]:
        """Return the elements with the values bound to the system as ``element.parameter``, which come first."""
        values: dict[str, dict[str, Value]] = {element.name: dict(element.start_values) for element in elements}
        by_name = {element.name: element for element in elements}
        for parameter, unit, value in self._bound(system):
            name, _, variable = parameter.partition(".")
            if name in by_name:
                self._apply(by_name[name], variable, unit, value, values[name])
            else:
                self.problems.append(f"Parameter {parameter}: there is no element {name}." + suggestion(name, by_name))
        return [Element(e.name, e.fmu, e.description, values[e.name]) for e in elements]

    def _links(self, system: etree._Element) -> Iterator[Link]:
        for connection in system.iterfind("ssd:Connections/ssd:Connection", _STANDARD):
            source, target = connection.get("startElement"), connection.get("endElement")
            start, end = connection.get("startConnector"), connection.get("endConnector")
            if source is None:
                self.problems.append(
                    f"Connection {start} -> {target}.{end} wants an external signal; only parameters are fed in."
                )
            elif target is not None:  # an output that leaves the system is recorded under its element's name
                yield Link(End(source, start), End(target, end))

    def _step_size(self, document: etree._Element) -> float:
        """Return the step that the annotations of Open Simulation Platform or OpenModelica name."""
        for path, attribute in ((".//osp:FixedStepAlgorithm", "baseStepSize"), (".//oms:FixedStepMaster", "stepSize")):
            found = document.find(path, NAMESPACES)
            if found is not None and found.get(attribute):
                return float(found.get(attribute))
        return STEP_SIZE


def _unit_fits(unit: str, element: Element, declared: str | None) -> bool:
    return same_unit(element.description, unit, element.description, declared)


def _unsupported(root: etree._Element) -> Iterator[tuple[int, str]]:
    """Yield line and name of the elements that mean something this reader does not do."""
    prefixes = {namespace: prefix for prefix, namespace in _STANDARD.items()}
    pending = [root]
    while pending:
        node = pending.pop()
        if not isinstance(node.tag, str):
            continue
        name = etree.QName(node)
        prefix = prefixes.get(name.namespace)
        if name.localname in _IGNORED:
            continue
        nested = name.localname == "System" and prefix == "ssd" and node.getparent() is not root and node is not root
        if prefix is None or name.localname not in _READ[prefix] or nested:
            yield node.sourceline, f"{'a nested ' if nested else ''}{name.localname}"
            continue
        pending.extend(reversed(node))
