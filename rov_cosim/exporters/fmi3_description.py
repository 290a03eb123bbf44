"""What FMI 3.0 asks an FMU to tell of a component: variables as arrays, terminals, and how the sources are built.

A value reference is that of the first element in FMI 2.0; the elements follow it.
"""

from collections.abc import Iterable, Mapping
from io import BytesIO

import numpy as np
from fmpy.model_description import Dimension, ModelDescription, ModelVariable, Unknown, write_model_description
from lxml import etree
from numpy.typing import NDArray

from ..components.interface import Component, Sampled, Signal
from .model_description import about, display_unit, identified, kind, literal
from .terminals import TAKEN_FOR, TERMINALS

VERSION = "3.0"
TYPES = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}
"""The types of FMI 3.0 by those of the interface."""

_NOT_WRITTEN = ("min", "max", "displayUnit")
"""Attributes of variables that FMPy reads but does not write."""

_EXTENT = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}


def describe(component: Component) -> ModelDescription:
    """Return FMPy's description object of a component; its instantiation token is a hash of all the rest."""
    variables: list[ModelVariable] = []
    known: dict[str, ModelVariable] = {}
    outputs: list[ModelVariable] = []
    reference = 0
    for causality in ("input", "output", "parameter"):
        signals: tuple[Signal, ...] = getattr(component, f"{causality}s")
        for signal in signals:
            variable = array(signal, causality, reference, isinstance(component, Sampled))
            variables.append(variable)
            reference += signal.size
            if causality == "output":
                outputs.append(variable)
            else:
                known[signal.key] = variable
    initial_unknowns = []
    for signal, output in zip(component.outputs, outputs, strict=True):
        from_ = [known[key] for key in signal.initially_from]
        kinds = ["dependent"] * len(from_)
        initial_unknowns.append(Unknown(variable=output, dependencies=from_, dependenciesKind=kinds))
    description = ModelDescription(
        fmiVersion=VERSION,
        modelVariables=[*variables, time(reference)],
        # doStep holds its inputs from its start, so no output follows an input of the same instant.
        outputs=[Unknown(variable=output, dependencies=[], dependenciesKind=[]) for output in outputs],
        initialUnknowns=initial_unknowns,
        **about(component, providesDirectionalDerivative=True, providesAdjointDerivatives=True),
    )
    return identified(description, to_xml)


def to_xml(description: ModelDescription) -> bytes:
    """Return the modelDescription.xml of a description, with what FMPy does not write."""
    xml = BytesIO()
    write_model_description(description, xml)
    root = etree.fromstring(xml.getvalue(), etree.XMLParser(remove_blank_text=True))
    capabilities = root.find("CoSimulation")
    if given := capabilities.attrib.pop("providesDirectionalDerivative", None):  # FMPy calls it as FMI 2.0 does
        capabilities.set("providesDirectionalDerivatives", given)
    for variable, element in zip(description.modelVariables, root.find("ModelVariables"), strict=True):
        for attribute in _NOT_WRITTEN:
            if (value := getattr(variable, attribute)) is not None:
                element.set(attribute, value)
    return _written(root)


def terminals(signals: Iterable[Signal], element: str = "") -> dict[str, dict[str, str]]:
    """Return the terminals that inputs and outputs make, of a component or of an element of a system.

    Each is the names of its variables by the key of `TERMINALS` under which it has them.
    """
    prefix = f"{element}." if element else ""
    ports = {TAKEN_FOR.get(signal.key, signal.key): prefix + signal.name for signal in signals}
    made = {name: keys for name, keys in TERMINALS.items() if ports.keys() >= set(keys)}
    return {prefix + name: {key: ports[key] for key in keys} for name, keys in made.items()}


def terminals_and_icons(made: Mapping[str, Mapping[str, str]]) -> bytes:
    """Return the terminalsAndIcons.xml with some `terminals`."""
    root = etree.Element("fmiTerminalsAndIcons", fmiVersion=VERSION)
    picture = etree.SubElement(root, "GraphicalRepresentation")
    etree.SubElement(picture, "CoordinateSystem", **_EXTENT, suggestedScalingFactorTo_mm="0.1")
    etree.SubElement(picture, "Icon", **_EXTENT)
    if made:  # the schema has no empty list
        listed = etree.SubElement(root, "Terminals")
        for name, members in made.items():
            terminal = etree.SubElement(listed, "Terminal", name=name, matchingRule="plug")
            for key, variable in members.items():
                etree.SubElement(
                    terminal, "TerminalMemberVariable", variableName=variable, memberName=key, variableKind="signal"
                )
    return _written(root)


def build(identifier: str, source_files: Iterable[str]) -> bytes:
    """Return the buildDescription.xml of a binary that is made of some source files."""
    root = etree.Element("fmiBuildDescription", fmiVersion=VERSION)
    configuration = etree.SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    listed = etree.SubElement(configuration, "SourceFileSet", language="C99")
    for name in source_files:
        etree.SubElement(listed, "SourceFile", name=name)
    etree.SubElement(configuration, "Library", name="m", external="true", description="The C library's mathematics")
    return _written(root)


def time(reference: int) -> ModelVariable:
    """Return the independent variable."""
    return ModelVariable(
        name="time",
        valueReference=reference,
        type="Float64",
        description="Time of the run",
        causality="independent",
        variability="continuous",
        unit="s",
    )


def array(signal: Signal, causality: str, reference: int, sampled: bool) -> ModelVariable:
    """Return the variable of a signal, of a sampled component or another; one without axes is a scalar."""
    units = set(signal.units)
    unit = units.pop() if len(units) == 1 else ""
    limits = signal.type != "Boolean"
    return ModelVariable(
        name=signal.name,
        valueReference=reference,
        type=TYPES[signal.type],
        description=signal.description + _elements(signal, with_units=len(set(signal.units)) > 1),
        **kind(signal, causality, sampled),
        dimensions=[Dimension(start=str(n), valueReference=None) for n in signal.shape],
        unit=unit or None,
        displayUnit=display_unit(unit),
        min=_common(signal.elements(signal.minimum), signal) if limits else None,
        max=_common(signal.elements(signal.maximum), signal) if limits else None,
        start=None
        if causality == "output"
        else " ".join(literal(value, signal.type) for value in signal.elements(signal.start)),
    )


def _elements(signal: Signal, with_units: bool) -> str:
    """Return the elements in words, for an array knows neither their names nor that their units differ."""
    named = [f"1 to {axis[-1]}" if axis[0] == "1" else ", ".join(axis) for axis in signal.axes]
    if with_units:
        units = signal.units[-len(signal.axes[-1]) :]
        named[-1] = ", ".join(f"{label} in {unit}" for label, unit in zip(signal.axes[-1], units, strict=True))
    return f" ({' by '.join(named)})" if named else ""


def _common(values: NDArray[np.float64], signal: Signal) -> str | None:
    """Return the limit that all elements have; where they differ, the component alone checks it."""
    return literal(values[0], signal.type) if np.isfinite(values[0]) and np.all(values == values[0]) else None


def _written(root: etree._Element) -> bytes:
    return bytes(etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True))
