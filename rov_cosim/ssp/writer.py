"""SSP 1.0 archives: SystemStructure.ssd, one parameter set an element, the FMUs.

The prefixes ssd:, ssc: and ssv: are literal, every connector has a type, and the communication step stands in the
annotations of Open Simulation Platform and OpenModelica, because readers of SSP depend on each of these.
"""

from collections.abc import Mapping

from fmpy.model_description import ModelVariable, SimpleType, Unit
from lxml import etree

from ..exporters.model_description import literal
from .checks import problems_of
from .strict_xml import NAMESPACES
from .units import BASE_UNITS, defined_units
from .values import Value, items_of
from .wiring import Element, Wiring, WiringError, unit_factor

PARAMETER_SET = "nominal"


def entries(wiring: Wiring) -> dict[str, bytes]:
    """Return the content of the archive of a system, name to bytes.

    Raises
    ------
    WiringError : it would be an archive that cannot run.
    """
    if problems := problems_of(wiring):
        raise WiringError(wiring.name, problems)
    content = {"SystemStructure.ssd": system_structure(wiring)}
    for element in wiring.elements:
        content[f"resources/{element.name}.fmu"] = element.fmu.read_bytes()
        if element.start_values:
            content[f"resources/{element.name}.ssv"] = parameter_set(element)
    return content


def system_structure(wiring: Wiring) -> bytes:
    """Return the SystemStructure.ssd of a system."""
    root = etree.Element(_tag("ssd:SystemStructureDescription"), nsmap=NAMESPACES, version="1.0", name=wiring.name)
    if wiring.description:
        root.set("description", wiring.description)
    system = _child(root, "ssd:System", name=wiring.name)
    elements = _child(system, "ssd:Elements")
    for element in wiring.elements:
        _component(elements, element, wiring)
    connections = _child(system, "ssd:Connections") if wiring.links else system  # the schema wants no empty list
    by_name = {element.name: element for element in wiring.elements}
    for link in wiring.links:
        source, target, factor = link
        connection = _child(
            connections,
            "ssd:Connection",
            startElement=source.element,
            startConnector=source.variable,
            endElement=target.element,
            endConnector=target.variable,
        )
        if unit_factor(link, by_name) != 1:
            # The factor has the unit in it already; other readers convert none, so they get it right too.
            connection.set("suppressUnitConversion", "true")
        if factor != 1:
            _child(connection, "ssc:LinearTransformation", factor=repr(factor))
    step = repr(wiring.step_size)
    oms = _annotation(system, "org.openmodelica")
    information = _child(_child(oms, "oms:Annotations"), "oms:SimulationInformation")
    _child(information, "oms:FixedStepMaster", description="oms-ma", stepSize=step)
    _enumerations(root, wiring)
    units = defined_units({e.name: e.description for e in wiring.elements})
    _units(root, [unit for name, unit in units.items() if name in _used_units(wiring)])
    experiment = _child(
        root, "ssd:DefaultExperiment", startTime=repr(wiring.start_time), stopTime=repr(wiring.stop_time)
    )
    osp = _annotation(experiment, "com.opensimulationplatform")
    _child(_child(osp, "osp:Algorithm"), "osp:FixedStepAlgorithm", baseStepSize=step)
    return _to_bytes(root)


def parameter_set(element: Element) -> bytes:
    """Return the .ssv with the start values of an element."""
    return _parameter_set({name: (element, name, value) for name, value in element.start_values.items()})


def values_set(wiring: Wiring, values: Mapping[str, Value], name: str, description: str) -> bytes:
    """Return an .ssv with start values by ``element.variable``, which `parameter_set.read_values` reads."""
    found = {end: wiring.parted(end) for end in values}
    named = {end: (element, variable, values[end]) for end, (element, variable) in found.items() if element}
    return _parameter_set(named, name, description)


