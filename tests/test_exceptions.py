"""The cells that another controller holds and the extended law does not: by which gains it does, and at what price."""

from collections.abc import Mapping

import pytest

from rov_cosim.components.adaptive_pd import COMPONENT as ADAPTIVE_PD
from rov_cosim.control.certificate import Certificate
from rov_cosim.control.tuning import Rule, Timing
from rov_cosim.master.simulation import simulate
from rov_cosim.ssp.declaration import wire
from rov_cosim.study.changes import Changes
from rov_cosim.study.looped import loop_of
from rov_cosim.study.scores import score
from rov_cosim.systems import fleet
from typed import ok

CURRENT = "varying_current_2"

FOLLOWING = {
    "hoang_kreuzer": (Rule(bandwidth=0.209, damping=1.1, adapted=0.57, integral=0.313), 0.13),
    "minerva": (Rule(bandwidth=0.24, damping=0.85, adapted=0.56, integral=0.29), 0.2),
}
"""Rule and T_f in s by which the extended law follows the current, by vehicle: those of FLEET.md."""

FLEETS = (fleet.RULE, float(fleet.EXTENSIONS["filter_time_constant"]))


def gains_of(vehicle: str, rule: Rule, filter_time_constant: float) -> dict[str, float]:
    """Return the gains of the extended law as start values."""
    gains = fleet.extended(ADAPTIVE_PD, fleet.parameters_of(vehicle), Timing(0.03, filter_time_constant), rule)
    return {f"controller.{name}": gain for name, gain in gains.items()}


def scored(vehicle: str, gains: Mapping[str, float], trouble: str):
    wiring = Changes(values=gains, troubles=(trouble,)).applied(wire(fleet.holding(vehicle, "extended")))
    return score(simulate(wiring), wiring)


@pytest.mark.parametrize("vehicle", FOLLOWING)
def test_certified_gains_follow_the_current_and_still_withstand_lagging_and_weak_thrusters(fmus, vehicle):
    gains = gains_of(vehicle, *FOLLOWING[vehicle])
    for conditions in Certificate("", loop_of(wire(fleet.holding(vehicle, "extended")).with_values(gains))).conditions:
        assert all(condition.holds for condition in conditions[-2:])
    for trouble in (CURRENT, "thruster_lag_long", "saturation"):
        assert scored(vehicle, gains, trouble).verdict == "held", trouble


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", FOLLOWING)
def test_tune_gives_these_gains(fmus, tmp_path, vehicle):
    path, (rule, filter_time_constant) = tmp_path / "gains.ssv", FOLLOWING[vehicle]
    figures = ("bandwidth", "damping", "adapted", "integral")
    options = [word for name in figures for word in (f"--{name}", getattr(rule, name))]
    ok(
        "tune",
        vehicle,
        "--controller",
        "extended",
        *options,
        "--filter-time-constant",
        filter_time_constant,
        "-o",
        path,
    )
    wiring = Changes(parameters=(path,)).applied(wire(fleet.holding(vehicle, "extended")))
    for name, gain in gains_of(vehicle, *FOLLOWING[vehicle]).items():
        assert wiring.value(name) == gain, name


@pytest.mark.parametrize("vehicle", FOLLOWING)
def test_the_mean_error_in_a_current_that_varies_is_as_one_over_the_integral_gain(fmus, vehicle):
    products = {}
    for rule, filter_time_constant in (FLEETS, FOLLOWING[vehicle]):
        integral = rule.integral * rule.omega(Timing(0.03, filter_time_constant)) ** 3  # K_I over the inertia
        found = scored(vehicle, gains_of(vehicle, rule, filter_time_constant), CURRENT)
        products[found.verdict] = integral * found.mean
    assert products["held"] == pytest.approx(products["offset"], rel=0.05)


def test_no_gains_of_one_vehicle_do_for_the_other(fmus):
    for vehicle, other, trouble in (
        ("minerva", "hoang_kreuzer", "saturation"),
        ("hoang_kreuzer", "minerva", CURRENT),
    ):
        assert scored(vehicle, gains_of(vehicle, *FOLLOWING[other]), trouble).verdict == "offset"
