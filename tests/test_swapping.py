"""Another team's FMU in the place of an element: held by the unchanged controller, or refused with every reason."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description
from pythonfmu.builder import FmuBuilder

from fmu import with_units
from rov_cosim.components.vehicle import FORCES
from rov_cosim.exporters import archive
from rov_cosim.master.exchange import gauss_seidel
from rov_cosim.master.simulation import simulate
from rov_cosim.ssp import reader as ssp_reader
from rov_cosim.ssp import swap_map
from rov_cosim.ssp.declaration import System, wire
from rov_cosim.ssp.swap_map import Entry, SwapMap
from rov_cosim.ssp.swapping import swapped, with_swaps
from rov_cosim.ssp.wiring import Element, WiringError
from rov_cosim.study.assessment import axes, errors, report
from rov_cosim.study.changes import Changes
from rov_cosim.study.runs import run as run_system
from rov_cosim.study.settings import Settings
from rov_cosim.systems.catalogue import SYSTEMS
from rov_cosim.systems.fleet import holding
from typed import call

HERE = Path(__file__).parent
GUIDE = (HERE.parent / "systems" / "README.md").read_text(encoding="utf-8")
MAP, FLEET_LINES = re.findall(r"```toml\n(.*?)```", GUIDE.partition("## Bring your own plant")[2], re.S)
PUSH = {"north": 3.0, "east": -2.0, "down": 4.0}
UP = {"x": 3.0, "y": 2.0, "z": -4.0}  # the same with z up
STIFFNESS = {"x": 80.0, "y": 80.0, "z": 100.0}  # the controller's default
HEADING = 0.5  # rad, z up
EXACT = {
    **{f"rov_plant.push_{axis}": force for axis, force in PUSH.items()},
    **{f"controller.Gamma.{force}": 100.0 for force in FORCES},  # without an arm's force yaw is slow: a short run
    "passive_arm.noise_std": 0.0,
    "passive_arm.encoder_counts": 0,
}


@pytest.fixture(scope="module")
def foreign(tmp_path_factory) -> Path:
    return FmuBuilder.build_FMU(HERE / "fmus" / "foreign_rov.py", tmp_path_factory.mktemp("foreign"))


@pytest.fixture(scope="module")
def ned_plant(tmp_path_factory) -> Path:
    return FmuBuilder.build_FMU(HERE / "fmus" / "ned_plant.py", tmp_path_factory.mktemp("ned"))


def maps(tmp_path, *changes, text=MAP):
    """Return the maps of the guide's example, some of its text replaced."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "map.toml"
    path.write_text(text, encoding="utf-8")
    return swap_map.read(path)


def run(archives, fmus, maps, values=None, stop_time=120.0, system="station_keeping", **options):
    with ssp_reader.opened(archives[system]) as wiring:
        other = with_swaps(wiring, fmus, maps).with_values(values or {})
        return simulate(other, stop_time=stop_time, **options), other


def refused(archives, fmus, maps):
    with pytest.raises(WiringError) as caught:
        run(archives, fmus, maps)
    return caught.value.problems


def test_the_unchanged_controller_holds_a_vehicle_of_another_make(archives, foreign, tmp_path):
    values = {**EXACT, "controller.eta_d.psi": HEADING}
    results, wiring = run(archives, {"rov_plant": foreign}, maps(tmp_path), values)
    assert errors(results, wiring)[-1] == pytest.approx(np.zeros(6), abs=1e-3)
    assert results["rov_plant.heading"][-1] == pytest.approx(360 - np.degrees(HEADING), abs=0.1)
    assert results["rov_plant.east"][0] == -0.5  # the system's start, y to port
    assert results["rov_plant.heading"][0] == pytest.approx(360 - np.degrees(2.0))
    c, s = np.cos(HEADING), np.sin(HEADING)
    body = (c * UP["x"] + s * UP["y"], c * UP["y"] - s * UP["x"], UP["z"])
    assert [results[f"controller.disturbance.{axis}"][-1] for axis in "XYZ"] == pytest.approx(body, abs=0.05)


def test_without_adaptation_the_offset_is_the_push_by_the_stiffness(archives, foreign, tmp_path):
    results, wiring = run(
        archives, {"rov_plant": foreign}, maps(tmp_path), EXACT, 60.0, "station_keeping_pd", coupling=gauss_seidel
    )
    found = {axis.name: axis.final for axis in axes(results, wiring)}
    expected = {axis: UP[axis] / STIFFNESS[axis] for axis in UP}
    assert found == pytest.approx({**expected, "psi": 0.0}, abs=1e-4)


