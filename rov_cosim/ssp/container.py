"""The FMU face of an SSP archive: FMPy's container FMU, which `fmpy simulate` runs.

The container is a master inside an FMU. It steps Jacobi, and its one pass over the connections at initialization goes
in list order, so they are sorted to follow the signals.
"""

import json
from copy import copy
from graphlib import CycleError, TopologicalSorter
from hashlib import sha256
from importlib.resources import files
from itertools import groupby
from uuid import UUID

from fmpy.model_description import (
    CoSimulation,
    DefaultExperiment,
    ModelDescription,
    ModelVariable,
    Unknown,
)

from ..exporters import archive
from ..exporters.model_description import literal, to_xml
from .units import defined_units
from .values import Value
from .wiring import End, Link, Wiring, WiringError

CONFIGURATION_VERSION = "0.1.0"

_TYPES = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}
_BINARIES = {
    "x86_64-linux/container_fmu.so": "linux64",
    "x86_64-windows/container_fmu.dll": "win64",
    "x86_64-darwin/container_fmu.dylib": "darwin64",
}


def entries(wiring: Wiring) -> dict[str, bytes]:
    """Return what makes the archive of a system an FMU, name to content."""
    exposed = _exposed(wiring)
    description = _description(wiring, exposed)
    content = {
        "modelDescription.xml": to_xml(description),
        "resources/container.json": json.dumps(_configuration(wiring, exposed, description.guid), indent=1).encode(),
    }
    binaries = files("fmpy.container_fmu") / "binaries"
    for source, platform in _BINARIES.items():
        content[f"binaries/{platform}/{source.rsplit('/', 1)[1]}"] = (binaries / source).read_bytes()
    for element in wiring.elements:
        for name, data in archive.read(element.fmu).items():
            content[f"resources/{element.name}/{name}"] = data
    return content


def _exposed(wiring: Wiring) -> dict[End, tuple[ModelVariable, Value | None]]:
    """Return the variables that the container shows, each with its start value: all but the connected inputs."""
    connected = {link.target for link in wiring.links}
    shown: dict[End, tuple[ModelVariable, Value | None]] = {}
    for element in wiring.elements:
        for variable in element.description.modelVariables:
            end = End(element.name, variable.name)
            if variable.type not in _TYPES or end in connected:
                continue
            if variable.causality == "output":
                shown[end] = (variable, None)
            elif variable.causality in ("parameter", "input") and element.has_value(variable.name):
                shown[end] = (variable, element.value(variable.name))
    return shown


def _description(wiring: Wiring, exposed: dict[End, tuple[ModelVariable, Value | None]]) -> ModelDescription:
    variables = []
    for reference, (end, (declared, start)) in enumerate(exposed.items(), start=1):
        variable = copy(declared)
        variable.name, variable.valueReference = str(end), reference
        variable.canHandleMultipleSetPerTimeInstant = False
        variable.start = None if start is None else literal(start, declared.type)
        # What the standard takes where nothing is said: an FMU's own word may not fit, or names what is not here.
        variable.initial = variable.declaredType = variable.derivative = None
        variable.reinit = False
        variables.append(variable)
    outputs = [variable for variable in variables if variable.causality == "output"]
    first = wiring.elements[0].description
    units = defined_units({e.name: e.description for e in wiring.elements})
    description = ModelDescription(
        fmiVersion="2.0",
        modelName=wiring.name,
        description=wiring.description or None,
        generationTool=first.generationTool,
        generationDateAndTime=first.generationDateAndTime,
        variableNamingConvention="structured",
        defaultExperiment=DefaultExperiment(wiring.start_time, wiring.stop_time, stepSize=wiring.step_size),
        coSimulation=CoSimulation("container_fmu", canHandleVariableCommunicationStepSize=True),
        unitDefinitions=list(units.values()),
        modelVariables=variables,
        outputs=[Unknown(variable=variable, dependencies=[], dependenciesKind=[]) for variable in outputs],
        initialUnknowns=[Unknown(variable=variable) for variable in outputs],
    )
    description.guid = ""
    description.guid = f"{{{UUID(bytes=sha256(to_xml(description)).digest()[:16])}}}"
    return description


def _configuration(
    wiring: Wiring, exposed: dict[End, tuple[ModelVariable, Value | None]], guid: str
) -> dict[str, object]:
    """Return the content of container.json."""
    index = {element.name: i for i, element in enumerate(wiring.elements)}
    variables = []
    for end, (variable, start) in exposed.items():
        entry: dict[str, object] = {
            "variableType": _TYPES[variable.type],
            "mappings": [{"component": index[end.element], "valueReference": variable.valueReference}],
        }
        if start is not None:
            entry["start"] = [literal(start, variable.type)]
        variables.append(entry)
    return {
        "containerVersion": CONFIGURATION_VERSION,
        "instantiationToken": guid,
        "fixedStepSize": wiring.step_size,
        # The binary aborts the host process in a parallel step.
        "parallelDoStep": False,
        "variables": variables,
        "components": [
            {
                "fmiMajorVersion": "2",
                "name": element.name,
                "modelIdentifier": element.description.coSimulation.modelIdentifier,
                "path": element.name,
                "instantiationToken": element.description.guid,
            }
            for element in wiring.elements
        ],
        "connections": _connections(wiring, index),
    }


def _connections(wiring: Wiring, index: dict[str, int]) -> list[dict[str, object]]:
    variables = {End(e.name, v.name): v for e in wiring.elements for v in e.description.modelVariables}

    def bundle(link: Link) -> tuple[int, int, str]:
        return index[link.source.element], index[link.target.element], _TYPES[variables[link.source].type]

    bundled = []
    for (source, target, type_), group in groupby(sources_first(wiring), key=bundle):
        links = list(group)
        bundled.append(
            {
                "variableType": type_,
                "srcComponent": source,
                "dstComponent": target,
                "srcValueReferences": [variables[link.source].valueReference for link in links],
                "dstValueReferences": [variables[link.target].valueReference for link in links],
                "size": len(links),
            }
        )
    return bundled


def sources_first(wiring: Wiring) -> list[Link]:
    """Return the links in an order in which each source's initial value is known when it is read.

    Raises
    ------
    WiringError : initial values depend on each other in a loop.
    """
    into = {link.target: link for link in wiring.links}
    graph: dict[Link, list[Link]] = {link: [] for link in wiring.links}
    for element in wiring.elements:
        inputs = [v.name for v in element.description.modelVariables if v.causality == "input"]
        for unknown in element.description.initialUnknowns:
            # Without declared dependencies an unknown may depend on every input.
            known = inputs if unknown.dependencies is None else [v.name for v in unknown.dependencies]
            before = [into[end] for name in known if (end := End(element.name, name)) in into]
            for link in wiring.links:
                if link.source == End(element.name, unknown.variable.name):
                    graph[link] += before
    try:
        return list(TopologicalSorter(graph).static_order())
    except CycleError as error:
        loop = " -> ".join(str(link.source) for link in error.args[1])
        raise WiringError(wiring.name, [f"The initial values depend on each other in a loop: {loop}."]) from None
