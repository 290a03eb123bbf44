"""The check takes an FMU of FMI 3.0: with our names, with arrays of its own names, and with faults."""

import pytest

import typed
from rov_cosim.exporters import archive
from rov_cosim.exporters.build import components
from rov_cosim.handover import verdict
from rov_cosim.handover.check import CheckError
from typical import typical

COMPONENTS = components()

pytestmark = pytest.mark.usefixtures("references")


@pytest.mark.parametrize("name", typical(list(COMPONENTS), "scenario"))
def test_our_fmus_conform(fmi3_fmus, name):
    lines, conforms = verdict.judge(fmi3_fmus[name])
    assert conforms
    assert lines[-1].startswith(f"All {COMPONENTS[name].y.size} signals conform in ")


@pytest.fixture
def edited(fmi3_fmus, tmp_path):
    """Return what writes a copy of the scenario's FMU with some text of its description replaced."""

    def edit(*changes):
        content = archive.read(fmi3_fmus["scenario"])
        text = content["modelDescription.xml"].decode()
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        archive.write(tmp_path / "theirs.fmu", {**content, "modelDescription.xml": text.encode()})
        return tmp_path / "theirs.fmu"

    return edit


def map_of(factor=1):
    """Return a map for the array `flow` in the place of the current."""
    lines = [
        f'"flow[1]" = {{ ours = "current.x", factor = {factor} }}',
        '"flow[2]" = "current.y"',
        '"flow[3]" = "current.z"',
    ]
    return "\n".join(["[scenario.variables]", *lines])


def test_an_array_of_another_name_goes_by_numbers_in_a_map(edited, tmp_path):
    path = edited(('name="current"', 'name="flow"'))
    lines, conforms = verdict.judge(path, map_=typed.mapped(tmp_path, map_of()))
    assert conforms, lines
    lines, conforms = verdict.judge(path, map_=typed.mapped(tmp_path, map_of(-1)))
    assert not conforms
    told = {line.split()[0]: line for line in lines}
    assert told["current.x"].endswith("the sign is flipped")
    assert told["current.y"].endswith("conforms")


def test_an_array_of_another_name_is_missed_element_by_element_without_a_map(edited):
    path = edited(('name="current"', 'name="flow"'))
    with pytest.raises(CheckError, match=r"The FMU has no variable current\.x"):
        verdict.judge(path)


def test_other_start_values_and_units_are_told(edited):
    path = edited(
        (
            'valueReference="74" causality="parameter" start="1001"',
            'valueReference="74" causality="parameter" start="9"',
        ),
        (
            'initial="exact" unit="s" description="When the set-point steps"',
            'initial="exact" unit="N" description="When"',
        ),
    )
    lines, conforms = verdict.judge(path)
    assert not conforms
    assert "seed starts at 9; expected 1001." in lines
    assert "step_begin is declared in N; expected s." in lines


def test_what_an_fmu_refuses_is_told_in_its_words(edited, tmp_path):
    text = '[scenario.variables]\n"current_std.x" = { ours = "current_std.x", factor = -1 }\n'
    lines, conforms = verdict.judge(edited(), map_=typed.mapped(tmp_path, text))
    assert not conforms
    assert any("expected a finite number of at least 0" in line and "fmi3SetFloat64: 3" in line for line in lines)


def test_a_wrong_token_is_told_by_the_fmu(edited):
    with pytest.raises(CheckError, match="the model description is of another FMU"):
        verdict.judge(edited(('Token="{', 'Token="{0')))


def test_no_binary_for_this_machine_is_told(fmi3_fmus, tmp_path):
    content = {n: data for n, data in archive.read(fmi3_fmus["scenario"]).items() if not n.startswith("binaries/")}
    archive.write(tmp_path / "none.fmu", content)
    with pytest.raises(CheckError, match="has no binary for x86_64-linux, which is this machine: it has none"):
        verdict.judge(tmp_path / "none.fmu")


def test_a_run_refuses_it_in_a_line(fmi3_fmus, archives):
    done = typed.call("run", "station_keeping", "--swap", f"rov_plant={fmi3_fmus['rov_plant']}")
    assert done.exit_code == 1
    assert "is not an FMU for co-simulation with FMI 2.0: it is of FMI 3.0." in typed.one_line(done)