@pytest.mark.parametrize(
    "axis", ['depth = { ours = "eta.z", z_down = true', 'yaw = { ours = "controller.tau.N", z_down = true']
)
def test_a_wrong_sign_lets_the_vehicle_run_away(archives, foreign, tmp_path, axis):
    wrong = maps(tmp_path, (axis, axis.replace("true", "false")))
    results, wiring = run(archives, {"rov_plant": foreign}, wrong, EXACT, stop_time=20.0)
    assert np.abs(errors(results, wiring)[-1]).max() > 0.5


def test_declared_units_are_converted_as_stated_ones_are(archives, foreign, tmp_path):
    degree = {"deg": {"rad": "1", "factor": repr(np.pi / 180)}}
    declared = with_units(foreign, tmp_path / "declared.fmu", {"heading": "deg", "start_heading": "deg"}, degree)
    silent = maps(tmp_path, (', unit = "deg"', ""))
    by_declaration, _ = run(archives, {"rov_plant": declared}, silent, EXACT, 3.0)
    by_statement, _ = run(archives, {"rov_plant": foreign}, maps(tmp_path), EXACT, 3.0)
    assert np.array_equal(by_declaration, by_statement)
    by_both, _ = run(archives, {"rov_plant": declared}, maps(tmp_path), EXACT, 3.0)
    assert np.array_equal(by_both, by_statement)
    by_factor = maps(tmp_path, (', unit = "deg"', f", factor = {180 / np.pi!r}"))
    scaled, _ = run(archives, {"rov_plant": foreign}, by_factor, EXACT, 3.0)
    for name in by_statement.dtype.names:
        assert scaled[name] == pytest.approx(by_statement[name], abs=1e-9)


def test_a_unit_that_the_fmu_names_and_does_not_define_is_converted(archives, foreign, tmp_path):
    named = with_units(foreign, tmp_path / "named.fmu", {"heading": "deg", "start_heading": "deg"}, {"deg": None})
    by_name, _ = run(archives, {"rov_plant": named}, maps(tmp_path, (', unit = "deg"', "")), EXACT, 3.0)
    by_statement, _ = run(archives, {"rov_plant": foreign}, maps(tmp_path), EXACT, 3.0)
    assert np.array_equal(by_name, by_statement)


@pytest.mark.parametrize("element", ["rov_plant", "controller", "passive_arm"])
def test_an_fmu_with_our_names_needs_no_map_and_changes_nothing(archives, fmus, element):
    with ssp_reader.opened(archives["station_keeping"]) as wiring:
        expected = simulate(wiring, stop_time=3.0)
        told = []
        component = SYSTEMS["station_keeping"].elements[element]
        other = with_swaps(wiring, {element: fmus[component]}, {}, told.append)
        assert np.array_equal(simulate(other, stop_time=3.0), expected)
    assert told == []


def test_groups_pair_by_their_endings_with_the_signs_of_z_down(archives, ned_plant, tmp_path):
    text = """
        rov_plant.without = ["u", "F_arm"]
        [rov_plant.variables]
        pose = { ours = "eta", z_down = true }
        force = { ours = "controller.tau", z_down = true }
        [rov_plant.constants]
        nu = 0.0
    """
    values = {"controller.eta_d.z": 0.3, **{name: EXACT[name] for name in EXACT if "push" not in name}}
    values |= {f"rov_plant.push.{axis}": force for axis, force in zip("xyz", PUSH.values(), strict=True)}
    results, wiring = run(archives, {"rov_plant": ned_plant}, maps(tmp_path, text=text), values)
    assert errors(results, wiring)[-1] == pytest.approx(np.zeros(6), abs=1e-3)
    assert results["rov_plant.pose.z"][-1] == pytest.approx(-0.3, abs=1e-3)
    estimate = [results[f"controller.disturbance.{axis}"][-1] for axis in "XYZ"]
    assert estimate == pytest.approx(list(UP.values()), abs=0.05)


