"""SSP archives that are wrong are refused, and every reason is told at once."""

import tempfile
from dataclasses import replace

import pytest

from rov_cosim.exporters import archive
from rov_cosim.master.simulation import simulate
from rov_cosim.ssp import reader as ssp_reader
from rov_cosim.ssp.declaration import wire
from rov_cosim.ssp.strict_xml import NAMESPACES
from rov_cosim.ssp.wiring import WiringError
from rov_cosim.systems.catalogue import SYSTEMS


def changed(archives, tmp_path, **edits):
    """Return a copy of an archive with some entries edited: a function of bytes, new bytes, or None to leave it out."""
    entries = archive.read(archives["station_keeping"])
    for name, edit in edits.items():
        name = name.replace("__", "/").replace("_DOT_", ".")
        if edit is None:
            del entries[name]
        else:
            entries[name] = edit(entries[name]) if callable(edit) else edit
    path = tmp_path / "changed.ssp"
    archive.write(path, entries)
    return path


def swap(*pairs):
    def edit(content):
        for old, new in pairs:
            assert old.encode() in content
            content = content.replace(old.encode(), new.encode(), 1)
        return content

    return edit


def problems(path):
    with pytest.raises(WiringError) as caught, ssp_reader.opened(path):
        pass
    assert all(str(path) in line for line in str(caught.value).splitlines())
    return caught.value.problems


SSD = "SystemStructure_DOT_ssd"
PLANT = "resources__rov_plant_DOT_fmu"
VALUES = "resources__rov_plant_DOT_ssv"
TRANSFORMATION = '<ssc:LinearTransformation factor="2" offset="1"/>'
BREAKS = {
    "no structure": ({SSD: None}, ["SystemStructure.ssd: There is no such file."]),
    "not XML": ({SSD: b"<ssd:System"}, ["SystemStructure.ssd: This is not well-formed XML"]),
    "unknown element": ({SSD: swap(("<ssd:Elements>", "<ssd:Elements><ssd:Gadget/>"))}, ["Gadget"]),
    "transformation": (
        {SSD: swap(('endConnector="eta.x"/>', f'endConnector="eta.x">{TRANSFORMATION}</ssd:Connection>'))},
        ['offset="1" of a LinearTransformation is not supported'],
    ),
    "missing FMU": ({PLANT: None}, ["rov_plant: the archive has no FMU resources/rov_plant.fmu."]),
    "FMU is no archive": ({PLANT: b"no zip"}, ["rov_plant: resources/rov_plant.fmu is not a readable FMU"]),
    "path that leaves the archive": (
        {SSD: swap(("resources/rov_plant.fmu", "../../rov_plant.fmu"))},
        ["has no FMU ../../rov_plant.fmu"],
    ),
    "unknown connector": (
        {SSD: swap(('startConnector="eta.x"', 'startConnector="eta.xx"'))},
        ["Connection rov_plant.eta.xx -> passive_arm.eta.x:", "no variable eta.xx. Did you mean eta.x"],
    ),
    "two sources": (
        {SSD: swap(('endConnector="eta.y"', 'endConnector="eta.x"'))},
        ["Input passive_arm.eta.x has two sources, rov_plant.eta.x and rov_plant.eta.y: remove one connection."],
    ),
    "unit mismatch": (
        {SSD: swap(('startConnector="eta.x"', 'startConnector="eta.psi"'))},
        ["Connection rov_plant.eta.psi -> passive_arm.eta.x: unit rad does not match m"],
    ),
    "type mismatch": (
        {SSD: swap(('startConnector="eta_m_valid"', 'startConnector="eta_m.x"'))},
        ["type Real does not match Boolean"],
    ),
    "kind mismatch": (
        {SSD: swap(('name="eta.x" kind="input"', 'name="eta.x" kind="output"'))},
        ["Connector passive_arm.eta.x: kind output does not match causality input."],
    ),
    "connector unit": (
        {SSD: swap(('<ssc:Real unit="m"/>', '<ssc:Real unit="rad"/>'))},
        ["unit rad does not match m"],
    ),
    "unknown parameter and bad value": (
        {VALUES: swap(('name="dB"', 'name="dBB"'), ('value="2.5"', 'value="NaN"'))},
        [
            "There is no parameter rov_plant.dBB. Did you mean rov_plant.dB",
            "rov_plant.F_C.x: expected a finite number, got 'NaN'",
        ],
    ),
    "parameter unit": (
        {VALUES: swap(('value="17.0" unit="N"', 'value="17.0" unit="m"'))},
        ["rov_plant.dB: unit m does not"],
    ),
    "parameter type": (
        {VALUES: swap(('<ssv:Real value="17.0" unit="N"/>', '<ssv:Boolean value="true"/>'))},
        ["Parameter rov_plant.dB: type Boolean does not match Real."],
    ),
    "parameter twice": (
        {VALUES: swap(('name="F_C.x"', 'name="dB"'))},
        ["Parameter dB stands twice in one parameter set"],
    ),
    "other source base": (
        {SSD: swap(('source="resources/rov_plant.ssv"', 'source="rov_plant.ssv" sourceBase="component"'))},
        ['sourceBase="component" of a ParameterBinding is not supported'],
    ),
    "model exchange": (
        {SSD: swap(('name="rov_plant" type', 'name="rov_plant" implementation="ModelExchange" type'))},
        ['implementation="ModelExchange" of a Component is not supported'],
    ),
    "missing parameter set": ({VALUES: None}, ["resources/rov_plant.ssv: The archive has no such file."]),
}


