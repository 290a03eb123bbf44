"""The published vehicles: the files give back what was published, turned to its axes, and move as it says."""

import json
from pathlib import Path

import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssv
from scipy import signal
from scipy.spatial.transform import Rotation

from rig import Rig, inputs
from rov_cosim import systems
from rov_cosim.components.interface import VELOCITY
from rov_cosim.components.rov_plant import COMPONENT as PLANT
from rov_cosim.components.rov_plant import equations
from rov_cosim.exporters.model_description import describe, literal
from rov_cosim.ssp.parameter_set import read_parameter_set
from rov_cosim.ssp.writer import PARAMETER_SET
from rov_cosim.systems.fleet import VEHICLES
from typical import typical

FILES = {path.stem: path for path in (Path(systems.__file__).parent / "vehicles").glob("*.ssv")}
PUBLISHED = json.loads((Path(__file__).parent / "published_vehicles.json").read_text(encoding="utf-8"))
"""Facts as the sources have them: in their axes, about their origins."""

TO_PUBLISHED = {"front-right-down": Rotation.from_euler("x", np.pi), "front-left-up": Rotation.identity()}
OF_THE_EXPERIMENT = ("F_C.", "F_A.", "eta_0.", "nu_0.", "max_step", "thruster_dead_band")
DESCRIPTION = describe(PLANT)
VARIABLES = {variable.name: variable for variable in DESCRIPTION.modelVariables if variable.causality == "parameter"}
LIMITED = [name for name in PUBLISHED if "thruster_limit_N" in PUBLISHED[name]]


def values(vehicle):
    return read_parameter_set(FILES[vehicle], DESCRIPTION)


def rig(vehicle, **others):
    return Rig(PLANT, {**values(vehicle), **{name.replace("__", "."): value for name, value in others.items()}})


def turn(vehicle):
    """Return the matrix that takes vectors from our axes to the published ones, and that for wrenches."""
    R = TO_PUBLISHED[PUBLISHED[vehicle]["frame"]].as_matrix()
    return R, np.kron(np.eye(2), R)


def test_there_is_a_file_for_each_vehicle():
    assert set(FILES) == set(VEHICLES)
    assert {"hoang_kreuzer", *PUBLISHED} <= set(FILES)


@pytest.mark.parametrize("vehicle", FILES)
def test_a_file_holds_all_of_a_vehicle_and_nothing_of_an_experiment(vehicle):
    read = values(vehicle)
    assert set(read) == {name for name in VARIABLES if not name.startswith(OF_THE_EXPERIMENT)}
    by_fmpy = read_ssv(FILES[vehicle])  # which validates it
    assert by_fmpy.name == PARAMETER_SET
    for parameter in by_fmpy.parameters:
        declared = VARIABLES[parameter.name]
        assert (parameter.type, parameter.unit) == (declared.type, declared.unit), parameter.name
        # As the writer of archives has it, so that a number reads the same in both.
        assert parameter.value == literal(read[parameter.name], declared.type)


def test_the_papers_vehicle_is_the_default_one_but_for_its_buoyancy():
    defaults = {name: variable.start for name, variable in VARIABLES.items()}
    of_file = {name: literal(value, VARIABLES[name].type) for name, value in values("hoang_kreuzer").items()}
    assert {name: value for name, value in of_file.items() if value != defaults[name]} == {"dB": "17.0"}


@pytest.mark.parametrize("vehicle", PUBLISHED)
def test_mass_damping_and_places_are_those_published(vehicle):
    p, published = rig(vehicle).parameters(), PUBLISHED[vehicle]
    R, _ = turn(vehicle)
    assert (p.mass, p.g) == (published["mass_kg"], published["g"])
    for ours, theirs in (
        (p.added_mass, "added_mass"),
        (p.D_linear, "damping_linear"),
        (p.D_quadratic, "damping_quadratic"),
        (R @ p.r_G, "cg_m"),
        (R @ p.r_B, "cb_m"),
    ):
        assert ours == pytest.approx(published[theirs], abs=1e-15), theirs


@pytest.mark.parametrize("vehicle", PUBLISHED)
def test_the_mass_matrix_is_that_published(vehicle):
    published = PUBLISHED[vehicle]
    inertia = np.array(published["inertia_kgm2"])
    inertia = inertia if inertia.ndim == 2 else np.diag(inertia)
    x, y, z = published["mass_kg"] * np.array(published["cg_m"])
    coupling = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    expected = np.block([[published["mass_kg"] * np.eye(3), -coupling], [coupling, inertia]])
    expected = expected + np.diag(published["added_mass"])
    _, S = turn(vehicle)
    assert S @ equations.inertia(rig(vehicle).parameters()) @ S.T == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("vehicle", [name for name in PUBLISHED if name != "minerva"])
def test_the_buoyancy_is_that_published(vehicle):
    published = PUBLISHED[vehicle]
    if "volume_m3" in published:
        expected = (published["rho"] * published["volume_m3"] - published["mass_kg"]) * published["g"]
    else:
        expected = published["buoyancy_N"] - published["weight_N"]
    assert values(vehicle)["dB"] == pytest.approx(expected, abs=0.02)