def test_factors_of_map_and_connection_multiply(plain_gain, tmp_path):
    system = System("pair", "", {"a": "gain", "b": "gain"}, (("a.y", "b.u", {"u": -2.0}),), 0.3, {"a": {"u": 1.0}})
    wiring = wire(system, {"gain": plain_gain})
    theirs = {name: Element(name, plain_gain, read_model_description(plain_gain)) for name in "ab"}
    assert simulate(wiring)["b.y"][-1] == 2 * (-2 * 3) + 1
    scaled_input = swapped(wiring, theirs["b"], SwapMap({"u": Entry("u", factor=4.0)}))
    assert simulate(scaled_input)["b.y"][-1] == 2 * (4 * -2 * 3) + 1
    scaled_output = swapped(wiring, theirs["a"], SwapMap({"y": Entry("y", factor=4.0), "u": Entry("u", factor=-1.0)}))
    assert simulate(scaled_output)["b.y"][-1] == 2 * (-2 * (2 * -1 + 1) / 4) + 1
    constant = swapped(wiring, theirs["a"], SwapMap(constants={"y": 5.0}))
    assert simulate(constant)["b.y"][-1] == 2 * (-2 * 5) + 1


def test_constants_reach_their_receivers(archives, foreign, tmp_path):
    told = maps(tmp_path, ("nu = 0.0", '"nu.u" = 0.25\nnu = 0.5'), ('"eta.phi" = 0.0', '"eta.phi" = 0.01'))
    _, wiring = run(archives, {"rov_plant": foreign}, told, stop_time=0.3)
    values = [wiring.value(end) for end in ("controller.nu_m.u", "controller.nu_m.v", "passive_arm.eta.phi")]
    assert values == [0.25, 0.5, 0.01]


def test_what_the_fmu_has_no_place_for_is_told_in_a_line(archives, foreign, tmp_path):
    told = []
    some = maps(tmp_path, ('yaw = { ours = "controller.tau.N", z_down = true }', ""))
    with ssp_reader.opened(archives["station_keeping"]) as wiring:
        with_swaps(wiring, {"rov_plant": foreign}, some, told.append)
    assert told == [
        "rov_plant: The map has no place for dB, F_C.*, F_A.*: the FMU's own values hold.",
        "rov_plant: Nothing feeds yaw of the FMU: the start value holds.",
    ]


def test_a_map_alone_says_which_parameters_go_to_a_stranger(archives, foreign, fmus, tmp_path):
    def of(fmu, text=None, values=None):
        told = []
        with ssp_reader.opened(archives["station_keeping"]) as wiring:
            heavy = wiring.with_values(values or {"rov_plant.mass": 200.0, "rov_plant.eta_0.z": 0.2})
            their = maps(tmp_path, text=text) if text is not None else {}
            return with_swaps(heavy, {"rov_plant": fmu}, their, told.append).elements[-1].start_values, told

    started, told = of(foreign, MAP)
    assert started["start_east"] == -0.5
    assert "mass" not in started
    assert told[0].startswith("rov_plant: The map has no place for dB, F_C.*, F_A.*, mass, eta_0.z: the FMU's own")
    started, _ = of(foreign, MAP.replace("[rov_plant.constants]", 'mass = "mass"\n[rov_plant.constants]'))
    assert started["mass"] == 200.0
    assert of(fmus["rov_plant"], "[rov_plant]\n")[0] == {}
    started, told = of(fmus["rov_plant"])
    assert (started["mass"], told) == (200.0, [])


def test_a_set_point_that_nothing_feeds_needs_no_entry_as_no_port_does(archives, fmus, tmp_path):
    values = {"controller.eta_d.z": 0.3, "controller.K_P.x": 1.0}
    with ssp_reader.opened(archives["station_keeping"]) as wiring:
        mapped = maps(tmp_path, text="[controller]")
        other = with_swaps(wiring.with_values(values), {"controller": fmus["adaptive_pd"]}, mapped)
        assert (other.value("controller.eta_d.z"), other.value("controller.K_P.x")) == (0.3, 80.0)