@pytest.mark.parametrize("case", BREAKS)
def test_a_broken_archive_is_refused_with_every_reason(archives, tmp_path, case):
    edits, expected = BREAKS[case]
    told = problems(changed(archives, tmp_path, **edits))
    for sentence in expected:
        assert any(sentence in problem for problem in told), told


def test_all_problems_of_several_files_are_told_at_once(archives, tmp_path):
    edits = {
        SSD: swap(('name="eta.x" kind="input"', 'name="eta.x" kind="output"')),
        PLANT: b"no zip",
    }
    told = problems(changed(archives, tmp_path, **edits))
    assert len(told) == 2


def test_a_unit_that_means_something_else_is_refused(archives, tmp_path):
    other = swap(('<ssc:BaseUnit m="1"/>', '<ssc:BaseUnit m="1" factor="0.001"/>'))
    told = problems(changed(archives, tmp_path, **{SSD: other}))
    assert any("Connector passive_arm.eta.x: unit m does not match m" in problem for problem in told)
    fine = swap(('<ssc:Unit name="m">', '<ssc:Unit name="metre">'))
    renamed = lambda content: fine(content).replace(b'unit="m"', b'unit="metre"')  # noqa: E731
    with ssp_reader.opened(changed(archives, tmp_path, **{SSD: renamed})):
        pass


EXPERIMENTS = {
    'stopTime="84.0"': {
        'stopTime="NaN"': "to nan s",
        'stopTime="INF"': "give one by --stop-time",
        'stopTime="-1"': "to -1.0 s",
        "": "give one by --stop-time",
    },
    'baseStepSize="0.03"': {
        'baseStepSize="0"': "The step size is 0.0 s",
        'baseStepSize="-1"': "The step size is -1.0 s",
        'baseStepSize="abc"': "baseStepSize abc is no number",
        'baseStepSize="1e-12"': "expected at most 1e+07",
        'baseStepSize="99"': "shorter than a step",
    },
}


@pytest.mark.parametrize(("old", "new"), [(old, new) for old, cases in EXPERIMENTS.items() for new in cases])
def test_experiments_that_cannot_be_run_are_refused(archives, tmp_path, old, new):
    path = changed(archives, tmp_path, **{SSD: swap((old, new))})
    # Another stop time or step may be given, so a run refuses them, and reading none but what is no number.
    with pytest.raises(WiringError) as caught, ssp_reader.opened(path) as wiring:
        simulate(wiring)
    assert len(caught.value.problems) == 1
    assert EXPERIMENTS[old][new] in caught.value.problems[0]


def test_names_cannot_lead_out_of_the_folder(archives, tmp_path):
    outside = lambda content: content.replace(b'"rov_plant"', b'"../../rov_plant"')  # noqa: E731
    told = problems(changed(archives, tmp_path, **{SSD: outside}))
    assert any("The element name '../../rov_plant' is blank, or holds a slash" in problem for problem in told)
    assert not list(tmp_path.glob("rov_plant*"))


