"""The FMI 2.0 model description of a component, from its declared interface."""

from collections.abc import Callable, Sequence
from hashlib import sha256
from importlib.metadata import version
from io import BytesIO
from typing import Any
from uuid import UUID

import numpy as np
from fmpy.model_description import (
    BaseUnit,
    Category,
    CoSimulation,
    DefaultExperiment,
    DisplayUnit,
    ModelDescription,
    ModelVariable,
    Unit,
    Unknown,
    write_model_description,
)
from lxml import etree

from ..components.interface import SAMPLE_TIME, Component, Sampled, Signal
from .archive import RELEASED

STOP_TIME = 60.0
"""End in s of the default experiment."""

GENERATION_TOOL = f"rov-cosim {version('rov-cosim')}"
"""By what an FMU of this project is known."""

# In the order of the status codes that they are for.
LOG_CATEGORIES = {
    "logStatusWarning": "Something that the user should know, for example a detached arm",
    "logStatusDiscard": "A question without an answer: a derivative that is not finite, a status that there is not",
    "logStatusError": "A call that failed, and why",
}

GENERATED = "{:04d}-{:02d}-{:02d}T00:00:00Z".format(*RELEASED)
"""When every FMU was made, by its own word."""

_DEGREE = DisplayUnit(name="deg", factor=180 / np.pi)
_DEGREE_PER_SECOND = DisplayUnit(name="deg/s", factor=180 / np.pi)
UNITS = {
    unit.name: unit
    for unit in (
        Unit("m", BaseUnit(m=1)),
        Unit("s", BaseUnit(s=1)),
        Unit("kg", BaseUnit(kg=1)),
        Unit("rad", BaseUnit(rad=1), [_DEGREE]),
        Unit("m/s", BaseUnit(m=1, s=-1)),
        Unit("rad/s", BaseUnit(rad=1, s=-1), [_DEGREE_PER_SECOND]),
        Unit("1/s", BaseUnit(s=-1)),
        Unit("m/s2", BaseUnit(m=1, s=-2)),
        Unit("N", BaseUnit(kg=1, m=1, s=-2)),
        Unit("N.m", BaseUnit(kg=1, m=2, s=-2)),
        Unit("N/m", BaseUnit(kg=1, s=-2)),
        Unit("N.m/rad", BaseUnit(kg=1, m=2, s=-2, rad=-1)),
        Unit("N/rad", BaseUnit(kg=1, m=1, s=-2, rad=-1)),
        Unit("N.s/rad", BaseUnit(kg=1, m=1, s=-1, rad=-1)),
        Unit("N/(m.s)", BaseUnit(kg=1, s=-3)),
        Unit("N.m/(rad.s)", BaseUnit(kg=1, m=2, s=-3, rad=-1)),
        Unit("N.s/m", BaseUnit(kg=1, s=-1)),
        Unit("N.m.s/rad", BaseUnit(kg=1, m=2, s=-1, rad=-1)),
        Unit("N.s2/m2", BaseUnit(kg=1, m=-1)),
        Unit("N.m.s2/rad2", BaseUnit(kg=1, m=2, rad=-2)),
        Unit("kg.m2", BaseUnit(kg=1, m=2)),
    )
}


def describe(component: Component, **capabilities: bool) -> ModelDescription:
    """Return FMPy's description object of a component; its GUID is a hash of all the rest.

    capabilities are those flags of FMPy's CoSimulation that an export has beyond the ones that all exports share.
    """
    groups = [("input", component.inputs), ("output", component.outputs), ("parameter", component.parameters)]
    variables: list[ModelVariable] = []
    of_signal: dict[str, list[ModelVariable]] = {}
    for causality, signals in groups:
        for signal in signals:
            scalars = _scalars(signal, causality, len(variables), isinstance(component, Sampled))
            variables += scalars
            of_signal[f"{causality} {signal.key}"] = scalars
    outputs, initial_unknowns = [], []
    for signal in component.outputs:
        known = [
            variable
            for key in signal.initially_from
            for causality in ("input", "parameter")
            for variable in of_signal.get(f"{causality} {key}", ())
        ]
        for variable in of_signal[f"output {signal.key}"]:
            # doStep holds its inputs from its start, so no output follows an input of the same instant.
            outputs.append(Unknown(variable=variable, dependencies=[], dependenciesKind=[]))
            initial_unknowns.append(
                Unknown(variable=variable, dependencies=known, dependenciesKind=["dependent"] * len(known))
            )
    description = ModelDescription(
        fmiVersion="2.0",
        modelVariables=variables,
        outputs=outputs,
        initialUnknowns=initial_unknowns,
        **about(component, canNotUseMemoryManagementFunctions=True, **capabilities),
    )
    return identified(description, to_xml)


