"""Vehicles with a tuning of their own: what it is for, its price; and a cell that no gains hold."""

import numpy as np
import pytest

from rov_cosim.components.adaptive_pd import COMPONENT as ADAPTIVE_PD
from rov_cosim.components.interface import SAMPLE_TIME
from rov_cosim.control.certificate import Certificate
from rov_cosim.master.simulation import simulate
from rov_cosim.ssp.declaration import wire
from rov_cosim.study.assessment import in_hold
from rov_cosim.study.changes import Changes
from rov_cosim.study.looped import loop_of
from rov_cosim.study.scores import OFFSET, score
from rov_cosim.systems.fleet import TUNING, TUNINGS, WIRED, Tuning, holding, parameters_of, tuning_of
from rov_cosim.systems.gains import extended
from typed import ok

CURRENT = "varying_current_2"
HELD = {"hoang_kreuzer": CURRENT, "minerva": CURRENT, "bluerov2_heavy_taut_wire": "wrong_r_B"}
"""What the tuning of a vehicle is for."""


def scored(vehicle: str, tuning: Tuning, trouble: str):
    """Return how the extended law does by a tuning."""
    gains = extended(ADAPTIVE_PD, parameters_of(WIRED.get(vehicle, vehicle)), *tuning)
    values = {f"controller.{name}": gain for name, gain in gains.items()}
    wiring = Changes(values=values, troubles=(trouble,)).applied(wire(holding(vehicle, "extended")))
    return score(simulate(wiring), wiring)


@pytest.mark.parametrize("vehicle", TUNINGS)
def test_gains_of_ones_own_hold_what_the_fleets_do_not_and_still_withstand_lagging_and_weak_thrusters(fmus, vehicle):
    assert scored(vehicle, TUNING, HELD[vehicle]).verdict in ("offset", "oscillates")
    for trouble in (HELD[vehicle], "thruster_lag_long", "saturation"):
        assert scored(vehicle, tuning_of("extended", vehicle), trouble).verdict == "held", trouble


@pytest.mark.parametrize("vehicle", TUNINGS)
def test_they_leave_seven_samples_of_delay(fmus, vehicle):
    found = Certificate("", loop_of(wire(holding(vehicle, "extended"))))
    assert found.level.is_stable
    assert found.common_margin.delay > 7 * SAMPLE_TIME


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", sorted(TUNINGS.keys() - WIRED.keys()))
def test_the_command_gives_these_gains_by_itself_and_by_their_figures(fmus, tmp_path, vehicle):
    timing, rule = TUNINGS[vehicle]
    figures = ("bandwidth", "damping", "adapted", "integral")
    options = [word for name in figures for word in (f"--{name}", getattr(rule, name))]
    options += ["--filter-time-constant", timing.filter_time_constant]
    for path, further in ((tmp_path / "own.ssv", []), (tmp_path / "given.ssv", options)):
        ok("tune", vehicle, "--controller", "extended", *further, "-o", path)
        wiring = Changes(parameters=(path,)).applied(wire(holding(vehicle, "extended")))
        for name, gain in holding(vehicle, "extended").parameters["controller"].items():
            assert wiring.value(f"controller.{name}") == gain, name


@pytest.mark.parametrize("vehicle", sorted(TUNINGS.keys() - WIRED.keys()))
def test_the_mean_error_in_a_current_that_varies_is_as_one_over_the_integral_gain(fmus, vehicle):
    products = {}
    for tuning in (TUNING, TUNINGS[vehicle]):
        integral = tuning.rule.integral * tuning.rule.omega(tuning.timing) ** 3  # K_I over the inertia
        found = scored(vehicle, tuning, CURRENT)
        products[found.verdict] = integral * found.mean
    assert products["held"] == pytest.approx(products["offset"], rel=0.05)


def test_no_tuning_of_one_vehicle_does_for_the_other(fmus):
    assert scored("minerva", TUNINGS["hoang_kreuzer"], "saturation").verdict == "offset"
    assert scored("hoang_kreuzer", TUNINGS["minerva"], "thruster_lag_long").verdict == "oscillates"


@pytest.mark.parametrize(("vehicle", "tuning"), [("hoang_kreuzer_taut_wire", t) for t in (TUNING, *TUNINGS.values())])
def test_what_is_off_by_the_wire_is_the_measurement_whatever_the_gains(fmus, vehicle, tuning):
    system = holding(vehicle, "extended")
    gains = extended(ADAPTIVE_PD, parameters_of("hoang_kreuzer"), *tuning)
    values = {f"controller.{name}": gain for name, gain in gains.items()}
    wiring = Changes(values=values, troubles=("slow_samples",)).applied(wire(system))
    results = simulate(wiring)
    held = results[in_hold(results)]
    true, measured = (
        np.array([held[f"{group}.{axis}"].mean() for axis in "xyz"]) for group in ("rov_plant.eta", "taut_wire.eta_m")
    )
    assert score(results, wiring).verdict == "offset"
    assert np.abs(measured).max() < 0.1e-3  # there: the set-point is 0
    assert np.abs(measured - true).max() > OFFSET["y"]
