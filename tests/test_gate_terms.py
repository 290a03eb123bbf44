"""The terms of a plant, weighed one by one: a sign that is turned anywhere in our plant's equations is told."""

import ast
import copy
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from test_campaign import written

from rov_cosim.components import frames, vehicle
from rov_cosim.components.rov_plant import COMPONENT, equations
from rov_cosim.exporters import native_export, zig
from rov_cosim.ssp.declaration import wire
from rov_cosim.study.gate import bench, conduct, newton, terms
from rov_cosim.study.settings import Settings
from rov_cosim.systems.catalogue import SYSTEMS
from typed import call

LOCKED, FREE = "station_keeping", "bluerov2"
AT_ONCE = 1e-7
"""Time in s over which the way of the pose is looked at."""
LATER = 0.01
"""Time in s in which a quick thruster has its force, and a slow one has none."""


def at_once(code):
    """Return what does as `bench.begun`, by the equations in a namespace, without a run."""

    def begun(plant, releases, settings):
        motions = []
        for release in releases:
            start = {f"eta_0.{axis}": value for axis, value in zip(terms.POSE, release.eta, strict=True)}
            start |= {f"nu_0.{axis}": value for axis, value in zip(terms.VELOCITY, release.nu, strict=True)}
            values = {**plant.start_values, **release.values, **start}
            p, u = (unpacked(layout, plant, values) for layout in (COMPONENT.p, COMPONENT.u))
            x = SimpleNamespace(**code["initial_state"](p))
            y = code["outputs_of"](x, u, p)
            pushed = code["thruster_wrenches"](u, p) @ code["lagged"](
                LATER, x.thrust, code["commanded_thrust"](u, p), p
            )
            z = code["rates"](x.eta, x.nu, pushed, code["inertia"](p), u, p)
            way = newton.displacement(x.eta + AT_ONCE * z[:6], x.eta) / AT_ONCE
            motions.append(bench.Motion(way, z[6:], y["nu"], y["tau"], y["disturbance"]))
        return motions

    return begun


def unpacked(layout, plant, values):
    """Return the inputs or parameters of the plant as its equations take them."""
    return layout.unpack(np.array([float(values.get(name, plant.value(name))) for name in layout.names]))


@pytest.fixture
def judged(fmus, monkeypatch):
    """Return what judges the plant of a system by equations in a namespace."""

    def judge(name, code):
        monkeypatch.setattr(terms, "begun", at_once(code))
        return terms.faults(wire(SYSTEMS[name], fmus), Settings())

    return judge


@pytest.mark.parametrize("name", [LOCKED, FREE, "bluerov2_heavy", "minerva", "rexrov"])
def test_nothing_is_said_of_a_plant_that_is_right(judged, name):
    assert judged(name, vars(equations)) == ()


def test_a_plant_that_runs_is_judged_as_its_equations_are(fmus):
    assert terms.faults(wire(SYSTEMS[LOCKED], fmus), Settings(isolate=True)) == ()


MODULES = {"frames": frames, "vehicle": vehicle, "equations": equations}
DYNAMICS = {
    "frames": ("skew", "rotation", "jacobian", "_block_diagonal"),
    "vehicle": ("mass_matrix", "coriolis", "wrench", "restoring", "allocation_matrix", "limited"),
    "equations": (
        "inertia",
        "unknown_forces",
        "resistance",
        "disturbance",
        "mobility",
        "rates",
        "commanded_thrust",
        "lagged",
        "thruster_wrenches",
        "outputs_of",
    ),
}


def signs(module):
    """Yield the tree of a module with one sign turned, and where: each sum, difference and minus of the dynamics."""
    tree = ast.parse(Path(MODULES[module].__file__).read_text(encoding="utf-8"))
    for i, node in enumerate(ast.walk(tree)):
        if not isinstance(node, ast.FunctionDef) or node.name not in DYNAMICS[module]:
            continue
        for j, inner in enumerate(ast.walk(node)):
            is_sum = isinstance(inner, ast.BinOp) and isinstance(inner.op, (ast.Add, ast.Sub))
            if is_sum or (isinstance(inner, ast.UnaryOp) and isinstance(inner.op, ast.USub)):
                other = copy.deepcopy(tree)
                twin = list(ast.walk(list(ast.walk(other))[i]))[j]
                twin.op = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.USub: ast.UAdd}[type(twin.op)]()
                yield other, f"{node.name}: {ast.unparse(inner)}"