def about(component: Component, **capabilities: bool) -> dict[str, Any]:
    """Return what every version of FMI tells of a component beside its variables, as arguments of ModelDescription.

    capabilities are flags of FMPy's CoSimulation beyond the ones that all have.
    """
    declared = component.inputs + component.outputs + component.parameters
    return {
        "modelName": component.name,
        "description": component.description,
        "author": "the rov-cosim authors",
        "version": version("rov-cosim"),
        "license": "MIT",
        "copyright": "Copyright (c) 2026 the rov-cosim authors",
        "generationTool": GENERATION_TOOL,
        "generationDateAndTime": GENERATED,
        "variableNamingConvention": "structured",
        "logCategories": [Category(name, text) for name, text in LOG_CATEGORIES.items()],
        "defaultExperiment": DefaultExperiment(startTime=0.0, stopTime=STOP_TIME, stepSize=SAMPLE_TIME),
        "coSimulation": CoSimulation(
            modelIdentifier=component.name,
            canHandleVariableCommunicationStepSize=True,
            canGetAndSetFMUstate=True,
            canSerializeFMUstate=True,
            **capabilities,
        ),
        "unitDefinitions": [UNITS[name] for name in dict.fromkeys(u for s in declared for u in s.units) if name],
    }


def identified(description: ModelDescription, write: Callable[[ModelDescription], bytes]) -> ModelDescription:
    """Return the description with a GUID that is a hash of all the rest, as `write` writes it."""
    description.guid = ""
    description.guid = f"{{{UUID(bytes=sha256(write(description)).digest()[:16])}}}"
    return description


def to_xml(description: ModelDescription, source_files: Sequence[str] = ()) -> bytes:
    """Return the modelDescription.xml of a description, which names the source files, if any."""
    xml = BytesIO()
    write_model_description(description, xml)
    if not source_files:
        return xml.getvalue()
    root = etree.fromstring(xml.getvalue(), etree.XMLParser(remove_blank_text=True))
    listed = etree.SubElement(root.find("CoSimulation"), "SourceFiles")  # FMPy reads but does not write it
    for name in source_files:
        etree.SubElement(listed, "File", name=name)
    return bytes(etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True))


def literal(value: float | str, type: str) -> str:
    """Return a value in the form that XML wants for the FMI type; Reals keep all their digits."""
    if type == "String":
        return str(value)
    if type == "Boolean":
        return "true" if value else "false"
    return repr(float(value)) if type == "Real" else str(int(value))


def _scalars(signal: Signal, causality: str, first: int, sampled: bool) -> list[ModelVariable]:
    """Return one variable for each element of a signal, with value references counting from `first`."""
    variables = []
    elements = zip(
        signal.names,
        signal.units,
        signal.elements(signal.start),
        signal.elements(signal.minimum),
        signal.elements(signal.maximum),
        strict=True,
    )
    for i, (name, unit, start, low, high) in enumerate(elements):
        limits = signal.type != "Boolean"
        variables.append(
            ModelVariable(
                name=name,
                valueReference=first + i,
                type=signal.type,
                description=signal.description + (f" ({_label(signal, i)})" if signal.axes else ""),
                **kind(signal, causality, sampled),
                canHandleMultipleSetPerTimeInstant=False,
                unit=unit or None,
                displayUnit=display_unit(unit),
                min=literal(low, signal.type) if limits and np.isfinite(low) else None,
                max=literal(high, signal.type) if limits and np.isfinite(high) else None,
                start=None if causality == "output" else literal(start, signal.type),
            )
        )
    return variables


def kind(signal: Signal, causality: str, sampled: bool) -> dict[str, str | None]:
    """Return causality, variability and initial of the variables of a signal, of a sampled component or another."""
    discrete = signal.type != "Real" or (sampled and causality == "output")
    variability = "discrete" if discrete else "continuous"
    if causality == "parameter":
        variability = "tunable" if signal.tunable else "fixed"
    initial = {"parameter": "exact", "output": "calculated"}.get(causality)
    return {"causality": causality, "variability": variability, "initial": initial}


def display_unit(unit: str) -> str | None:
    """Return the name of the unit in which a unit of `UNITS` is shown, if that is another."""
    return UNITS[unit].displayUnits[0].name if unit and UNITS[unit].displayUnits else None


def _label(signal: Signal, i: int) -> str:
    position = np.unravel_index(i, signal.shape)
    return ", ".join(axis[k] for axis, k in zip(signal.axes, position, strict=True))