def test_start_values_without_a_place_are_told_by_group(archives, foreign, fmus, tmp_path):
    told = []
    names = [v.name for v in read_model_description(fmus["rov_plant"]).modelVariables if v.causality == "parameter"]
    with ssp_reader.opened(archives["station_keeping"]) as wiring:
        full = wiring.with_values({f"rov_plant.{name}": wiring.value(f"rov_plant.{name}") for name in names})
        with_swaps(full, {"rov_plant": foreign}, maps(tmp_path), told.append)
    (line,) = told
    listed = re.search("no place for (.*): the FMU's own values hold", line).group(1).split(", ")
    assert len(names) > 90
    assert len(listed) < 35
    assert {"mass", "g", "I.*", "thruster[*]", "eta_0.x", "thrust_max"} <= set(listed)  # of eta_0 y and psi are mapped


def test_z_down_turns_what_has_a_direction_alone(archives, fmus, tmp_path):
    keys = ("added_mass", "D_linear", "I", "r_G", "nu_0", "mass", "thruster")
    entries = "\n".join(f'{key} = {{ ours = "{key}", z_down = true }}' for key in keys)
    names = {"added_mass.v": 1, "D_linear.w": 1, "mass": 1, "I.yy": 1, "I.yz": 1, "I.xy": -1, "I.xz": -1}
    names |= {"r_G.y": -1, "r_G.x": 1, "nu_0.r": -1, "thruster[2].r.y": -1, "thruster[2].d.z": -1}
    with ssp_reader.opened(archives["station_keeping"]) as wiring:
        ones = wiring.with_values(
            {f"rov_plant.{name}": 1.0 for name in names} | {"rov_plant.thruster[1].enabled": False}
        )
        text = f"[rov_plant.variables]\n{entries}\n"
        other = with_swaps(ones, {"rov_plant": fmus["rov_plant"]}, maps(tmp_path, text=text))
        assert {name: other.value(f"rov_plant.{name}") for name in names} == names
        assert other.value("rov_plant.thruster[1].enabled") is False


def test_an_angle_whose_unit_nobody_tells_is_told_to_be_taken_as_ours(archives, foreign, tmp_path):
    def told(text):
        lines = []
        with ssp_reader.opened(archives["station_keeping"]) as wiring:
            with_swaps(wiring, {"rov_plant": foreign}, maps(tmp_path, text=text), lines.append)
            return [line for line in lines if "unit" in line]

    both = "rov_plant: The FMU declares no unit for heading, start_heading: taken as rad."
    assert told(MAP.replace(', unit = "deg"', "")) == [both]
    assert told(MAP) == told(MAP.replace('unit = "deg"', "factor = 57.3")) == []


def test_a_map_for_an_element_of_another_system_tells_the_elements_of_this_one(fmus, foreign, tmp_path):
    wiring = wire(holding("bluerov2"), fmus)
    strange = maps(tmp_path, ('"controller.tau.X"', '"regulator.tau.X"'), ('"controller.tau.Y"', '"adaptive_pd.tau.Y"'))
    with pytest.raises(WiringError) as caught:
        with_swaps(wiring, {"rov_plant": foreign}, strange)
    what = "but there is no element regulator in the system, which has scenario, passive_arm, controller, rov_plant."
    assert any(f"The map names regulator.tau.X, {what}" in problem for problem in caught.value.problems)
    cure = "There is no element adaptive_pd: adaptive_pd is the FMU of controller; write controller.tau.Y."
    assert f"rov_plant: The map names adaptive_pd.tau.Y. {cure}" in caught.value.problems


def test_an_unknown_element_is_told_before_the_map_that_is_left_over(archives, foreign, tmp_path):
    assert refused(archives, {"rovplant": foreign}, maps(tmp_path)) == [
        "There is no element rovplant. Did you mean rov_plant?",
        "The map is for rov_plant, which is not swapped.",
    ]


def test_a_controller_with_another_name_for_its_set_point_is_assessed_against_zero_and_it_is_told(
    archives, fmus, tmp_path
):
    content = archive.read(fmus["adaptive_pd"])
    text = content["modelDescription.xml"].replace(b'name="eta_d.', b'name="target.')
    archive.write(tmp_path / "renamed.fmu", {**content, "modelDescription.xml": text})
    renamed = run(archives, {"controller": tmp_path / "renamed.fmu"}, {}, stop_time=3.0)
    note = "No element has inputs eta_d: the errors are those from a set-point of 0."
    assert note in report(*renamed)
    assert note not in report(*run(archives, {}, {}, stop_time=3.0))


