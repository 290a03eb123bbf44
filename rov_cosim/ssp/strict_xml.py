"""The XML of SSP 1.0: its namespaces, and reading that passes nothing over."""

import re
from collections.abc import Callable, Iterator
from functools import cache
from importlib.resources import files
from pathlib import Path

from lxml import etree

from .wiring import WiringError

NAMESPACES = {
    "ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
    "ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues",
    "osp": "http://opensimulationplatform.com/SSP/OSPAnnotations",
    "oms": "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd",
}
"""Those that are written, in this order."""
STANDARD = {
    **{prefix: NAMESPACES[prefix] for prefix in ("ssd", "ssc", "ssv")},
    "ssm": "http://ssp-standard.org/SSP1/SystemStructureParameterMapping",
    "ssb": "http://ssp-standard.org/SSP1/SystemStructureSignalDictionary",
}
_ROOTS = {
    "ssd": "SystemStructureDescription",
    "ssv": "ParameterSet",
    "ssm": "ParameterMapping",
    "ssb": "SignalDictionary",
}
_SCHEMAS = {
    "ssd": "SystemStructureDescription.xsd",
    "ssv": "SystemStructureParameterValues.xsd",
    "ssm": "SystemStructureParameterMapping.xsd",
    "ssb": "SystemStructureSignalDictionary.xsd",
}
# Attributes that change the meaning, with the values that this reader honours.
_HONOURED = {
    ("Connection/LinearTransformation", "offset"): ("0", "0.0", "0.000000"),
    ("ParameterBinding", "sourceBase"): ("SSD",),
    ("ParameterMapping", "sourceBase"): ("SSD",),
    ("ParameterBinding", "type"): ("application/x-ssp-parameter-set",),
    ("ParameterMapping", "type"): ("application/x-ssp-parameter-mapping",),
    ("SignalDictionary", "type"): ("application/x-ssp-signal-dictionary",),
    ("Component", "type"): ("application/x-fmu-sharedlibrary",),
    ("Component", "implementation"): ("any", "CoSimulation"),
}
_UNDONE = {
    "Connection/BooleanMappingTransformation",
    "Connection/IntegerMappingTransformation",
    "Connection/EnumerationMappingTransformation",
    "Parameter/Binary",
    "Connector/Binary",
}


def parse_strictly(
    path: Path, where: str, kind: str, warn: Callable[[str], None] = lambda message: None
) -> etree._Element:
    """Return the root element of a file, without comments, which problems call `where`.

    `kind` is one of ssd, ssv, ssm, ssb. A prefix of SSP or its annotations that is not declared is told to `warn`.

    Raises
    ------
    WiringError : it is missing, not well-formed, not valid by the standard's schema as FMPy ships it, or holds what
        this project does not do.
    """
    try:
        content = path.read_bytes()
    except OSError:
        raise WiringError(where, ["There is no such file."]) from None
    try:
        document = etree.fromstring(content, _parser())
    except etree.XMLSyntaxError as error:
        document = _with_prefixes(content, where, warn)
        if document is None:
            raise WiringError(where, [f"This is not well-formed XML: {_said(error)}."]) from None
    if document.getroottree().docinfo.internalDTD is not None:
        raise WiringError(where, ["This has a DOCTYPE, which SSP does not know: remove it."])
    check(document, where, kind, warn)
    return document


def check(node: etree._Element, where: str, kind: str, warn: Callable[[str], None]) -> None:
    """Raise WiringError if an element is not a valid one of a kind, or holds what this project does not do.

    Parameter sets and mappings of SSP 2.0 that are those of 1.0 but for the number are told to `warn`.
    """
    name, version = etree.QName(node), node.get("version", "")
    if version.startswith("2."):
        node.set("version", "1.0")
        if kind == "ssd" or not _schema(kind).validate(node):
            raise WiringError(where, [f"This is SSP {version}; expected SSP 1.0, which tools write on request."])
        warn(f"{where}: This is SSP {version}, and is read as SSP 1.0.")
    if (name.namespace, name.localname) != (STANDARD[kind], _ROOTS[kind]):
        raise WiringError(where, [f"This is {name.localname} of {name.namespace}; expected {_ROOTS[kind]} of SSP 1.0."])
    schema = _schema(kind)
    if not schema.validate(node):
        raise WiringError(where, [f"Line {entry.line}: {_short(entry.message)}" for entry in schema.error_log])
    if unsupported := [f"Line {line}: {what} is not supported." for line, what in _unsupported(node)]:
        raise WiringError(where, unsupported)


def _unsupported(root: etree._Element) -> Iterator[tuple[int, str]]:
    """Yield line and name of what means something that this reader does not do."""
    pending = [root]
    while pending:
        node = pending.pop()
        name = etree.QName(node).localname
        if name == "Annotations":
            continue
        parent = node.getparent()
        path = name if parent is None else f"{etree.QName(parent).localname}/{name}"
        if path in _UNDONE:
            yield node.sourceline, f"a {name} of a {path.split('/')[0]}"
        for (element, attribute), honoured in _HONOURED.items():
            if element in (name, path) and node.get(attribute, honoured[0]) not in honoured:
                yield node.sourceline, f'{attribute}="{node.get(attribute)}" of a {name}'
        pending.extend(reversed(node))


def _with_prefixes(content: bytes, where: str, warn: Callable[[str], None]) -> etree._Element | None:
    """Return a document that is well-formed but for prefixes that it does not declare; None if more is wrong."""
    parser = _parser(recover=True)
    try:
        document = etree.fromstring(content, parser)
    except etree.XMLSyntaxError:  # it is empty
        return None
    if document is None or any(fault.type_name != "NS_ERR_UNDEFINED_NAMESPACE" for fault in parser.error_log):
        return None
    known, lacking = {**NAMESPACES, **STANDARD}, set()
    for node in document.iter(etree.Element):
        prefix, colon, name = node.tag.partition(":")
        if colon and not node.tag.startswith("{"):
            if prefix not in known:
                return None
            node.tag = f"{{{known[prefix]}}}{name}"
            lacking.add(prefix)
    for prefix in sorted(lacking):
        warn(f"{where}: The prefix {prefix} is not declared: taken as xmlns:{prefix}={known[prefix]!r}.")
    return document


def _parser(recover: bool = False) -> etree.XMLParser:
    return etree.XMLParser(
        remove_comments=True, remove_pis=True, resolve_entities=False, no_network=True, recover=recover
    )


@cache
def _schema(kind: str) -> etree.XMLSchema:
    return etree.XMLSchema(file=str(files("fmpy.ssp") / "schema" / _SCHEMAS[kind]))


def _said(error: Exception) -> str:
    """Return what a parser says, without the name of a file, which is none of the user's."""
    return re.sub(r" \((<string>|[^()]*), line \d+\)$", "", " ".join(str(error).split()))


def _short(message: str) -> str:
    """Return a message of the schema's without namespaces."""
    return re.sub(r"\{http[^}]*\}", "", message)
