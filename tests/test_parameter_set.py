"""Parameter sets outside an archive: read as they stand, and refused with every reason."""

import pytest

from rov_cosim.components.rov_plant import COMPONENT as PLANT
from rov_cosim.exporters.model_description import describe
from rov_cosim.ssp.parameter_set import read_parameter_set
from rov_cosim.ssp.strict_xml import STANDARD
from rov_cosim.ssp.wiring import WiringError

DESCRIPTION = describe(PLANT)


def written(folder, parameters, units=""):
    names = " ".join(f'xmlns:{prefix}="{STANDARD[prefix]}"' for prefix in ("ssv", "ssc"))
    path = folder / "plant.ssv"
    path.write_text(
        f'<ssv:ParameterSet {names} version="1.0" name="x"><ssv:Parameters>{parameters}</ssv:Parameters>'
        f"{units}</ssv:ParameterSet>",
        encoding="utf-8",
    )
    return path


def parameter(name, value, type_="Real", unit=None):
    attribute = f' unit="{unit}"' if unit else ""
    return f'<ssv:Parameter name="{name}"><ssv:{type_} value="{value}"{attribute}/></ssv:Parameter>'


def problems(path):
    with pytest.raises(WiringError) as caught:
        read_parameter_set(path, DESCRIPTION)
    assert all(line.startswith(f"{path}: ") for line in str(caught.value).splitlines())
    return caught.value.problems


def test_values_are_read_by_name_in_the_types_of_the_fmu(tmp_path):
    content = (
        parameter("mass", 12, "Integer")
        + "<!-- between -->"
        + parameter("r_G.z", "-0.02", unit="m").replace("<ssv:Real", "<!-- within --><ssv:Real")
        + parameter("lock_roll_pitch", "false", "Boolean")
    )
    values = read_parameter_set(written(tmp_path, content), DESCRIPTION)
    assert values == {"mass": 12.0, "r_G.z": -0.02, "lock_roll_pitch": False}
    assert [type(value) for value in values.values()] == [float, float, bool]


def test_a_unit_is_what_its_definition_says(tmp_path):
    base = '<ssv:Units><ssc:Unit name="metre"><ssc:BaseUnit m="1"{}/></ssc:Unit></ssv:Units>'
    content = parameter("r_G.z", 1.5, unit="metre")
    assert read_parameter_set(written(tmp_path, content, base.format("")), DESCRIPTION) == {"r_G.z": 1.5}
    scaled = written(tmp_path, content, base.format(' factor="0.001"'))
    assert read_parameter_set(scaled, DESCRIPTION) == {"r_G.z": 1.5e-3}
    other = written(tmp_path, content, base.replace('m="1"', 'kg="1"').format(""))
    assert problems(other) == ["Parameter rov_plant.r_G.z: unit metre does not match m."]
    assert problems(written(tmp_path, content)) == [
        "Parameter rov_plant.r_G.z: the unit metre is not defined; 1.5 is taken as it is."
    ]
    twice = written(tmp_path, content + parameter("r_G.x", 2, unit="metre"))
    assert problems(twice) == [
        "Parameter rov_plant.r_G.z: the unit metre is not defined; 1.5 is taken as it is. Likewise 1 more."
    ]


def test_all_problems_are_told_at_once(tmp_path):
    wrong = (
        parameter("mas", 1)
        + parameter("dB", 1)
        + parameter("dB", 2)
        + parameter("eta.x", 1)
        + parameter("g", "true", "Boolean")
        + parameter("thrust_max", 1, unit="kg")
        + parameter("r_B.x", "INF")
    )
    assert problems(written(tmp_path, wrong)) == [
        "Parameter dB stands twice in one parameter set: remove one.",
        "There is no parameter rov_plant.mas. Did you mean rov_plant.mass?",
        "rov_plant.eta.x cannot be set: it is neither a parameter nor an input, nor exact.",
        "Parameter rov_plant.g: type Boolean does not match Real.",
        "Parameter rov_plant.thrust_max: unit kg does not match N.",
        "Parameter rov_plant.r_B.x: expected a finite number, got 'INF'.",
    ]


def test_what_is_no_parameter_set_is_told(tmp_path):
    assert problems(tmp_path / "none.ssv") == ["There is no such file."]
    (tmp_path / "text.ssv").write_text("hello", encoding="utf-8")
    assert "not well-formed XML" in problems(tmp_path / "text.ssv")[0]
    assert "Gadget" in problems(written(tmp_path, "<ssv:Gadget/>"))[0]
    enumeration = parameter("mass", "heavy", "Enumeration").replace("/>", ' name="Weights"/>')
    assert problems(written(tmp_path, enumeration)) == [
        "Parameter rov_plant.mass: type Enumeration does not match Real."
    ]
