"""Archives and FMUs that other tools, file managers and foes write: read, or named for what they are in a line."""

import struct
import tempfile
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

import fmpy
import pytest

from rov_cosim.errors import UserError
from rov_cosim.exporters import archive
from rov_cosim.master.simulation import simulate
from rov_cosim.ssp import reader as ssp_reader
from rov_cosim.ssp import zipped
from rov_cosim.ssp.fmu_file import FmuError, described
from rov_cosim.ssp.swapping import with_swaps
from rov_cosim.ssp.wiring import WiringError
from structure import EXPERIMENT, binding, bindings, component, elements, parameter_set, spaces, ssd, written
from typed import call, ok

ONE = elements(component("a", "gain"))
STEPS = EXPERIMENT.replace(
    "/>",
    '><ssd:Annotations><ssc:Annotation type="com.opensimulationplatform"><osp:Algorithm '
    'xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations"><osp:FixedStepAlgorithm baseStepSize="0.1"/>'
    "</osp:Algorithm></ssc:Annotation></ssd:Annotations></ssd:DefaultExperiment>",
)


def read(path):
    """Return the wiring of an archive, which has run, and what was told."""
    told = []
    with ssp_reader.opened(path, told.append) as wiring:
        assert len(simulate(wiring)) == 4
        return wiring, [line.removeprefix(f"{path}: ") for line in told]


def problem(path):
    """Return the only problem of an archive, which shows no folder of this project's own."""
    with pytest.raises(WiringError) as caught, ssp_reader.opened(path):
        pass
    lines = str(caught.value).splitlines()
    assert len(lines) == 1
    assert lines[0].startswith(f"{path}: ")
    assert "rov_cosim_" not in lines[0]
    return lines[0].removeprefix(f"{path}: ")


def repacked(path, name=lambda name: name, packed=ZIP_DEFLATED, **further):
    """Write an archive anew with other names of its entries, and further ones; return its path."""
    content = archive.read(path)
    with ZipFile(path, "w", packed) as file:
        for old, data in {**content, **further}.items():
            file.writestr(name(old), data)
    return path


@pytest.fixture
def one(plain_gain, tmp_path):
    """Return an archive of one element."""
    return written(tmp_path / "one.ssp", ssd(ONE, STEPS), {"gain": plain_gain})


def described_as(fmu, path, *edits, **entries):
    """Write a copy of an FMU with its description edited and further entries, None to leave one out."""
    content = archive.read(fmu)
    text = content["modelDescription.xml"].decode()
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    content |= {"modelDescription.xml": text.encode(), **entries}
    archive.write(path, {name: data for name, data in content.items() if data is not None})
    return path


def test_comments_and_instructions_between_elements_are_no_content(plain_gain, tmp_path):
    between = "<!-- between --><?between elements?>"
    values = parameter_set(gain=("Real", 3), rate=("Real", 2))
    schema = 'xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:schemaLocation="http://a http://b"'
    content = ssd(elements(component("a", "gain", bindings(binding(values)))), STEPS).replace(
        b"><", f">{between}<".encode()
    )
    content = content.replace(b' name="by_hand"', f' {schema} name="by_hand"'.encode(), 1)
    wiring, told = read(written(tmp_path / "comments.ssp", content, {"gain": plain_gain}))
    assert (wiring.value("a.gain"), wiring.value("a.rate"), told) == (3.0, 2.0, [])


def test_a_prefix_that_is_not_declared_is_told_once_and_taken_as_meant(plain_gain, tmp_path):
    undeclared = STEPS.replace(' xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations"', "")
    assert undeclared != STEPS
    wiring, told = read(written(tmp_path / "osp.ssp", ssd(ONE, undeclared), {"gain": plain_gain}))
    assert wiring.step_size == 0.1
    assert len(told) == 1
    assert "SystemStructure.ssd: The prefix osp is not declared" in told[0]
    unknown = ssd(ONE, STEPS.replace("osp:Algorithm", "osq:Algorithm"))
    assert "Namespace prefix osq on Algorithm" in problem(written(tmp_path / "q.ssp", unknown, {"gain": plain_gain}))


