"""An FMU of another make, in C, that misbehaves as the name of its instance says."""

from pathlib import Path

from rov_cosim.exporters import archive, zig
from rov_cosim.ssp.fmu_file import described
from rov_cosim.ssp.wiring import Element, End, Link, Wiring

_C = Path(__file__).parent / "fmus" / "foreign.c"
_DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="foreign" guid="foreign">
<CoSimulation modelIdentifier="foreign" {flags}/>
<TypeDefinitions><SimpleType name="Mode"><Enumeration><Item name="off" value="1"/><Item name="on" value="2"/>
</Enumeration></SimpleType></TypeDefinitions>
<DefaultExperiment {experiment}/>
<ModelVariables>
<ScalarVariable name="t" valueReference="0" causality="output"><Real/></ScalarVariable>
<ScalarVariable name="u" valueReference="1" causality="input"><Real start="0"/></ScalarVariable>
<ScalarVariable name="y" valueReference="2" causality="output"><Real/></ScalarVariable>
<ScalarVariable name="n" valueReference="3" causality="output"><Real/></ScalarVariable>
<ScalarVariable name="h" valueReference="4" causality="output" initial="exact"><Real start="1"/></ScalarVariable>
<ScalarVariable name="far" valueReference="5" causality="output"><Real/></ScalarVariable>
<ScalarVariable name="mode" valueReference="0" causality="parameter" variability="fixed">
<Enumeration declaredType="Mode" start="1"/></ScalarVariable>
<ScalarVariable name="state" valueReference="1" causality="output" variability="discrete">
<Enumeration declaredType="Mode"/></ScalarVariable>
<ScalarVariable name="file" valueReference="0" causality="parameter" variability="fixed">
<String start=""/></ScalarVariable>
<ScalarVariable name="text" valueReference="1" causality="output" variability="discrete"><String/></ScalarVariable>
<ScalarVariable name="select" valueReference="2" causality="input" variability="discrete">
<Integer start="0"/></ScalarVariable>
<ScalarVariable name="selected" valueReference="3" causality="output" variability="discrete"><Integer/></ScalarVariable>
<ScalarVariable name="word" valueReference="0" causality="input" variability="discrete">
<String start=""/></ScalarVariable>
</ModelVariables>
<ModelStructure><Outputs>{outputs}</Outputs><InitialUnknowns>{unknowns}</InitialUnknowns></ModelStructure>
</fmiModelDescription>
"""
ANY_STEP = 'canHandleVariableCommunicationStepSize="true"'


def library() -> bytes:
    """Return the compiled FMU for this machine."""
    sources = {"foreign.c": _C.read_bytes(), **zig.standard_headers()}
    options = ("-shared", "-fPIC", "-s", "-fvisibility=default", "-Wno-unused-parameter")
    return zig.compiled(sources, zig.host_target(), "foreign.so", options)


def write(path: Path, binary: bytes, flags: str = ANY_STEP, experiment: str = 'stopTime="1"') -> Path:
    """Write the FMU with some flags of its CoSimulation element and its DefaultExperiment."""
    outputs = "".join(f'<Unknown index="{i}" dependencies=""/>' for i in (1, 3, 4, 5, 6, 8, 10, 12))
    unknowns = "".join(f'<Unknown index="{i}"/>' for i in (1, 3, 4, 6, 8, 10, 12))
    text = _DESCRIPTION.format(flags=flags, experiment=experiment, outputs=outputs, unknowns=unknowns)
    platform = zig.host_platform()
    place = f"binaries/{platform}/foreign{zig.SUFFIXES[platform]}"
    archive.write(path, {"modelDescription.xml": text.encode(), place: binary})
    return path


def alone(fmu: Path, name: str = "a", stop_time: float = 0.3, **values: object) -> Wiring:
    """Return a system of one such FMU."""
    element = Element(name, fmu, described(fmu, fmu.name), values)
    return Wiring("alone", (element,), (), stop_time, 0.03)


def pair(fmu: Path, other: Path) -> Wiring:
    """Return a system of two: the input of b is the time of a."""
    a, b = alone(fmu, "a").elements[0], alone(other, "b").elements[0]
    return Wiring("pair", (a, b), (Link(End("a", "t"), End("b", "u")),), 0.3, 0.03)


_EXPERIMENT = (
    '<ssd:DefaultExperiment stopTime="0.3"><ssd:Annotations>'
    '<ssc:Annotation xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" type="com.opensimulationplatform">'
    '<osp:Algorithm xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations">'
    '<osp:FixedStepAlgorithm baseStepSize="0.03"/></osp:Algorithm></ssc:Annotation></ssd:Annotations>'
    "</ssd:DefaultExperiment>"
)


def ssp(path: Path, fmu: Path, name: str = "a") -> Path:
    """Write an archive of a system of one such FMU, that steps by 30 ms to 0.3 s."""
    urn = "http://ssp-standard.org/SSP1/SystemStructureDescription"
    text = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<ssd:SystemStructureDescription xmlns:ssd="{urn}" name="alone" version="1.0">'
        f'<ssd:System name="root"><ssd:Elements><ssd:Component name="{name}" source="resources/a.fmu" '
        f'type="application/x-fmu-sharedlibrary"/></ssd:Elements></ssd:System>{_EXPERIMENT}</ssd:SystemStructureDescription>'
    )
    archive.write(path, {"SystemStructure.ssd": text.encode(), "resources/a.fmu": fmu.read_bytes()})
    return path