def test_several_elements_are_swapped_one_after_the_other(archives, fmus, foreign, tmp_path):
    results, wiring = run(
        archives, {"rov_plant": foreign, "controller": fmus["adaptive_pd"]}, maps(tmp_path), EXACT, 3.0
    )
    alone, _ = run(archives, {"rov_plant": foreign}, maps(tmp_path), EXACT, 3.0)
    assert np.array_equal(results, alone)
    assert [element.name for element in wiring.elements] == ["passive_arm", "controller", "rov_plant"]


def test_a_swap_leaves_the_system_as_it_was(archives, foreign, tmp_path):
    theirs = Element("rov_plant", foreign, read_model_description(foreign), {"mass": 90.0})
    with ssp_reader.opened(archives["station_keeping"]) as wiring:
        before = (wiring.links, [dict(element.start_values) for element in wiring.elements])
        other = swapped(wiring, theirs, maps(tmp_path)["rov_plant"])
        assert (wiring.links, [dict(element.start_values) for element in wiring.elements]) == before
        assert other.value("rov_plant.mass") == 90.0


def test_without_a_map_every_open_connection_is_told_with_the_cure(archives, foreign):
    assert refused(archives, {"rov_plant": foreign}, {}) == [
        f"rov_plant: The FMU has {what}: map it ([rov_plant.variables]) or {other}."
        for what, other in (
            (
                "nothing for eta.x, eta.y, eta.z, eta.phi, eta.theta, eta.psi, which passive_arm receives",
                "give a constant ([rov_plant.constants])",
            ),
            (
                "nothing for nu.u, nu.v, nu.w, nu.p, nu.q, nu.r, which controller receives",
                "give a constant ([rov_plant.constants])",
            ),
            ("no place for F_arm.x, F_arm.y, F_arm.z, which passive_arm feeds", "name it in [rov_plant] without"),
            (
                f"no place for {', '.join(f'u[{i}]' for i in range(1, 9))}, which controller feeds",
                "name it in [rov_plant] without",
            ),
        )
    ]


WRONG_SWAPS = {
    "unknown theirs": (
        'north = "eta.x"',
        'norht = "eta.x"',
        "The map names norht, which the FMU has not. Did you mean",
    ),
    "unknown ours": ('"eta.x"', '"eta.w"', "The map names eta.w, which is neither a variable of rov_plant nor an outp"),
    "unknown source": ('"controller.tau.X"', '"controller.tau.W"', "Did you mean controller.tau.Z"),
    "own output into input": ('"controller.tau.X"', '"tau.X"', "has surge, of causality input, for tau.X, of causal"),
    "input as source": (
        '"controller.tau.X"',
        '"controller.eta_d.x"',
        "controller.eta_d.x is of causality input, not",
    ),
    "parameter as target": ('surge = "cont', 'mass = "cont', "rov_plant.mass is of causality parameter, not input"),
    "ours twice": ('"eta.x"', '"eta.y"', "The map has eta.y twice: as north and as east."),
    "mapped and constant": ("nu = 0.0", 'nu = 0.0\n"eta.x" = 0.0', "has eta.x both as north and as left out"),
    "group for one": ('"eta.x"', '"eta"', "The map has north for eta, which has nothing for north."),
    "unknown constant": (
        "nu = 0.0",
        'nu = 0.0\n"nuu" = 0.0',
        "The map has nuu in constants, which is no output of ours",
    ),
    "unknown without": ('"F_arm"]', '"F_arms"]', "The map has F_arms in without, which is no input of ours. Did you"),
    "Boolean constant": ("nu = 0.0", "nu = true", "The constant True is not for nu.u, a Real."),
    "unit of what has none": (
        "start_east = {",
        'mass = { ours = "thruster[1].d.x", unit = "kg" }\nstart_east = {',
        "thruster[1].d.x has no unit that could be converted to the kg of mass: give a factor.",
    ),
    "wrong dimension": (
        'unit = "deg"',
        'unit = "mm"',
        "heading is in mm, to which no factor converts the rad of eta.psi",
    ),
}


@pytest.mark.parametrize("case", WRONG_SWAPS)
def test_a_wrong_map_is_refused_with_its_reason(archives, foreign, tmp_path, case):
    old, new, reason = WRONG_SWAPS[case]
    told = refused(archives, {"rov_plant": foreign}, maps(tmp_path, (old, new)))
    assert any(reason in problem for problem in told), told