def code_of(module, tree):
    """Return the equations as they are with a tree in the place of that of a module."""
    ours = {}
    for name, original in MODULES.items():
        source = Path(original.__file__).read_text(encoding="utf-8")
        own = {"__name__": original.__name__, "__package__": original.__package__}
        exec(compile(tree if name == module else source, original.__file__, "exec"), own)
        own.update({key: value for key, value in ours.items() if key in own and callable(value)})
        ours.update({key: value for key, value in own.items() if getattr(value, "__globals__", None) is own})
    return own


def mutants():
    """Return all by module and place; what stands twice in a function has a number."""
    found = {}
    for module in MODULES:
        for tree, where in signs(module):
            name, n = f"{module}.{where}", 2
            while name in found:
                name, n = f"{module}.{where} ({n})", n + 1
            found[name] = module, tree
    return found


MUTANTS = mutants()


@pytest.mark.parametrize("mutant", MUTANTS)
def test_each_sign_that_is_turned_is_told(judged, mutant):
    said = judged(FREE, code_of(*MUTANTS[mutant]))
    assert said
    assert all(line.startswith("rov_plant: ") for line in said)


@pytest.mark.parametrize(
    ("mutant", "line"),
    [
        ("rates: tau + unknown_forces(eta, u, p) - resistance(nu_r, M, p)", "D_linear.u, D_quadratic.u: acts the o"),
        ("rates: nu[0:3] - current", "current: acts the other way in X, Y, Z."),
        ("disturbance: -rotation(eta[3:6]).T", "output disturbance: acts the other way in X, Y, Z."),
        ("thruster_wrenches: 1.0 - u.thrust_loss", "output tau, thrust_loss: is"),
    ],
)
def test_the_line_names_term_and_axes(judged, mutant, line):
    assert any(one.startswith(f"rov_plant: {line}") for one in judged(FREE, code_of(*MUTANTS[f"equations.{mutant}"])))


@pytest.mark.parametrize(
    ("mutant", "line"),
    [
        ("restoring: r_G - r_B", "weight and buoyancy: is"),
        ("allocation_matrix: r[:, 2] * d[:, 0] - r[:, 0] * d[:, 2]", "output tau, thruster[5], thruster[6], thruster["),
        (
            "mass_matrix: np.concatenate([upper, lower], axis=0) + np.diag(added_mass)",
            "all forces: inertia is 2.126 where mass and added mass make it 16.1 in X.",
        ),
        ("coriolis: -skew(momentum[3:6])", "p, q, r times each other: acts the other way in K, M, N."),
    ],
)
def test_so_it_does_of_what_a_vehicle_is(judged, mutant, line):
    assert any(one.startswith(f"rov_plant: {line}") for one in judged(FREE, code_of(*MUTANTS[f"vehicle.{mutant}"])))


def test_of_a_plant_with_other_names_it_is_said_that_nothing_is_weighed(fmus):
    wiring = wire(SYSTEMS[LOCKED], fmus)
    others = tuple(element for element in wiring.elements if element.name != "rov_plant")
    assert terms.plant_in(wiring).name == "rov_plant"
    assert terms.faults(replace(wiring, elements=others, links=()), Settings()) is None


GATE = """\
troubles = ["still_water"]
[systems.theirs]
system = "station_keeping"
swaps = { rov_plant = "plant.fmu" }
"""


@pytest.mark.slow
def test_a_gate_is_red_by_a_plant_that_its_controller_holds_all_the_same(tmp_path):
    mutant = "equations.rates: tau + unknown_forces(eta, u, p) - resistance(nu_r, M, p)"
    wrong = code_of(*MUTANTS[mutant])["advance"]
    native_export.export(replace(COMPONENT, advance=wrong), tmp_path / "plant.fmu", [zig.host_platform()])
    done = call("gate", written(tmp_path, GATE), "--output", tmp_path)
    assert done.exit_code == 1
    assert "green  theirs, still_water: held" in done.output
    assert "red    theirs: rov_plant: D_linear.u, D_quadratic.u: acts the other way in X." in done.output
    assert done.output.splitlines()[-1] == "Error: gate some: red, 0 of 1 cells failed; wrong: theirs"
    other = call("gate", written(tmp_path, f"{GATE}terms = false\n"), "--output", tmp_path)
    assert other.output.splitlines()[-1] == "gate some: green, 1 of 1 cells passed"


def test_a_plant_that_cannot_be_weighed_is_told_and_the_rest_goes_on(fmus):
    weightless = wire(SYSTEMS["station_keeping"]).with_values({"rov_plant.mass": 0.0})
    (told,) = conduct._faults(weightless, Settings())
    assert told.startswith("its plant cannot be weighed, which `terms = false` leaves out: ZeroDivisionError")
