"""The taut wire in the arm's place: the paper's vehicle held by it, the fleet's loads and troubles."""

import numpy as np
import pytest

from rov_cosim.master.simulation import simulate
from rov_cosim.ssp.declaration import wire
from rov_cosim.study.matrix import wired
from rov_cosim.study.nominal import DoesNotApplyError
from rov_cosim.study.scores import score
from rov_cosim.study.troubles import TROUBLES
from rov_cosim.systems.catalogue import SYSTEMS
from rov_cosim.systems.fleet import LOOPS, WIRED, holding, tuning_of
from typed import call

NAME = "station_keeping_taut_wire"
ATTITUDE = ("phi", "theta", "psi")
NO_DRIFT = {f"taut_wire.attitude_drift_std.{axis}": 0.0 for axis in ATTITUDE}


@pytest.fixture(scope="module")
def wiring(fmus):
    return wire(SYSTEMS[NAME])


@pytest.fixture(scope="module")
def wired_loops(fmus):
    return wired(list(WIRED), ["adaptive_pd", "extended"])


@pytest.mark.parametrize("seed", range(1, 6))
def test_the_vehicle_is_held_within_10_mm_and_1_deg(wiring, seed):
    found = score(simulate(wiring.with_values({"taut_wire.seed": seed})), wiring)
    assert found.settling < 50.0
    assert found.worst < 0.010
    assert found.worst_yaw < np.radians(1.0)


def test_an_error_of_the_compass_turns_the_vehicle_and_shifts_it_by_the_lever_of_the_attachment(wiring):
    still = score(simulate(wiring.with_values(NO_DRIFT)), wiring)
    assert still.mean < 2e-3
    results = simulate(wiring.with_values({**NO_DRIFT, "taut_wire.attitude_bias.psi": 0.03}))
    hold = results["time"] > 70.0
    # Measured, the vehicle is in place; so it is turned back by 0.03, and the lever (0.7, -0.5) turns the place along.
    for axis, expected, close in (("x", 0.5 * 0.03, 2e-3), ("y", 0.7 * 0.03, 2e-3), ("psi", -0.03, 7e-3)):
        assert results[f"rov_plant.eta.{axis}"][hold].mean() == pytest.approx(expected, abs=close)


def test_the_paper_systems_arm_is_swapped_for_the_wire_by_its_fmu_alone(fmus, tmp_path):
    done = call("run", "station_keeping", "--swap", f"passive_arm={fmus['taut_wire']}", "--output", tmp_path)
    assert done.exit_code == 0, done.output
    (path,) = tmp_path.glob("*.csv")
    results = np.genfromtxt(path, delimiter=",", names=True, deletechars="", dtype=None, encoding=None)
    assert results["passive_arm.tension"] == pytest.approx(8.0)
    assert np.abs(results["rov_plant.eta.y"][results["time"] > 70.0]).max() < 0.01


def test_both_exports_give_the_same_run(wiring, python_fmus):
    python = wire(SYSTEMS[NAME], python_fmus)
    one, other = (simulate(w, stop_time=3.0) for w in (wiring, python))
    for name in one.dtype.names:
        assert one[name] == pytest.approx(other[name], abs=1e-9), name


def test_the_winch_of_the_fleet_pulls_in_the_place_of_the_arms_force(wired_loops):
    for (vehicle, controller), loop in wired_loops.items():
        assert not any(loop.value(f"rov_plant.F_A.{axis}") for axis in "xyz")
        mass = [loop.value(f"rov_plant.{name}") for name in ("mass", "added_mass.u", "added_mass.v")]
        ratio = (2 * mass[0] + mass[1] + mass[2]) / (120.0 + 128.0)
        assert loop.value("taut_wire.winch_tension") == pytest.approx(8.0 * ratio, rel=1e-3)
        by_arm = holding(WIRED[vehicle], controller).parameters["controller"]
        by_wire = {e.name: e for e in loop.elements}["controller"].start_values
        assert by_arm.keys() <= by_wire.keys()
        if tuning_of(controller, vehicle) == tuning_of(controller, WIRED[vehicle]):
            assert by_arm.items() <= by_wire.items()


@pytest.mark.parametrize("vehicle", WIRED)
def test_the_extended_law_holds_a_vehicle_of_the_fleet_by_the_wire(wired_loops, vehicle):
    loop = wired_loops[vehicle, "extended"]
    results = simulate(loop)
    found = score(results, loop)
    assert found.settling < 25.0
    assert found.worst < 0.010
    assert found.worst_yaw < np.radians(1.0)
    assert results["taut_wire.taut"].all()
    assert results["taut_wire.attached"].all()


def test_troubles_of_the_measurement_come_by_the_wire(wired_loops):
    loop = wired_loops["hoang_kreuzer_taut_wire", "adaptive_pd"]
    for trouble, name, value in (
        ("delay_4", "delay", 4),
        ("dropout", "dropout", 0.1),
        ("noise_2", "length_noise_std", 2 * loop.value("taut_wire.length_noise_std")),
        ("noise_4", "attitude_noise_std.psi", 4 * loop.value("taut_wire.attitude_noise_std.psi")),
        ("coloured_noise", "noise_correlation_time", 2.0),
        ("slow_samples", "sample_time", 0.06),
    ):
        assert TROUBLES[trouble].applied(loop).value(f"taut_wire.{name}") == pytest.approx(value)
    for trouble, what in (("arm_pull", "stiffness"), ("bias", "bias.x")):
        with pytest.raises(DoesNotApplyError, match=rf"no taut_wire\.{what}"):
            TROUBLES[trouble].applied(loop)


def test_what_holding_takes_counts_the_tension_of_the_wire(wired_loops):
    loop = wired_loops["hoang_kreuzer_taut_wire", "extended"]
    at_rest = simulate(loop, stop_time=120.0)[-1000:]
    needed = max(abs(at_rest[f"controller.u[{i}]"].mean()) for i in range(1, 9))
    limit = TROUBLES["saturation"].applied(loop).value("rov_plant.thrust_max")
    assert limit == pytest.approx(1.25 * needed, rel=0.05)


def test_a_wired_vehicle_with_a_controller_that_it_has_not_is_refused():
    done = call("matrix", "--vehicle", next(iter(WIRED)), "--controller", "pd")
    assert done.exit_code == 2
    assert "no system with such a controller" in done.output
    assert (next(iter(WIRED)), "pd") not in LOOPS
