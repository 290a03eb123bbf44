"""Units at the two ends of a connection: converted where a factor does it, refused where none can."""

import pytest
from lxml import etree

from fmu import with_units
from rov_cosim.exporters import archive
from rov_cosim.importers.measuring import measure
from rov_cosim.importers.tools import IMPORTERS
from rov_cosim.master.simulation import simulate
from rov_cosim.ssp import reader as ssp_reader
from rov_cosim.ssp.declaration import System, wire
from rov_cosim.ssp.strict_xml import NAMESPACES
from rov_cosim.ssp.wiring import WiringError
from rov_cosim.whole import writer as ssp_writer
from typical import typical

DEG = {"rad": "1", "factor": "0.0174532925199433"}
UNITS = {
    "deg": DEG,
    "rad": {"rad": "1"},
    "degC": {"K": "1", "offset": "273.15"},
    "K": {"K": "1"},
    "turn": None,
    "mm": None,
    "m": None,
}


def pair(plain_gain, tmp_path, of_source, of_target, *transformation):
    """Return a gain that feeds another, y = 2 u + 1, the connection's ends in two units."""
    fmus = {"a": plain_gain, "b": plain_gain}
    for name, variable, unit in (("a", "y", of_source), ("b", "u", of_target)):
        if unit:
            fmus[name] = with_units(plain_gain, tmp_path / f"{name}.fmu", {variable: unit}, {unit: UNITS[unit]})
    system = System(
        "pair", "", {"a": "a", "b": "b"}, (("a.y", "b.u", *transformation),), 0.3, {"a": {"u": 44.5, "rate": 10.0}}
    )
    return wire(system, fmus)


@pytest.mark.parametrize(
    ("source", "target", "factor"),
    [
        ("deg", "rad", 0.0174532925199433),
        ("rad", "deg", 57.29577951308),
        ("deg", "deg", 1.0),
        ("deg", None, 1.0),
        ("degC", "degC", 1.0),
        ("turn", "turn", 1.0),
        ("mm", "m", 1e-3),  # named, not defined
    ],
)
def test_a_connection_converts_units_of_one_dimension(plain_gain, tmp_path, source, target, factor):
    wiring = pair(plain_gain, tmp_path, source, target)
    assert [link.factor for link in wiring.links] == pytest.approx([factor], rel=1e-12)


@pytest.mark.parametrize(("source", "target"), [("deg", "K"), ("degC", "K"), ("turn", "rad"), ("m", "rad")])
def test_units_that_no_factor_converts_are_refused(plain_gain, tmp_path, source, target):
    with pytest.raises(WiringError, match=f"unit {source} does not match {target}: no factor converts"):
        pair(plain_gain, tmp_path, source, target)


def test_the_conversion_and_a_sign_are_written_read_and_applied_once(plain_gain, tmp_path):
    wiring, path = pair(plain_gain, tmp_path, "deg", "rad", {"u": -1.0}), tmp_path / "pair.ssp"
    ssp_writer.write(wiring, path, plain=True)
    with ssp_reader.opened(path) as read:
        assert read.links == wiring.links
        results = simulate(read)
    assert results["b.y"][0] == pytest.approx(2 * -0.0174532925199433 * 90.0 + 1.0)


def test_an_archive_that_leaves_the_conversion_to_its_reader_is_read_alike(plain_gain, tmp_path):
    wiring, path = pair(plain_gain, tmp_path, "deg", "rad", {"u": -1.0}), tmp_path / "pair.ssp"
    ssp_writer.write(wiring, path, plain=True)
    content = archive.read(path)
    root = etree.fromstring(content["SystemStructure.ssd"])
    connection = root.find(".//ssd:Connection", NAMESPACES)
    del connection.attrib["suppressUnitConversion"]
    connection[0].set("factor", "-1")
    archive.write(path, {**content, "SystemStructure.ssd": etree.tostring(root)})
    with ssp_reader.opened(path) as read:
        assert read.links == wiring.links


@pytest.mark.parametrize("tool", typical(["ecos", "libcosim"], "libcosim"))
def test_tools_that_convert_no_units_come_to_the_same(plain_gain, tmp_path, tool):
    if IMPORTERS[tool].version() is None:
        pytest.skip(f"{tool} is not installed; it is part of the extra importers")
    path = tmp_path / "pair.ssp"
    ssp_writer.write(pair(plain_gain, tmp_path, "deg", "rad"), path)
    assert measure(tool, "loop", path, 0.3) <= IMPORTERS[tool].tolerance