def test_sources_are_uris(plain_gain, tmp_path):
    spaced = ONE.replace("resources/gain.fmu", "./resources/my%20gain%C3%A4.fmu")
    path = written(tmp_path / "uri.ssp", ssd(spaced, STEPS), {"my gainä": plain_gain})
    assert read(path)[1] == []
    literal = ONE.replace("gain.fmu", "50%20.fmu")
    assert read(written(tmp_path / "literal.ssp", ssd(literal, STEPS), {"50%20": plain_gain}))[1] == []


@pytest.mark.parametrize(
    "source",
    ["x" * 5000, "%00", "../gain.fmu", "/gain.fmu", "file:///gain.fmu", "%2e%2e/gain.fmu", "proxy://h?f=g.fmu"],
)
def test_what_lies_outside_is_not_run(plain_gain, tmp_path, source):
    (tmp_path / "gain.fmu").write_bytes(plain_gain.read_bytes())
    path = written(tmp_path / "out.ssp", ssd(ONE.replace("resources/gain.fmu", source), STEPS), {})
    assert problem(path).startswith(f"a: the archive has no FMU {source:.100}.")


def test_backslashes_part_folders(one):
    assert read(repacked(one, lambda name: name.replace("/", "\\")))[1] == []


def test_a_folder_at_the_top_is_told_and_looked_into(one):
    inside = repacked(one, lambda name: f"my system/{name}", **{"__MACOSX/SystemStructure.ssd": b"no"})
    _, told = read(inside)
    assert told == ["SystemStructure.ssd lies in the folder my system, not at the root, where SSP wants it."]


def damage(place, change):
    def edit(path):
        content = bytearray(path.read_bytes())
        content[place(content)] = change
        path.write_bytes(content)

    return edit


def encrypt(path):
    """Mark every entry as encrypted, in its own header and in the directory."""
    content = bytearray(path.read_bytes())
    for signature, flags in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        at = -1
        while (at := content.find(signature, at + 1)) >= 0:
            content[at + flags] |= 1
    path.write_bytes(content)


def pack_as(method):
    def edit(path):
        content = bytearray(path.read_bytes())
        for signature, place in ((b"PK\x03\x04", 8), (b"PK\x01\x02", 10)):
            at = -1
            while (at := content.find(signature, at + 1)) >= 0:
                content[at + place : at + place + 2] = struct.pack("<H", method)
        path.write_bytes(content)

    return edit


