"""The published vehicles in the loop: the gains' rule, and that each vehicle is held as predicted."""

import numpy as np
import pytest

from rov_cosim.components.adaptive_pd import COMPONENT as CONTROLLER
from rov_cosim.components.vehicle import COUPLE, FORCES
from rov_cosim.control.certificate import Certificate
from rov_cosim.master.simulation import simulate
from rov_cosim.ssp.declaration import wire
from rov_cosim.ssp.wiring import WiringError
from rov_cosim.study.looped import loop_of
from rov_cosim.study.matrix import Cell, run_all, wired
from rov_cosim.systems import station_keeping
from rov_cosim.systems.fleet import CONTROLLERS, VEHICLES, WIRED, holding, parameters_of, tuning_of
from rov_cosim.systems.gains import EXTENSIONS
from typed import call
from typical import typical

PAPER = dict(zip(CONTROLLER.p.names, CONTROLLER.p.start.tolist(), strict=True))
TOTALS = {"x": 120.0, "y": 128.0, "z": 136.0, "psi": 14.7}
"""The paper's inertia, rigid body and added mass, in kg and kg m^2."""


def totals(vehicle):
    """Return the inertia by axis of the pose, written out from the vehicle's file."""
    p = parameters_of(vehicle)
    linear = {a: p["mass"] + p[f"added_mass.{b}"] for a, b in zip("xyz", "uvw", strict=True)}
    return {**linear, "psi": p["I.zz"] + p["added_mass.r"]}


def poles(K_P, K_D, M):
    return np.sort_complex(np.roots([M, K_D, K_P]))


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_the_closed_loop_has_the_papers_frequency_and_damping(vehicle):
    gains, M = holding(vehicle).parameters["controller"], totals(vehicle)
    for axis in ("z", "psi"):
        found = poles(gains[f"K_P.{axis}"], gains[f"K_D.{axis}"], M[axis])
        assert found == pytest.approx(poles(PAPER[f"K_P.{axis}"], PAPER[f"K_D.{axis}"], TOTALS[axis]), rel=1e-3)
    # In the earth frame surge and sway share their gains: those for the mean of the two ratios.
    mean = (M["x"] / TOTALS["x"] + M["y"] / TOTALS["y"]) / 2
    for gain in ("K_P.x", "K_P.y", "K_D.x", "K_D.y"):
        assert gains[gain] == pytest.approx(mean * PAPER[gain], rel=1e-3)


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_the_extended_law_has_the_bandwidth_of_its_lag_in_every_axis(vehicle):
    gains, M, p = holding(vehicle, "extended").parameters["controller"], totals(vehicle), parameters_of(vehicle)
    timing, rule = tuning_of("extended", vehicle)
    omega = rule.bandwidth / (2.5 * 0.03 + timing.filter_time_constant)
    M["x"] = M["y"] = (M["x"] + M["y"]) / 2
    gamma = {axis: sum(gains[f"Gamma.F_{point}.{axis}"] for point in "AC") for axis in "xyz"}
    gamma["z"] += gains["Gamma.dB"]
    gamma["psi"] = gains["Gamma.M.z"] + sum(
        gains[f"Gamma.F_{point}.{axis}"] * p[f"r_{point}.{lever}"] ** 2
        for point in "AC"
        for axis, lever in (("x", "y"), ("y", "x"))
    )
    for axis, share in (*((axis, rule.adapted) for axis in "xyz"), ("psi", 0.54)):
        assert gamma[axis] == pytest.approx(share * M[axis] * omega**2, rel=2e-3)
        stiffness = gains[f"K_P.{axis}"] + gamma[axis]
        assert gains[f"K_D.{axis}"] == pytest.approx(2 * rule.damping * np.sqrt(M[axis] * stiffness), rel=1e-3)
        if axis == "psi" and vehicle.startswith("bluerov2"):  # a current would turn them else
            assert 1.2 * M[axis] * omega**2 < stiffness < 4 * M[axis] * omega**2
        else:
            assert stiffness == pytest.approx(M[axis] * omega**2, rel=2e-3)
    assert gains["epsilon_0"] * rule.adapted == pytest.approx(rule.integral * omega, rel=1e-3)