def test_a_stated_unit_that_contradicts_the_declared_one_is_refused(archives, foreign, tmp_path):
    declared = with_units(foreign, tmp_path / "d.fmu", {"heading": "rad"}, {"rad": {"rad": "1"}})
    told = refused(archives, {"rov_plant": declared}, maps(tmp_path))
    assert told == ["rov_plant: The FMU declares heading in rad, and the map says deg."]


def test_a_variable_of_theirs_stands_for_one_of_ours_alone(archives, ned_plant, tmp_path):
    text = '[rov_plant.variables]\npose = "eta"\n"pose.x" = "eta_0.x"\n'
    assert "rov_plant: The map has pose.x twice." in refused(
        archives, {"rov_plant": ned_plant}, maps(tmp_path, text=text)
    )


def test_a_start_value_that_is_no_number_takes_no_factor(archives, fmus, tmp_path):
    text = '[controller.variables]\nadaptation = { ours = "adaptation", factor = -1 }\n'
    with pytest.raises(WiringError) as caught:
        run(archives, {"controller": fmus["adaptive_pd"]}, maps(tmp_path, text=text), system="station_keeping_pd")
    assert caught.value.problems == ["controller: adaptation, a Boolean, cannot be set as -1 of adaptation, a Boolean."]


def test_a_boolean_takes_no_factor_and_its_constant_is_one(archives, plain_gain, tmp_path):
    toml = '[passive_arm.variables]\nstarted = {{ ours = "eta_m_valid", factor = -1 }}\n[passive_arm.constants]\n{}'
    text = toml.format("eta_m = 0.0\nF_arm = 0.0\n")
    text += '[passive_arm]\nwithout = ["eta"]\n'
    told = refused(archives, {"passive_arm": plain_gain}, maps(tmp_path, text=text))
    assert told == [
        "Connection passive_arm.started -> controller.eta_m_valid: the factor -1 is not for a Boolean, or not finite."
    ]
    text = text.replace('started = { ours = "eta_m_valid", factor = -1 }', "")
    number, switch = (f"{text.replace('F_arm = 0.0', f'F_arm = 0.0{chr(10)}eta_m_valid = {v}')}" for v in ("1", "true"))
    told = refused(archives, {"passive_arm": plain_gain}, maps(tmp_path, text=number))
    assert told == ["passive_arm: The constant 1 is not for eta_m_valid, a Boolean."]
    _, wiring = run(archives, {"passive_arm": plain_gain}, maps(tmp_path, text=switch), stop_time=0.3)
    assert wiring.value("controller.eta_m_valid") is True


WRONG_TOML = {
    "x = 3": "x stands in no section: expected [ELEMENT], [ELEMENT.variables]",
    "= 3": "This is not TOML",
    '[a.variabels]\nb = "c"': "[a] variabels: unknown; expected variables, constants, without. Did you mean variables?",
    '[a]\nwithout = "u"': "[a] without: expected a list of names.",
    "[a]\nwithout = [1]": "[a] without: expected names in quotes, got 1.",
    "[a]\nvariables = 1": "[a] variables: expected a table.",
    "[a.variables]\nb = 1": '[a.variables] b: expected "OURS" or { ours = "OURS", ... }, got 1.',
    '[a.variables]\nb.x = "c"': "a name with a dot in it needs quotes",
    '[a.variables]\nb = { ours = "c", factor = 0 }': "[a.variables] b: factor = 0: expected a finite number that",
    '[a.variables]\nb = { ours = "c", factor = inf }': "factor = inf: expected a finite number",
    '[a.variables]\nb = { ours = "c", factor = true }': "factor = True: expected a finite number",
    '[a.variables]\nb = { ours = "c", unit = "furlong" }': "unit = 'furlong' is not known; expected one of m, s, kg",
    '[a.variables]\nb = { ours = "c", z_down = 1 }': "z_down = 1: expected true or false",
    '[a.variables]\nb = { ours = "c", sign = -1 }': "sign is unknown; expected ours, factor, unit or z_down",
    '[a.variables]\nb = { ours = "c", unit = ["m"] }': "unit = ['m'] is not known; expected one of m, s, kg",
    '[a.variables]\nb = { ours = "c", unit = {a = 1} }': "unit = {'a': 1} is not known; expected one of m, s, kg",
    f'[a.variables]\nb = {{ ours = "c", factor = 1{"0" * 400} }}': "0: expected a finite number that is not 0",
    f"[a.constants]\nb = 1{'0' * 400}": "0: expected a finite number",
    f"[a.constants]\nb = 1{'0' * 5000}": "This is not TOML",
    "[a.constants]\nb = nan": "[a] constants: b = nan: expected a finite number, true or false",
    '[a.constants]\nb = "c"': "b = 'c': expected a finite number",
    "[a.constants]\nb.x = 1": "a name with a dot in it needs quotes",
}


