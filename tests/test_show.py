"""What `rov-cosim show` says of a system and of its elements' variables."""

from pathlib import Path

import pytest
from fmpy import extract, read_model_description

from rov_cosim.cli.description import element_lines, joined, system_lines
from rov_cosim.ssp import reader as ssp_reader
from rov_cosim.ssp.swap_map import stem
from rov_cosim.ssp.wiring import Element, End, Link, Wiring
from typed import call

WIDTH = 120


def show(*arguments, width=WIDTH):
    done = call("show", *arguments, env={"COLUMNS": str(width)})
    assert done.exception is None or isinstance(done.exception, SystemExit)
    return done


def rows(*arguments, **options):
    """Return the words of each line by its first, of a table that is wide enough not to be wrapped."""
    done = show(*arguments, width=400, **options)
    assert done.exit_code == 0, done.output
    return {line.split()[0]: " ".join(line.split()[1:]) for line in done.output.splitlines() if line}


def test_a_system_is_shown_by_its_elements_and_connections(archives):
    done = show("bluerov2_pid")
    assert done.exit_code == 0, done.output
    lines = done.output.splitlines()
    assert lines[0].startswith("bluerov2_pid: ")
    assert [line.split()[:2] for line in lines if line.startswith("controller ")] == [["controller", "pid"]]
    assert "controller.u[1..8] -> rov_plant.u[1..8]" in lines
    assert "rov_plant.nu.u/v/w/p/q/r -> controller.nu_m.u/v/w/p/q/r" in lines
    assert "passive_arm.eta_m_valid -> controller.eta_m_valid" in lines


@pytest.mark.parametrize("archived", [False, True])
def test_an_element_is_shown_by_its_variables(archives, archived):
    found = rows(archives["bluerov2"] if archived else "bluerov2", "rov_plant")
    assert found["u[1..8]"] == "N <- controller.u Thruster force command"
    assert found["nu.u/v/w/p/q/r"] == "m/s, rad/s -> controller.nu_m Velocity of the vehicle in the body frame"
    assert found["mass"] == "kg 11.5* Dry mass of the vehicle"
    assert found["r_G.x/y/z"] == "m 0 0 -0.02* Centre of gravity in the body frame"
    assert found["thruster[1..8].enabled"] == "Boolean true tunable Whether the thruster works"
    assert found["dB/F_C.x/F_C.y/F_C.z/F_A.x/F_A.y/F_A.z"].startswith(
        "N 2* 0.4134* -0.4961* 0 0 -0.8268* ... (7) tunable"
    )


def test_a_value_that_is_set_is_shown_and_marked(archives):
    found = rows("station_keeping", "controller", "--set", "controller.K_P.x=120", "--set", "controller.eta_d.z=0.3")
    assert found["K_P.x/y/z/phi/theta/psi"].startswith("N/m, N.m/rad 120* 80 100 30 30 30 tunable Proportional gain")
    assert found["eta_d.x/y/z/phi/theta/psi"] == "m, rad 0 0 0.3* 0 0 0 Set-point in the earth frame"


def test_every_variable_of_every_element_is_in_a_row_of_its_own_or_of_its_group(archives):
    with ssp_reader.opened(archives["bluerov2"]) as wiring:
        for element in wiring.elements:
            lines = [*element_lines(wiring, element, "", 1000)]
            names = [name for line in lines for name in line.split("  ")[0].split("/")]
            assert {stem(variable) for variable in element.variables} <= {stem(name) for name in names}


def test_the_largest_tables_fit_the_screen(archives):
    done = show("station_keeping", "controller")
    assert len(done.output.splitlines()) <= 80
    for width in (80, WIDTH):
        for element in ("passive_arm", "controller", "rov_plant"):
            assert max(map(len, show("station_keeping", element, width=width).output.splitlines())) <= width


def test_search_looks_into_names_and_meanings_of_all_elements_whatever_the_case(archives):
    output = show("bluerov2", "--search", "SEED").output
    assert [line.split(":")[0] for line in output.splitlines() if ": " in line] == ["scenario", "passive_arm"]
    assert "seed " in output
    assert "mass" in rows("bluerov2", "controller", "--search", "dry MASS")
    assert "thruster[2].r.x/y/z" in rows("bluerov2", "--search", "rov_plant.thruster[2].r")
    assert "adaptive_pd" not in show("station_keeping", "rov_plant", "--search", "mass").output


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--search", "no such thing"], "Nothing in bluerov2 has 'no such thing' in its name or meaning."),
        (["rov_plant", "--search", "K_P"], "Nothing in rov_plant has 'K_P' in its name or meaning."),
        (
            ["rovplant"],
            "bluerov2 has no element rovplant. Did you mean rov_plant? It has scenario, passive_arm, contro",
        ),
    ],
)
def test_what_is_not_there_is_told_in_a_line(archives, arguments, reason):
    done = show("bluerov2", *arguments)
    assert done.exit_code == (1 if "--search" in arguments else 2)
    (line,) = (text for text in done.output.splitlines() if text.startswith("Error: "))
    assert reason in line


@pytest.fixture
def foreign(plain_gain, tmp_path):
    """Return a system of two FMUs that describe nothing."""
    folder = Path(extract(plain_gain, tmp_path / "gain"))
    a, b = (Element(name, folder, read_model_description(folder)) for name in "ab")
    return Wiring("pair", (a, b), (Link(End("a", "y"), End("b", "u"), -2.0),), 1.0, 0.1)


def test_an_fmu_without_descriptions_is_shown_all_the_same(foreign):
    lines = [*element_lines(foreign, foreign.elements[1], "", WIDTH)]
    assert lines[0] == "b (PlainGain): no description"
    assert [line.split() for line in lines if line.startswith(("u ", "gain "))] == [
        ["u", "<-", "a.y,", "times", "-2"],
        ["gain", "2", "tunable"],
    ]
    assert "a.y -> b.u, times -2" in [*system_lines(foreign, WIDTH)]
    assert not [*element_lines(foreign, foreign.elements[1], "none of them", WIDTH)]


@pytest.mark.parametrize(
    ("names", "one"),
    [
        (["mass"], "mass"),
        (["eta.x", "eta.y", "eta.psi"], "eta.x/y/psi"),
        (["u[1]", "u[2]", "u[3]"], "u[1..3]"),
        (["u[0]", "u[1]"], "u[0..1]"),
        (["u[2]", "u[4]"], "u[2/4]"),
        (["t[1].r.x", "t[1].r.y", "t[2].r.x", "t[2].r.y"], "t[1..2].r.x/y"),
        (["t[1].x", "t[2].y"], "t[1].x/t[2].y"),
        (["h.dB", "h.F.x", "h.F.y"], "h.dB/F.x/F.y"),
        (["dB", "F.x", "F.y"], "dB/F.x/F.y"),
        (["a", "a.b"], "a/b"),
        (["der(x.y)", "der(x.z)"], "der(x.y)/z)"),
        (["..", "[x"], "../[x"),
    ],
)
def test_names_are_folded_where_they_are_all_combinations(names, one):
    assert joined(names) == one