@pytest.mark.parametrize("vehicle", typical([*VEHICLES, *WIRED], "bluerov2", "minerva"))
def test_the_theorem_certifies_the_extended_law_of_every_vehicle_but_minerva(fmus, vehicle):
    found = Certificate("", loop_of(wire(holding(vehicle, "extended"))))
    undamped, damped = (conditions[-1] for conditions in found.conditions)
    assert (undamped.margin > 0) == (vehicle != "minerva")
    assert (damped.largest > found.case.epsilon_0) == (vehicle != "minerva")


def test_the_extensions_are_off_in_the_papers_columns():
    for vehicle in VEHICLES:
        for controller in ("adaptive_pd", "pd"):
            system = holding(vehicle, controller)
            assert not set(system.parameters["controller"]) & set(EXTENSIONS)
            assert not any("eta_dot_d" in end for link in system.connections for end in link)


def test_the_papers_vehicle_has_the_papers_gains_and_loads():
    system = holding("hoang_kreuzer")
    gains = {name: value for name, value in system.parameters["controller"].items() if name[0] in "KG"}
    assert gains == pytest.approx({name: PAPER[name] for name in gains})
    assert len(gains) == 6 + 6 + len(FORCES) + len(COUPLE)
    experiment = station_keeping.SYSTEM.parameters["rov_plant"]
    assert {name: system.parameters["rov_plant"][name] for name in experiment} == experiment


@pytest.fixture(scope="module")
def loops(fmus):
    return wired(list(VEHICLES), CONTROLLERS)


@pytest.fixture(scope="module")
def still_water(loops):
    return run_all(loops, ["still_water"], jobs=2).scores


@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("controller", [name for name in CONTROLLERS if name != "pd"])
def test_every_vehicle_holds_in_still_water(still_water, vehicle, controller):
    score = still_water[Cell(vehicle, controller, "still_water")]
    assert score.verdict == "held"
    assert score.mean < 5e-3
    assert score.settling is not None


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_every_vehicle_has_the_predicted_offset_with_pd(loops, vehicle):
    wiring = loops[vehicle, "pd"]
    results = simulate(wiring, stop_time=120.0)
    last = results["time"] > 90.0
    force = dict(zip(FORCES, (wiring.value(f"rov_plant.{name}") for name in FORCES), strict=True))
    # At rest the thrusters give what the spring asks for, and that is all the unknown forces, whatever the attitude.
    for axis in "xyz":
        unknown = force[f"F_C.{axis}"] + force[f"F_A.{axis}"] + (force["dB"] if axis == "z" else 0.0)
        offset = unknown / wiring.value(f"controller.K_P.{axis}")
        assert results[f"rov_plant.eta.{axis}"][last].mean() == pytest.approx(offset, abs=1.5e-3)
        assert abs(offset) > 0.03


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_the_arm_reaches_the_structure_from_start_to_end(loops, vehicle):
    results = simulate(loops[vehicle, "adaptive_pd"], stop_time=60.0)
    assert results["passive_arm.attached"].all()


def test_a_faulty_vehicle_stops_its_own_systems_alone(archives, monkeypatch, tmp_path):
    def faulty(vehicle):
        raise WiringError(f"{vehicle}.ssv", ["There is no such file."])

    monkeypatch.setattr("rov_cosim.systems.fleet.parameters_of", faulty)
    for system, status in (("bluerov2_pid", 1), ("station_keeping", 0)):
        done = call("run", system, "--stop-time", "0.3", "--output", tmp_path)
        assert done.exit_code == status
    done = call("run", "bluerov2")
    assert done.output == "Error: bluerov2.ssv: There is no such file.\n"
