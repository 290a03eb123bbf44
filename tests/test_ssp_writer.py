"""SSP archives as they are written: valid, complete, as other readers need them, reproducible."""

import shutil
import subprocess
import sys
from importlib.resources import files
from importlib.util import find_spec

import pytest
from fmpy.ssp.ssd import read_ssd, read_ssv
from fmpy.validation import validate_fmu
from lxml import etree

from rov_cosim.errors import UserError
from rov_cosim.exporters import archive
from rov_cosim.ssp import reader as ssp_reader
from rov_cosim.ssp.declaration import System, wire
from rov_cosim.ssp.strict_xml import NAMESPACES
from rov_cosim.systems.catalogue import SYSTEMS
from rov_cosim.whole import writer as ssp_writer
from typical import distinct, typical

NAMES = typical(distinct(SYSTEMS, "minerva_pd"), "station_keeping")


def schema(name):
    return etree.XMLSchema(file=str(files("fmpy.ssp") / "schema" / name))


@pytest.mark.parametrize("name", NAMES)
def test_structure_and_parameters_are_valid_and_read_by_fmpy(archives, name):
    entries = archive.read(archives[name])
    assert schema("SystemStructureDescription.xsd").validate(etree.fromstring(entries["SystemStructure.ssd"]))
    for entry in [e for e in entries if e.endswith(".ssv")]:
        assert schema("SystemStructureParameterValues.xsd").validate(etree.fromstring(entries[entry]))
        assert read_ssv(str(archives[name]), entry).name == "nominal"
    description = read_ssd(str(archives[name]))
    assert [element.name for element in description.system.elements] == list(SYSTEMS[name].elements)
    assert validate_fmu(str(archives[name])) == []


def test_the_structure_keeps_to_what_other_readers_need(archives):
    text = archive.read(archives["station_keeping"])["SystemStructure.ssd"].decode()
    root = etree.fromstring(text.encode())
    for prefix in ("ssd:System ", "ssc:Real", "ssd:Connection "):
        assert f"<{prefix}" in text
    for connector in root.iterfind(".//ssd:Connector", NAMESPACES):
        (typed,) = connector
        if etree.QName(typed).localname == "Real":
            assert typed.get("unit")
    connected = {(c.get("endElement"), c.get("endConnector")) for c in root.iterfind(".//ssd:Connection", NAMESPACES)}
    for component in root.iterfind(".//ssd:Component", NAMESPACES):
        inputs = {c.get("name") for c in component.iterfind(".//ssd:Connector", NAMESPACES) if c.get("kind") == "input"}
        assert inputs == {name for element, name in connected if element == component.get("name")}
    assert root.find(".//osp:FixedStepAlgorithm", NAMESPACES).get("baseStepSize") == "0.03"
    assert root.find(".//oms:FixedStepMaster", NAMESPACES).get("stepSize") == "0.03"


@pytest.mark.parametrize("name", NAMES)
def test_what_is_written_is_read_back(archives, fmus, name):
    declared = wire(SYSTEMS[name], fmus)
    with ssp_reader.opened(archives[name]) as wiring:
        assert wiring.links == declared.links
        assert [e.start_values for e in wiring.elements] == [dict(e.start_values) for e in declared.elements]
        assert (wiring.name, wiring.start_time, wiring.stop_time, wiring.step_size) == (
            name,
            0.0,
            SYSTEMS[name].stop_time,
            0.03,
        )


def test_archives_are_reproducible_and_plain_ones_hold_ssp_content_alone(archives, fmus, tmp_path):
    wiring = wire(SYSTEMS["station_keeping"], fmus)
    again, plain = tmp_path / "station_keeping.ssp", tmp_path / "plain.ssp"
    assert ssp_writer.write(wiring, again)
    assert again.read_bytes() == archives["station_keeping"].read_bytes()
    assert ssp_writer.write(wiring, plain, plain=True)
    assert all(name == "SystemStructure.ssd" or name.startswith("resources/") for name in archive.read(plain))


@pytest.mark.parametrize("name", typical(["station_keeping", "bluerov2_heavy_pid"], "station_keeping"))
def test_another_checker_finds_nothing_in_an_archive_as_an_fmu(archives, tmp_path, name):
    if not find_spec("fmu_manipulation_toolbox"):
        pytest.skip("fmu-manipulation-toolbox is not installed; the extra `importers` has it")
    fmu = tmp_path / f"{name}.fmu"
    shutil.copy(archives[name], fmu)
    command = [sys.executable, "-m", "fmu_manipulation_toolbox.cli.fmutool", "-input", fmu, "-check"]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "ERROR" not in done.stdout + done.stderr


def described_otherwise(fmu, path, *pairs):
    """Write a copy of an FMU with parts of its description replaced."""
    content = archive.read(fmu)
    description = content["modelDescription.xml"]
    for old, new in pairs:
        assert old in description, old
        description = description.replace(old, new, 1)
    archive.write(path, {**content, "modelDescription.xml": description})
    return path


def test_what_an_fmu_says_of_itself_does_not_spoil_the_archive(fmus, tmp_path):
    odd = described_otherwise(
        fmus["pid"],
        tmp_path / "odd.fmu",
        (b'initial="calculated">\n      <Real', b'initial="exact">\n      <Real declaredType="F" start="0"'),
        (
            b"<LogCategories>",
            b'<TypeDefinitions><SimpleType name="F"><Real unit="N"/></SimpleType></TypeDefinitions><LogCategories>',
        ),
        (
            b"</ModelVariables>",
            b'<ScalarVariable name="note" valueReference="9999" causality="parameter" '
            b'variability="fixed"><String start="x"/></ScalarVariable></ModelVariables>',
        ),
    )
    path = tmp_path / "odd.ssp"
    write = wire(System("odd", "", {"a": "odd", "b": "odd"}, (("a.e", "b.eta_d"),), 0.3), {"odd": odd})
    assert ssp_writer.write(write, path)
    assert validate_fmu(str(path)) == []


def test_two_units_of_one_name_are_refused(fmus, tmp_path):
    other = described_otherwise(
        fmus["pid"],
        tmp_path / "kilo.fmu",
        (b'<BaseUnit kg="1" m="1" s="-2"/>', b'<BaseUnit kg="1" m="1" s="-2" factor="1000"/>'),
    )
    both = wire(System("two", "", {"a": "pid", "b": "kilo"}, (), 0.3), {"pid": fmus["pid"], "kilo": other})
    with pytest.raises(UserError, match="The FMUs of a and b define unit N differently"):
        ssp_writer.write(both, tmp_path / "two.ssp")