ZIPS = {
    "encrypted": (encrypt, "it is encrypted: unpack it with its password"),
    "of a method of its own": (pack_as(9), "is damaged, or packed as it cannot be read here"),
    "cut off": (lambda path: path.write_bytes(path.read_bytes()[:-200]), "it is not a zip archive"),
    "damaged inside": (damage(lambda content: len(content) // 2, 0xFF), "is damaged, or packed as it cannot be read"),
    "empty": (lambda path: path.write_bytes(b""), "it is empty: copy it again."),
    "a text": (lambda path: path.write_text("hello", encoding="utf-8"), "it is not a zip archive"),
    "a pointer": (
        lambda path: path.write_bytes(b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n"),
        "it is a pointer of Git LFS, not the file itself: get that by `git lfs pull`.",
    ),
    "leading out": (lambda path: repacked(path, **{"../../evil.txt": b""}), "holds '../../evil.txt', which leads out"),
    "leading out by backslash": (lambda path: repacked(path, **{"..\\evil.txt": b""}), "which leads out of its folder"),
    "absolute": (lambda path: repacked(path, **{"/etc/evil.txt": b""}), "which leads out of its folder"),
    "with a drive": (lambda path: repacked(path, **{"C:\\evil.txt": b""}), "which leads out of its folder"),
    "of an absurd name": (lambda path: repacked(path, **{"x" * 300: b""}), "holds a name of 300 characters, xxxx"),
    "of a file that is a folder too": (
        lambda path: repacked(path, **{"resources": b"", "resources/b/c": b""}),
        "cannot be read",
    ),
}


@pytest.mark.parametrize("case", ZIPS)
@pytest.mark.parametrize("kind", ["ssp", "fmu"])
def test_archives_that_cannot_be_unpacked_are_named_for_what_they_are(one, tmp_path, plain_gain, case, kind):
    break_, sentence = ZIPS[case]
    if kind == "ssp":
        break_(one)
        assert sentence in problem(one)
    else:
        path = tmp_path / "broken.fmu"
        path.write_bytes(plain_gain.read_bytes())
        break_(path)
        if case == "of a file that is a folder too" or case == "damaged inside":
            with pytest.raises(UserError, match=sentence):
                zipped.unpack(path, tmp_path / "there")
            return
        with pytest.raises(FmuError) as caught:
            described(path)
        assert sentence in str(caught.value)
        assert "\n" not in str(caught.value)


def test_bombs_are_not_unpacked_and_what_is_merely_small_is(one, plain_gain, tmp_path, monkeypatch):
    zeros = b"\0" * 2**20
    (tmp_path / "gain.fmu").write_bytes(plain_gain.read_bytes())
    bomb = repacked(tmp_path / "gain.fmu", **{f"resources/{i}": zeros for i in range(40)})
    assert described(bomb).modelName == "PlainGain"
    monkeypatch.setattr(zipped, "_SMALL", 2**24)
    monkeypatch.setattr(zipped, "MOST_RATIO", 20)
    with pytest.raises(FmuError, match=r"to 40[.0-9]* MB, as zip bombs do"):
        described(bomb)
    outer = repacked(one, **{"resources/gain.fmu": bomb.read_bytes()})
    assert "a: resources/gain.fmu is not a readable FMU: it unpacks" in problem(outer)
    assert "it unpacks" in problem(repacked(one, **{f"resources/{i}": zeros for i in range(40)}))
    monkeypatch.setattr(zipped, "MOST_ENTRIES", 10)
    assert "has 4" in problem(one)


def test_a_full_disk_is_told_before_it_is_full(one, monkeypatch):
    monkeypatch.setattr(zipped.shutil, "disk_usage", lambda folder: type("Usage", (), {"free": 10}))
    assert "more than is free in the temporary folder: set TMPDIR to another." in problem(one)


DTD = b'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;"><!ENTITY c SYSTEM "file:///etc/passwd">]>'
DOCUMENTS = {
    "version 2": (ssd(ONE, STEPS, "2.0"), "SystemStructure.ssd: This is SSP 2.0; expected SSP 1.0"),
    "DTD": (
        ssd(ONE, STEPS).replace(b"<ssd:System", DTD + b"<ssd:System", 1),
        "This has a DOCTYPE, which SSP does not know",
    ),
    "entity": (
        ssd(ONE, STEPS).replace(b"<ssd:System", DTD + b"<ssd:System", 1).replace(b'"root"', b'"&b;&c;"'),
        "SystemStructure.ssd: This",
    ),
    "another document": (f"<ssv:ParameterSet {spaces()} version='1.0'/>".encode(), "This is ParameterSet of http"),
    "old namespace": (ssd(ONE, STEPS).replace(b"/SSP1/", b"/SSP0/"), "expected SystemStructureDescription of SSP 1.0"),
    "empty": (b"", "This is not well-formed XML: Document is empty"),
    "not in its encoding": (ssd(ONE, STEPS).replace(b"by_hand", b"\xff\xfe"), "This is not well-formed XML"),
    "offset": (
        ssd(
            ONE.replace("</ssd:Elements>", component("b", "gain") + "</ssd:Elements>")
            + '<ssd:Connections><ssd:Connection startElement="a" startConnector="y" endElement="b" endConnector="u">'
            '<ssc:LinearTransformation offset="50"/></ssd:Connection></ssd:Connections>',
            STEPS,
        ),
        'offset="50" of a LinearTransformation is not supported.',
    ),
    "table": (
        ssd(
            ONE
            + '<ssd:Connections><ssd:Connection startElement="a" startConnector="y" endElement="a" endConnector="u">'
            '<ssc:BooleanMappingTransformation><ssc:MapEntry source="true" target="false"/>'
            "</ssc:BooleanMappingTransformation></ssd:Connection></ssd:Connections>",
            STEPS,
        ),
        "a BooleanMappingTransformation of a Connection is not supported.",
    ),
    "another archive": (
        ssd(elements(component("a", "gain", attributes='type="application/x-ssp-package"')), STEPS),
        'type="application/x-ssp-package" of a Component is not supported.',
    ),
    "empty binding": (
        ssd(elements(component("a", "gain", bindings("<ssd:ParameterBinding/>"))), STEPS),
        "This ParameterBinding has neither a source nor content.",
    ),
    "broken binding": (
        ssd(elements(component("a", "gain", bindings(binding("<ssv:ParameterSet version='1.0' name='x'/>")))), STEPS),
        "Element 'ParameterSet': Missing child element(s).",
    ),
    "binding outside": (
        ssd(elements(component("a", "gain", bindings('<ssd:ParameterBinding source="../x.ssv"/>'))), STEPS),
        "../x.ssv: The archive has no such file.",
    ),
    "blank name": (ssd(elements(component(" ", "gain")), STEPS), "The element name ' ' is blank"),
    "absurd name": (ssd(elements(component("x" * 5000, "gain")), STEPS), "xxx... has 5000 characters"),
    "name with a bell": (ssd(elements(component("a&#x85;b", "gain")), STEPS), "what cannot be shown: rename it."),
}


@pytest.mark.parametrize("case", DOCUMENTS)
def test_documents_that_are_not_read_are_named_for_what_they_are(plain_gain, tmp_path, case):
    content, sentence = DOCUMENTS[case]
    assert sentence in problem(written(tmp_path / "odd.ssp", content, {"gain": plain_gain}))


def test_parameter_sets_of_ssp_2_are_told_and_read_where_they_are_those_of_1(plain_gain, tmp_path):
    for content, is_read in (("Real", True), ("Float64", False)):
        values = parameter_set(gain=(content, 3)).replace('version="1.0"', 'version="2.0"')
        path = written(
            tmp_path / "two.ssp",
            ssd(elements(component("a", "gain", bindings('<ssd:ParameterBinding source="v.ssv"/>'))), STEPS),
            {"gain": plain_gain},
            **{"v.ssv": values.encode()},
        )
        if is_read:
            wiring, told = read(path)
            assert (wiring.value("a.gain"), told) == (3.0, ["v.ssv: This is SSP 2.0, and is read as SSP 1.0."])
        else:
            assert problem(path).startswith("v.ssv: This is SSP 2.0; expected SSP 1.0")


@pytest.mark.parametrize(
    ("entries", "sentence"),
    [
        ({"modelDescription.xml": b"<x/>"}, "This is an FMU, which takes a place in a system by --swap"),
        ({"VariantB.ssd": b""}, "There are VariantB.ssd: give the one to run this name."),
        ({"OspSystemStructure.xml": b""}, "is a form of Open Simulation Platform's own."),
        ({"readme.txt": b""}, "There is no such file."),
    ],
)
def test_archives_without_a_structure_are_named_for_what_they_are(tmp_path, entries, sentence):
    archive.write(tmp_path / "other.ssp", entries)
    assert sentence in problem(tmp_path / "other.ssp")


FAULTS = {
    "unit": ([('<Real start="2"', '<Real unit="furlong" start="2"')], 'The unit "furlong" of variable "gain"'),
    "display unit": (
        [('<Real start="2"', '<Real unit="rad" displayUnit="deg" start="2"')],
        'The unit "rad" of variable "gain"',
    ),
    "schema": ([("<ModelVariables>", '<ModelVariables mood="gay">')], "attribute 'mood' is not allowed"),
    "double name": ([('name="fail_at"', 'name="rate"')], 'The variable name "rate"'),
}


@pytest.mark.parametrize("case", FAULTS)
def test_formal_faults_that_fmpy_runs_are_told_once_and_run(plain_gain, tmp_path, case):
    edits, sentence = FAULTS[case]
    fmu = described_as(plain_gain, tmp_path / "faulty.fmu", *edits)
    with pytest.raises(Exception, match=r"."):
        fmpy.read_model_description(str(fmu))
    assert len(fmpy.simulate_fmu(str(fmu), validate=False, stop_time=0.3, output_interval=0.1)) == 4
    two = elements(component("a", "gain"), component("b", "gain"))
    _, told = read(written(tmp_path / "faulty.ssp", ssd(two, STEPS), {"gain": fmu}))
    assert len(told) == 1
    assert told[0].startswith("resources/gain.fmu is not quite as FMI wants it: ")
    assert sentence in told[0]


@pytest.mark.parametrize("start", ["much", "0,5", "INF", "NaN"])
def test_a_start_that_is_no_finite_number_is_left_to_the_fmu(plain_gain, tmp_path, start):
    odd = f'<Real start="{start}" min="{start}" max="2'
    fmu = described_as(plain_gain, tmp_path / "odd.fmu", ('<Real start="2', odd))
    wiring, _ = read(written(tmp_path / "odd.ssp", ssd(ONE, STEPS), {"gain": fmu}))
    assert not wiring.elements[0].has_value("gain")
    assert "gain" in ok("show", tmp_path / "odd.ssp", "a")
    done = call("run", tmp_path / "odd.ssp", "--output", tmp_path, "--archive", tmp_path / "whole.ssp")
    assert done.exit_code == 0, done.output


def test_many_formal_faults_are_one_warning_of_a_swap_too(one, plain_gain, tmp_path):
    edits = [("<Real start", '<Real unit="furlong" start')] * 4
    fmu = described_as(plain_gain, tmp_path / "faulty.fmu", *edits)
    told = []
    with ssp_reader.opened(one) as wiring:
        swapped = with_swaps(wiring, {"a": fmu}, {}, told.append)
        assert len(simulate(swapped)) == 4
    assert len(told) == 1
    assert told[0].endswith("And 2 more.")


PLATFORM = fmpy.platform
FMUS = {
    "FMI 1": (
        [('fmiVersion="2.0"', 'fmiVersion="1.0"')],
        {},
        "is not an FMU for co-simulation with FMI 2.0: it is of FMI 1.0.",
    ),
    "FMI 3": ([('fmiVersion="2.0"', 'fmiVersion="3.0"')], {}, "it is of FMI 3.0."),
    "no version": ([(' fmiVersion="2.0"', "")], {}, "not fmiModelDescription with an fmiVersion."),
    "another document": ([("fmiModelDescription ", "x "), ("/fmiModelDescription", "/x")], {}, "holds x, not"),
    "model exchange": (
        [("<CoSimulation", "<ModelExchange")],
        {},
        "it is for model exchange alone.",
    ),
    "not XML": ([("<fmiModelDescription", "<")], {}, "its modelDescription.xml is not well-formed XML"),
    "DTD": (
        [("<fmiModelDescription", f"{DTD.decode()}<fmiModelDescription")],
        {},
        "has a DOCTYPE, which FMI does not know.",
    ),
    "no description": ([], {"modelDescription.xml": None}, "it has no modelDescription.xml."),
    "folder": (
        [],
        {"modelDescription.xml": None, "gain/modelDescription.xml": b""},
        "its modelDescription.xml lies in the folder gain/; zip what that folder holds.",
    ),
    "archive": ([], {"modelDescription.xml": None, "SystemStructure.ssd": b""}, "is an SSP archive, not an FMU."),
    "other platforms": (
        [],
        {f"binaries/{PLATFORM}/PlainGain{fmpy.sharedLibraryExtension}": None, "binaries/sparc64/PlainGain.so": b""},
        f"has no binary for {PLATFORM}, which is this machine: it has those for sparc64.",
    ),
    "other library": ([("PlainGain", "Gain"), ('Identifier="PlainGain"', 'Identifier="Gain"')], {}, "has no Gain."),
    "tool": (
        [],
        {"resources/slavemodule.txt": None},
        "needs the tool that made it in each run (PythonFMU",
    ),
    "reference to nothing": ([('index="6"', 'index="99"')], {}, "is not a readable FMU: "),
    "dependency on nothing": (
        [('index="6"', 'index="6" dependencies="99"')],
        {},
        "is not a readable FMU: it refers to a variable by an index that none has.",
    ),
    "reference in words": ([('valueReference="2"', 'valueReference="two"')], {}, "'two' is not a valid value of"),
    "reference beyond 32 bits": (
        [('valueReference="2"', 'valueReference="4294967298"')],
        {},
        "is not a readable FMU: the valueReference 4294967298 of",
    ),
    "no guid": ([(" guid=", " author=")], {}, "is not a readable FMU: it has no guid."),
    "no identifier": ([(" modelIdentifier=", " x=")], {}, "is not a readable FMU: it has no modelIdentifier."),
}


@pytest.mark.parametrize("case", FMUS)
def test_fmus_that_are_not_run_are_named_for_what_they_are(plain_gain, tmp_path, case):
    edits, entries, sentence = FMUS[case]
    fmu = described_as(plain_gain, tmp_path / "odd.fmu", *edits, **entries)
    told = problem(written(tmp_path / "odd.ssp", ssd(ONE, STEPS), {"gain": fmu}))
    assert told.startswith("a: resources/gain.fmu ")
    assert sentence in told


def test_an_fmu_that_a_process_can_have_once_stands_in_a_system_once(plain_gain, tmp_path):
    only = "canBeInstantiatedOnlyOncePerProcess="
    text = archive.read(plain_gain)["modelDescription.xml"].decode()
    edit = (f'{only}"false"', f'{only}"true"') if only in text else ("<CoSimulation ", f'<CoSimulation {only}"true" ')
    fmu = described_as(plain_gain, tmp_path / "single.fmu", edit)
    assert read(written(tmp_path / "one.ssp", ssd(ONE, STEPS), {"gain": fmu}))[1] == []
    two = elements(component("a", "gain"), component("b", "gain"))
    told = problem(written(tmp_path / "two.ssp", ssd(two, STEPS), {"gain": fmu}))
    assert told.startswith("a and b are of one FMU, PlainGain, of which a process can have one instance alone")


def test_a_name_with_dollars_is_drawn_as_it_is(plain_gain, tmp_path):
    path = written(tmp_path / "dollars.ssp", ssd(elements(component("a$b^{$", "gain")), STEPS), {"gain": plain_gain})
    ok("show", path, "--picture", tmp_path / "dollars.svg")
    assert "a$b^{$" in (tmp_path / "dollars.svg").read_text(encoding="utf-8")


def test_a_run_of_a_foreign_archive_tells_on_the_screen_and_names_the_option(plain_gain, tmp_path):
    undeclared = STEPS.replace(' xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations"', "")
    path = written(tmp_path / "a.ssp", ssd(ONE, undeclared.replace(' stopTime="0.3"', "")), {"gain": plain_gain})
    done = call("run", path, "--output", tmp_path)
    assert done.exit_code == 1
    assert "give one by --stop-time" in done.output
    done = call("run", path, "--output", tmp_path, "--stop-time", "0.3")
    assert done.exit_code == 0
    assert done.output.count("The prefix osp is not declared") == 1
    assert "0 s on, to a --stop-time in steps of 0.1 s" in call("show", path).output


def test_no_unpacked_archive_is_left(one, tmp_path, monkeypatch):
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    read(one)
    one.write_bytes(one.read_bytes()[:-200])
    problem(one)
    assert list(Path(tmp_path / "tmp").iterdir()) == []