def test_minerva_is_trimmed():
    assert values("minerva")["dB"] == 0  # as published it would be buoyant by 414 N


@pytest.mark.parametrize(
    ("vehicle", "tolerance"), [("bluerov2_heavy", 2e-4), ("bluerov2", 2e-4), ("rexrov", 1e-5), ("minerva", 5e-4)]
)
def test_the_allocation_is_that_published(vehicle, tolerance):
    allocation = np.array(PUBLISHED[vehicle]["allocation"])
    missing = np.zeros((6, 8 - allocation.shape[1]))
    _, S = turn(vehicle)
    B = S @ equations.thruster_wrenches(inputs(PLANT), rig(vehicle).parameters())
    assert pytest.approx(np.hstack([allocation, missing]), abs=tolerance) == B


@pytest.mark.parametrize("vehicle", PUBLISHED)
def test_the_thrusters_have_the_limit_and_the_lag_published_or_none(vehicle):
    p, published = rig(vehicle).parameters(), PUBLISHED[vehicle]
    assert p.thrust_max == published.get("thruster_limit_N", 0)
    if "thruster_transfer_function" in published:
        t, response = signal.step(tuple(published["thruster_transfer_function"]), T=np.linspace(0, 0.1, 1001))
        assert p.thruster_time_constant == pytest.approx(t[np.argmax(response > 1 - np.exp(-1))], abs=2e-4)
    else:
        assert p.thruster_time_constant == published.get("thruster_time_constant_s", 0)
    assert p.lock_roll_pitch == 0


@pytest.mark.parametrize("vehicle", FILES)
def test_umbilical_and_arm_act_where_the_default_vehicle_has_them_scaled(vehicle):
    def radius_of_gyration(p):
        return np.sqrt((p.I[2] + p.added_mass[5]) / (p.mass + p.added_mass[0]))

    p, default = rig(vehicle).parameters(), Rig(PLANT).parameters()
    scale = radius_of_gyration(p) / radius_of_gyration(default)
    assert p.r_C == pytest.approx(scale * default.r_C, abs=5e-4)
    assert p.r_A == pytest.approx(scale * default.r_A, abs=5e-4)


@pytest.mark.parametrize("axis", range(3), ids=["surge", "sway", "heave"])
@pytest.mark.parametrize("vehicle", typical(LIMITED, "bluerov2_heavy"))
def test_at_full_thrust_a_vehicle_reaches_the_speed_at_which_damping_balances_it(vehicle, axis):
    published = PUBLISHED[vehicle]
    full = published["thruster_limit_N"] * np.sign(published["allocation"][axis])
    thrust = full @ published["allocation"][axis]
    linear, quadratic = published["damping_linear"][axis], published["damping_quadratic"][axis]
    speed = (np.sqrt(linear**2 + 4 * quadratic * thrust) - linear) / (2 * quadratic)
    if vehicle == "bluerov2_heavy":
        assert speed == pytest.approx([0.73, 0.63, 0.72][axis], rel=0.01)
    bench = rig(vehicle, dB=0, lock_roll_pitch=1, max_step=0.1).start()
    bench.put("u", 2 * full)  # the limit holds it
    bench.run(60.0, 0.1)
    reached = np.zeros(6)
    reached[axis] = speed
    _, S = turn(vehicle)
    assert S @ bench.get("nu") == pytest.approx(reached, rel=1e-3, abs=1e-6)


@pytest.mark.parametrize("axis", ["roll", "pitch"])
@pytest.mark.parametrize("vehicle", typical(FILES, "bluerov2_heavy"))
def test_a_heeled_vehicle_swings_back_with_the_period_of_its_righting_moment(vehicle, axis):
    angle, sideways, i = {"roll": ("phi", 1, 3), "pitch": ("theta", 0, 4)}[axis]
    p = rig(vehicle).parameters()
    stiffness = p.mass * p.g * (p.r_B[2] - p.r_G[2])
    # Free to drift, the vehicle swings about another point than its origin, which takes off what its mass couples.
    inertia = p.I[i - 3] + p.added_mass[i] - (p.mass * p.r_G[2]) ** 2 / (p.mass + p.added_mass[sideways])
    quarter = np.pi / 2 * np.sqrt(inertia / stiffness)
    undamped = {f"D_{kind}__{rate}": 0.0 for kind in ("linear", "quadratic") for rate in VELOCITY}
    bench = rig(vehicle, dB=0, lock_roll_pitch=0, **undamped, **{f"eta_0__{angle}": 0.01}).start()
    bench.run(quarter, quarter / 100)
    assert bench.get(f"eta.{angle}") == pytest.approx(0.0, abs=3e-5)
    bench.run(quarter, quarter / 100)
    assert bench.get(f"eta.{angle}") == pytest.approx(-0.01, rel=0.01)
