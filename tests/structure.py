"""SSP archives written by hand: what a SystemStructure.ssd says is given as XML."""

from rov_cosim.exporters import archive
from rov_cosim.ssp.strict_xml import STANDARD

EXPERIMENT = '<ssd:DefaultExperiment startTime="0" stopTime="0.3"/>'


def spaces():
    return " ".join(f'xmlns:{prefix}="{namespace}"' for prefix, namespace in STANDARD.items())


def ssd(system, after=EXPERIMENT, version="1.0"):
    """Return a SystemStructure.ssd; the content of its root system, and what follows that."""
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<ssd:SystemStructureDescription {spaces()} name="by_hand" '
        f'version="{version}"><ssd:System name="root">{system}</ssd:System>{after}</ssd:SystemStructureDescription>'
    ).encode()


def component(name, fmu, content="", attributes=""):
    return f'<ssd:Component name="{name}" source="resources/{fmu}.fmu" {attributes}>{content}</ssd:Component>'


def system(name, content):
    return f'<ssd:System name="{name}">{content}</ssd:System>'


def elements(*content):
    return f"<ssd:Elements>{''.join(content)}</ssd:Elements>"


def connectors(**kinds):
    """Return connectors by name: a kind, or kind and unit."""
    written = ""
    for name, kind in kinds.items():
        kind, _, unit = kind.partition(" ")
        written += f'<ssd:Connector name="{name}" kind="{kind}"><ssc:Real{unit and f" unit={unit!r}"}/></ssd:Connector>'
    return f"<ssd:Connectors>{written}</ssd:Connectors>"


def connections(*pairs):
    """Return connections of ``element.connector``, or ``.connector`` of the system; a third item is further XML."""
    written = ""
    for start, end, *rest in pairs:
        attributes, content = rest[0] if rest else ("", "")
        for which, (element, _, connector) in (("start", start.partition(".")), ("end", end.partition("."))):
            attributes += f' {which}Element="{element}"' if element else ""
            attributes += f' {which}Connector="{connector}"'
        written += f"<ssd:Connection {attributes}>{content}</ssd:Connection>"
    return f"<ssd:Connections>{written}</ssd:Connections>"


def parameter_set(units="", **values):
    """Return an ssv:ParameterSet; a value is its type, then its literal, then perhaps its unit."""
    written = ""
    for name, value in values.items():
        type_, literal, *unit = value
        attribute = f' unit="{unit[0]}"' if unit else ""
        written += f'<ssv:Parameter name="{name}"><ssv:{type_} value="{literal}"{attribute}/></ssv:Parameter>'
    return (
        f'<ssv:ParameterSet {spaces()} version="1.0" name="set"><ssv:Parameters>{written}</ssv:Parameters>{units}'
        "</ssv:ParameterSet>"
    )


def mapping(*entries):
    """Return an ssm:ParameterMapping of source, target, and perhaps attributes and a transformation."""
    written = ""
    for source, target, *rest in entries:
        attributes, content = (*rest, "", "")[:2]
        entry = f'<ssm:MappingEntry source="{source}" target="{target}" {attributes}>'
        written += f"{entry}{content}</ssm:MappingEntry>"
    return f'<ssm:ParameterMapping {spaces()} version="1.0">{written}</ssm:ParameterMapping>'


def bindings(*content):
    return f"<ssd:ParameterBindings>{''.join(content)}</ssd:ParameterBindings>"


def binding(values, mapped="", attributes=""):
    """Return a parameter binding of inline content."""
    mapped = mapped and f"<ssd:ParameterMapping>{mapped}</ssd:ParameterMapping>"
    inline = f"<ssd:ParameterValues>{values}</ssd:ParameterValues>"
    return f"<ssd:ParameterBinding {attributes}>{inline}{mapped}</ssd:ParameterBinding>"


def written(path, content, fmus, **entries):
    """Write an archive of an SSD, FMUs by the name of their file, and other entries."""
    packed = {f"resources/{name}.fmu": fmu.read_bytes() for name, fmu in fmus.items()}
    archive.write(path, {"SystemStructure.ssd": content, **packed, **entries})
    return path