@pytest.mark.parametrize("text", WRONG_TOML)
def test_a_file_that_is_no_map_is_refused_with_its_reason(tmp_path, text):
    with pytest.raises(WiringError) as caught:
        maps(tmp_path, text=text)
    assert any(WRONG_TOML[text] in problem for problem in caught.value.problems), caught.value.problems


def test_everything_wrong_with_a_map_file_is_told_at_once(tmp_path):
    with pytest.raises(WiringError) as caught:
        maps(
            tmp_path,
            text='[a]\nwith = 1\n[a.variables]\nb = { ours = "c", factor = 0, unit = "x" }\n[b]\nconstants = 1',
        )
    assert len(caught.value.problems) == 4


def sets(values):
    return [part for name, value in values.items() for part in ("--set", f"{name}={value}")]


def test_the_command_runs_the_guides_example(archives, foreign, tmp_path):
    (tmp_path / "map.toml").write_text(MAP, encoding="utf-8")
    swap = ("--swap", f"rov_plant={foreign}", "--map", tmp_path / "map.toml")
    done = call("run", "station_keeping", *swap, *sets(EXACT), "--output", tmp_path)
    assert done.exit_code == 0, done.output
    assert "warning: rov_plant: The map has no place for dB, F_C.*, F_A.*: the FMU's own values hold." in done.output
    table = {line.split()[0]: line.split() for line in done.output.splitlines() if line.endswith(("mm", "deg"))}
    assert set(table) >= {"x", "y", "z", "psi"}
    assert all(abs(float(table[axis][2])) < 5.0 for axis in "xyz")
    (picture,) = tmp_path.glob("station_keeping+rov_plant=ForeignRov-*.png")
    assert picture.read_bytes().startswith(b"\x89PNG")
    done = call(
        "compare", "station_keeping", "station_keeping_pd", *swap, "--stop-time", 0.3, "--output", tmp_path / "c.png"
    )
    assert done.exit_code == 0, done.output


def test_python_swaps_as_the_command_does(archives, foreign, tmp_path):
    (tmp_path / "map.toml").write_text(MAP)
    changes = Changes({"rov_plant": foreign}, swap_map.read(tmp_path / "map.toml"))
    done = run_system(SYSTEMS["station_keeping"], changes, settings=Settings(stop_time=0.3), folder=tmp_path)
    assert "rov_plant.depth" in done.results.dtype.names


def test_what_cannot_be_swapped_ends_with_a_line_for_each_reason(archives, fmus, foreign, plain_gain, tmp_path):
    (tmp_path / "no.fmu").write_text("hello", encoding="utf-8")
    (tmp_path / "map.toml").write_text(MAP, encoding="utf-8")
    map_ = ("--map", tmp_path / "map.toml")
    for arguments, reason in (
        (["--swap", foreign], "expected ELEMENT=FMU, got"),
        (["--swap", "a=b", "--swap", "a=c"], "a stands twice, as b and as c: leave one out"),
        (["--swap", "rov_plant=none.fmu"], "rov_plant: none.fmu is not a readable FMU"),
        (["--swap", f"rov_plant={tmp_path / 'no.fmu'}"], "no.fmu is not a readable FMU"),
        (["--swap", f"rov_plnt={foreign}"], "There is no element rov_plnt. Did you mean rov_plant?"),
        (list(map_), "--map tells how the FMUs of --swap take their places: name one by --swap."),
        (["--swap", f"controller={fmus['adaptive_pd']}", *map_], "The map is for rov_plant, which is not swapped."),
        (
            ["--swap", f"adaptive_pd={fmus['adaptive_pd']}"],
            "There is no element adaptive_pd: adaptive_pd is the FMU of controller; write controller.",
        ),
        (["--swap", f"rov_plant={foreign}", "--map", tmp_path / "none.toml"], "none.toml"),
        (["--swap", f"rov_plant={foreign}", *map_, "--set", "rov_plant.dB=1"], "There is no variable rov_plant.dB"),
    ):
        done = call("run", "station_keeping", *arguments, "--output", tmp_path)
        assert done.exit_code != 0, arguments
        assert reason in done.output
        assert "Traceback" not in done.output
        assert isinstance(done.exception, SystemExit)