def test_two_elements_of_one_name_are_refused(archives, tmp_path):
    twice = swap(('<ssd:Component name="controller"', '<ssd:Component name="rov_plant"'))
    assert any(
        "There are 2 elements of the name rov_plant" in p for p in problems(changed(archives, tmp_path, **{SSD: twice}))
    )


def test_a_temporary_folder_that_pythonfmu_cannot_load_from_is_refused_for_its_fmus_alone(
    archives, python_archives, tmp_path, monkeypatch
):
    odd = tmp_path / "t#ü"
    odd.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(odd))
    with (
        pytest.raises(WiringError, match="set TMPDIR to another"),
        ssp_reader.opened(python_archives["station_keeping"]) as wiring,
    ):
        simulate(wiring, stop_time=0.3)
    with ssp_reader.opened(archives["station_keeping"]) as wiring:
        assert len(simulate(wiring, stop_time=0.3)) == 11


def test_what_is_no_archive_is_told(tmp_path):
    assert "There is no such archive" in problems(tmp_path / "none.ssp")[0]
    (tmp_path / "text.ssp").write_text("hello", encoding="utf-8")
    assert "not a readable SSP archive" in problems(tmp_path / "text.ssp")[0]


def test_parameters_bound_inline_and_at_the_system_are_read(archives, tmp_path):
    inline = (
        '<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version="1.0" name="x">'
        '<ssv:Parameters><ssv:Parameter name="controller.alpha"><ssv:Real value="3"/></ssv:Parameter>'
        '<ssv:Parameter name="rov_plant.dB"><ssv:Real value="4"/></ssv:Parameter></ssv:Parameters>'
        "</ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings><ssd:Elements>"
    )
    path = changed(archives, tmp_path, **{SSD: swap(("<ssd:Elements>", inline))})
    with ssp_reader.opened(path) as wiring:
        assert wiring.value("controller.alpha") == 3.0
        assert wiring.value("rov_plant.dB") == 4.0  # the outer level wins, as the standard says


def test_start_time_prefix_and_the_step_of_openmodelica_are_read(archives, tmp_path):
    other = swap(
        ('startTime="0.0"', 'startTime="5.0"'),
        ('source="resources/rov_plant.ssv"', 'source="resources/rov_plant.ssv" prefix="added_mass."'),
        ('<osp:FixedStepAlgorithm baseStepSize="0.03"/>', ""),
        ('stepSize="0.03"', 'stepSize="0.02"'),
    )
    values = b'<ssv:ParameterSet xmlns:ssv="%s" version="1.0" name="x"><ssv:Parameters><ssv:Parameter name="u">'
    values = values % NAMESPACES["ssv"].encode()
    values += b'<ssv:Real value="50"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>'
    with ssp_reader.opened(changed(archives, tmp_path, **{SSD: other, VALUES: values})) as wiring:
        assert (wiring.start_time, wiring.step_size, wiring.value("rov_plant.added_mass.u")) == (5.0, 0.02, 50.0)


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"controller.K_P.xx": "1"}, r"There is no variable controller\.K_P\.xx\. Did you mean controller\.K_P\.x"),
        ({"K_P.x": "1"}, r"There is no variable K_P\.x"),
        ({"controller.K_P.x": "many"}, r"controller\.K_P\.x: expected a number, got 'many'"),
        ({"controller.adaptation": "2"}, "expected true or false, got '2'"),
        ({"passive_arm.seed": "1.5"}, "expected a whole number of at most 2147483647, got '1.5'"),
        ({"rov_plant.mass": "nan"}, "expected a finite number"),
        ({"rov_plant.eta.x": "1"}, "is of causality output: only inputs and parameters can be set"),
        ({"rov_plant.u[1]": "1"}, r"is connected: its value comes from controller\.u\[1\]"),
    ],
)
def test_start_values_that_cannot_be_are_refused(fmus, values, reason):
    with pytest.raises(WiringError, match=reason):
        wire(SYSTEMS["station_keeping"], fmus).with_values(values)


def test_declarations_that_cannot_be_are_refused_with_every_reason(fmus):
    wrong = replace(
        SYSTEMS["station_keeping"],
        connections=(("rov_plant.eta", "controller.nu_m"), ("rov_plant.nu", "passive_arm.eta")),
        parameters={"controller": {"K_Q.x": 1.0}, "ghost": {"a": 1.0}},
    )
    with pytest.raises(WiringError) as caught:
        wire(wrong, fmus)
    assert len(caught.value.problems) == 4
