"""The XML of SSP 1.0: its namespaces, and reading that passes nothing over."""

from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

from lxml import etree

from .values import TYPES
from .wiring import WiringError

NAMESPACES = {
    "ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
    "ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues",
    "osp": "http://opensimulationplatform.com/SSP/OSPAnnotations",
    "oms": "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd",
}
STANDARD = {prefix: NAMESPACES[prefix] for prefix in ("ssd", "ssc", "ssv")}
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
    "ssc": {"Unit", "BaseUnit", "LinearTransformation", *TYPES},
    "ssv": {"ParameterSet", "Parameters", "Parameter", "Units", *TYPES},
}
_IGNORED = {
    "Annotations",
    "ElementGeometry",
    "ConnectorGeometry",
    "ConnectionGeometry",
    "SystemGeometry",
    "GraphicalElements",
}
# Attributes that change the meaning, with the values that this reader honours.
_HONOURED = {
    ("LinearTransformation", "offset"): ("0", "0.0"),
    ("ParameterBinding", "sourceBase"): ("SSD",),
    ("ParameterBinding", "type"): ("application/x-ssp-parameter-set",),
    ("Component", "type"): ("application/x-fmu-sharedlibrary",),
    ("Component", "implementation"): ("any", "CoSimulation"),
}


def parse_strictly(path: Path, where: str, schema: str) -> etree._Element:
    """Return the root element of a file, which problems call `where`.

    Raises
    ------
    WiringError : it is missing, not well-formed, not valid by the standard's `schema` as FMPy ships it, or holds what
        this project does not do.
    """
    try:
        document = etree.parse(path).getroot()
    except OSError:
        raise WiringError(where, ["There is no such file."]) from None
    except etree.XMLSyntaxError as error:
        raise WiringError(where, [f"This is not well-formed XML: {error}."]) from None
    validator = etree.XMLSchema(file=str(files("fmpy.ssp") / "schema" / schema))
    if not validator.validate(document):
        raise WiringError(where, [f"Line {entry.line}: {entry.message}" for entry in validator.error_log])
    if unsupported := [f"Line {line}: {what} is not supported." for line, what in _unsupported(document)]:
        raise WiringError(where, unsupported)
    return document


def _unsupported(root: etree._Element) -> Iterator[tuple[int, str]]:
    """Yield line and name of what means something that this reader does not do."""
    prefixes = {namespace: prefix for prefix, namespace in STANDARD.items()}
    pending = [root]
    while pending:
        node = pending.pop()
        if not isinstance(node.tag, str):
            continue
        name = etree.QName(node)
        prefix = prefixes.get(name.namespace)
        if name.localname in _IGNORED:
            continue
        nested = name.localname == "System" and node.getparent() is not root
        if prefix is None or name.localname not in _READ[prefix] or nested:
            yield node.sourceline, f"a nested {name.localname}" if nested else name.localname
            continue
        for (element, attribute), honoured in _HONOURED.items():
            if name.localname == element and node.get(attribute, honoured[0]) not in honoured:
                yield node.sourceline, f'{attribute}="{node.get(attribute)}" of a {element}'
        pending.extend(reversed(node))