@pytest.mark.slow
def test_a_vehicle_of_another_make_gets_the_same_table(fmus, foreign, tmp_path):
    text = MAP
    for line in FLEET_LINES.splitlines():  # each takes the place of the line that begins as it does
        text, times = re.subn(
            rf"^{re.escape(line.split(' =')[0])}( =.*)?$", lambda _, line=line: line, text, flags=re.M
        )
        assert times == 1, line
    (tmp_path / "map.toml").write_text(text, encoding="utf-8")
    some = [f"--trouble={name}" for name in ("still_water", "noise_2", "delay_3", "current", "arm_pull", "dead_band")]
    some += ["--vehicle=hoang_kreuzer", "--jobs=2", "--set=rov_plant.push_north=4"]
    swap = [f"--swap=rov_plant={foreign}", f"--map={tmp_path / 'map.toml'}"]
    done = call("matrix", *some, *swap, f"--output={tmp_path}")
    assert done.exit_code == 0, done.output
    assert done.output.count("has no place for") == 1  # told once, not for every controller
    (table,) = tmp_path.glob("matrix+hoang_kreuzer+*.csv")
    with open(table, encoding="utf-8") as file:
        rows = {(row["controller"], row["trouble"]): row for row in csv.DictReader(file)}
    # What it does not listen to does not apply: current, the arm's pull, a dead band of our thrusters.
    assert {trouble for _, trouble in rows} == {"still_water", "noise_2", "delay_3"}
    for trouble in ("still_water", "noise_2", "delay_3"):
        assert rows["adaptive_pd", trouble]["verdict"] == rows["pid", trouble]["verdict"] == "held"
        assert rows["pd", trouble]["verdict"] == "offset"
        assert float(rows["pd", trouble]["mean"]) == pytest.approx(4 / STIFFNESS["x"], abs=1e-3)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a = " + "[" * 5000 + "]" * 5000, "nested too deeply for a map"),
        ("[rov_plant.variables]\na = " + "[" * 80 + "]" * 80, 'expected "OURS" or'),
        ("[rov_plant.constants]\nnu = 0x" + "f" * 5000, "nu = what cannot be shown: expected a finite number"),
        (f"[rov_plant.variables]\na = {{ ours = 'eta', factor = 0x{'f' * 5000} }}", "factor = what cannot be shown"),
        ("[rov_plant.constants]\nnu = " + "9" * 5000, "This is not TOML"),
    ],
)
def test_a_map_that_no_line_can_show_is_refused_in_a_line(tmp_path, text, reason):
    (tmp_path / "map.toml").write_text(text, encoding="utf-8")
    with pytest.raises(WiringError, match=re.escape(reason)) as caught:
        swap_map.read(tmp_path / "map.toml")
    assert max(len(problem) for problem in caught.value.problems) < 400


def test_a_swap_by_a_relative_path_lasts_when_the_folder_changes(fmus, tmp_path, monkeypatch):
    (tmp_path / "their.fmu").write_bytes(fmus["rov_plant"].read_bytes())
    monkeypatch.chdir(tmp_path)
    swapped_ = with_swaps(wire(SYSTEMS["station_keeping"], fmus), {"rov_plant": Path("their.fmu")}, {})
    monkeypatch.chdir("/")
    assert len(simulate(swapped_, stop_time=0.3)) == 11


@pytest.mark.parametrize(
    ("old", "new"), [(b'fmiVersion="2.0"', b'fmiVersion="1.0"'), (b"CoSimulation", b"ModelExchange")]
)
def test_an_fmu_of_another_kind_is_refused(fmus, tmp_path, old, new):
    content = archive.read(fmus["rov_plant"])
    content["modelDescription.xml"] = content["modelDescription.xml"].replace(old, new)
    archive.write(tmp_path / "other.fmu", content)
    with pytest.raises(WiringError, match="is not a"):
        with_swaps(wire(SYSTEMS["station_keeping"], fmus), {"rov_plant": tmp_path / "other.fmu"}, {})