def _parameter_set(
    values: Mapping[str, tuple[Element, str, Value]], name: str = PARAMETER_SET, description: str = ""
) -> bytes:
    root = etree.Element(_tag("ssv:ParameterSet"), nsmap=NAMESPACES, version="1.0", name=name)
    if description:
        root.set("description", description)
    parameters = _child(root, "ssv:Parameters")
    used: dict[str, Unit] = {}
    for end, (element, variable_name, value) in values.items():
        variable = element.variables[variable_name]
        typed = _child(
            _child(parameters, "ssv:Parameter", name=end), f"ssv:{variable.type}", value=_literal(value, variable)
        )
        if variable.unit:
            typed.set("unit", variable.unit)
            used |= {unit.name: unit for unit in element.description.unitDefinitions if unit.name == variable.unit}
    _units(root, list(used.values()), prefix="ssv")
    return _to_bytes(root)


def _component(parent: etree._Element, element: Element, wiring: Wiring) -> None:
    component = _child(
        parent,
        "ssd:Component",
        name=element.name,
        type="application/x-fmu-sharedlibrary",
        source=f"resources/{element.name}.fmu",
    )
    connectors = _child(component, "ssd:Connectors")
    for variable in _connected(element, wiring):
        connector = _child(connectors, "ssd:Connector", name=variable.name, kind=variable.causality)
        typed = _child(connector, f"ssc:{variable.type}")
        if enumeration := _enumeration(variable):
            typed.set("name", enumeration.name)
        if variable.unit:
            typed.set("unit", variable.unit)
    if element.start_values:
        bindings = _child(component, "ssd:ParameterBindings")
        _child(
            bindings,
            "ssd:ParameterBinding",
            type="application/x-ssp-parameter-set",
            source=f"resources/{element.name}.ssv",
        )


def _connected(element: Element, wiring: Wiring) -> list[ModelVariable]:
    """Return the outputs and the connected inputs: a reader may give an unconnected input a stray signal."""
    targets = {link.target.variable for link in wiring.links if link.target.element == element.name}
    return [
        variable
        for variable in element.description.modelVariables
        if variable.causality == "output" or variable.name in targets
    ]


def _used_units(wiring: Wiring) -> set[str]:
    return {variable.unit for element in wiring.elements for variable in _connected(element, wiring) if variable.unit}


def _units(parent: etree._Element, units: list[Unit], prefix: str = "ssd") -> None:
    if not units:
        return
    listed = _child(parent, f"{prefix}:Units")
    for unit in units:
        base = _child(_child(listed, "ssc:Unit", name=unit.name), "ssc:BaseUnit")
        neutral = {**dict.fromkeys(BASE_UNITS, 0), "factor": 1.0, "offset": 0.0}
        for name, value in neutral.items():
            if getattr(unit.baseUnit, name) != value:
                base.set(name, str(getattr(unit.baseUnit, name)))


def _enumeration(variable: ModelVariable) -> SimpleType | None:
    return variable.declaredType if variable.type == "Enumeration" else None


def _enumerations(root: etree._Element, wiring: Wiring) -> None:
    connected = [_enumeration(variable) for element in wiring.elements for variable in _connected(element, wiring)]
    types = {declared.name: declared for declared in connected if declared}
    listed = _child(root, "ssd:Enumerations") if types else root  # the schema wants no empty list
    for name, declared in types.items():
        enumeration = _child(listed, "ssc:Enumeration", name=name)
        for item in declared.items:
            _child(enumeration, "ssc:Item", name=item.name, value=str(item.value))


def _literal(value: Value, variable: ModelVariable) -> str:
    """Return a value as a parameter set has it, which calls the items of an enumeration by name."""
    names = [name for name, number in items_of(variable).items() if number == value]
    return names[0] if names else literal(value, variable.type)


def _annotation(parent: etree._Element, type_: str) -> etree._Element:
    return _child(_child(parent, "ssd:Annotations"), "ssc:Annotation", type=type_)


def _child(parent: etree._Element, tag: str, **attributes: str) -> etree._Element:
    return etree.SubElement(parent, _tag(tag), attributes)


def _tag(name: str) -> str:
    prefix, local = name.split(":")
    return f"{{{NAMESPACES[prefix]}}}{local}"


def _to_bytes(root: etree._Element) -> bytes:
    return bytes(etree.tostring(root, encoding="UTF-8", xml_declaration=True, pretty_print=True))
