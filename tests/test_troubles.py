"""What each trouble brings about."""

import numpy as np
import pytest

from rov_cosim.master.simulation import simulate
from rov_cosim.study.matrix import Cell, run_all, wired
from rov_cosim.study.nominal import DoesNotApplyError, Nominal
from rov_cosim.study.troubles import ONSET, TROUBLES
from rov_cosim.systems.fleet import VEHICLES
from typical import typical

VEHICLE = "bluerov2"
KINDS = (
    "current",
    "varying_current_1",
    "delay_5",
    "dropout",
    "coloured_noise",
    "wrong_mass",
    "thruster_lag",
    "thruster_dies",
)


@pytest.fixture(scope="module")
def papers(fmus):
    return wired(["hoang_kreuzer"], ["adaptive_pd"])["hoang_kreuzer", "adaptive_pd"]


@pytest.mark.parametrize("name", typical([name for name in TROUBLES if name != "still_water"], *KINDS))
def test_each_trouble_changes_the_run_and_repeats(loop, name):
    stop = ONSET + 5.0
    troubled = TROUBLES[name].applied(loop)
    runs = [simulate(wiring, stop_time=stop) for wiring in (loop, troubled, troubled)]
    assert np.array_equal(runs[1], runs[2])
    assert any(not np.array_equal(runs[0][field], runs[1][field]) for field in runs[0].dtype.names)


def changed_by(name, wiring):
    """Return the start values that a trouble changes, with those that they had."""
    ends = [f"{e.name}.{name}" for e in wiring.elements for name, v in e.variables.items() if v.causality != "output"]
    troubled = TROUBLES[name].applied(wiring)
    values = {end: (wiring.value(end), troubled.value(end)) for end in ends}
    return {end: (old, new) for end, (old, new) in values.items() if old != new}


K_P = {"x": 80.0, "y": 80.0, "z": 100.0}  # of the paper's vehicle
HEAVIER = {"rov_plant.mass": 120.0, "rov_plant.I.xx": 5.55, "rov_plant.I.yy": 9.45, "rov_plant.I.zz": 8.85}
AWAY = {axis: -gap / np.sqrt(0.2**2 + 0.5**2 + 0.4**2) for axis, gap in (("x", 0.2), ("y", 0.5), ("z", 0.4))}


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("still_water", {}),
        ("current", {"scenario.current_mean.x": 0.2, "scenario.current_mean.y": 0.1}),
        (
            "varying_current_2",
            {"scenario.current_mean.x": 0.1, "scenario.current_std.x": 0.1, "scenario.current_std.y": 0.1}
            | {"scenario.seed": 1002},
        ),
        ("arm_pull", {"passive_arm.stiffness": 0.3 * 80.0}),
        (
            "umbilical_steps",
            {f"scenario.pull[1].F.{a}": s * 0.1 * K_P[a] for a, s in (("x", 1), ("y", -1), ("z", 1))}
            | {f"scenario.pull[2].F.{a}": s * K_P[a] for a, s in (("x", -0.2), ("y", 0.1), ("z", -0.1))}
            | {"scenario.pull[1].begin": 60.0, "scenario.pull[2].begin": 90.0},
        ),
        ("thruster_lag", {"rov_plant.thruster_time_constant": 0.3}),
        ("thruster_lag_long", {"rov_plant.thruster_time_constant": 1.0}),
        # Holding takes 25 N of four vertical thrusters, 6.25 N each.
        ("saturation", {f"{element}.thrust_max": 1.25 * 6.25 for element in ("rov_plant", "controller")}),
        ("overload", {f"{element}.thrust_max": 0.8 * 6.25 for element in ("rov_plant", "controller")}),
        ("dead_band", {"rov_plant.thruster_dead_band": 0.5 * 6.25}),
        ("thruster_lost", {"rov_plant.thruster[1].enabled": False}),
        ("thruster_lost_known", {f"{element}.thruster[1].enabled": False for element in ("rov_plant", "controller")}),
        ("thruster_reversed", {"rov_plant.thruster[1].d.x": -np.sqrt(0.5), "rov_plant.thruster[1].d.y": np.sqrt(0.5)}),
        ("thruster_dies", {"scenario.thruster[1].loss": 1.0, "scenario.thrust_loss_begin": 60.0}),
        ("thruster_turns", {"scenario.thruster[1].loss": 2.0, "scenario.thrust_loss_begin": 60.0}),
        (
            "load_ramp",
            {f"scenario.pull[1].F.{a}": s * 0.15 * K_P[a] for a, s in (("x", 1), ("y", -1), ("z", -1))}
            | {"scenario.pull[1].begin": 60.0, "scenario.pull[1].rise": 240.0},
        ),
        (
            "picked_up",
            {"scenario.pull[1].F.z": -30.0, "scenario.pull[1].begin": 60.0, "rov_plant.mass": 96.0}
            | {"rov_plant.I.xx": 4.44, "rov_plant.I.yy": 7.56, "rov_plant.I.zz": 7.08},
        ),
        ("slow_samples", {"passive_arm.sample_time": 0.06, "controller.sample_time": 0.06}),
        (
            "turned_about",
            {"scenario.step.x": 0.4 - 0.4 * np.cos(3.4), "scenario.step.y": -0.4 * np.sin(3.4)}
            | {"scenario.step.psi": 3.4, "scenario.step_begin": 60.0},
        ),
        ("wrong_mass+thruster_lag", {**HEAVIER, "rov_plant.thruster_time_constant": 0.3}),
        (
            "wrong_mass",
            HEAVIER,
        ),
        ("wrong_r_A", {"controller.r_A.x": -0.4}),
        ("short_r_A", {"controller.r_A.x": 0.1}),
        ("wrong_r_C", {"controller.r_C.x": 0.4}),
        ("noise_2", {"passive_arm.noise_std": 0.01}),
        ("noise_4", {"passive_arm.noise_std": 0.02}),
        ("coloured_noise", {"passive_arm.noise_correlation_time": 2.0}),
        ("bias", {"passive_arm.bias.x": 0.02}),
        ("dropout", {"passive_arm.dropout": 0.1}),
        ("dropout_half", {"passive_arm.dropout": 0.5}),
        *((f"delay_{samples}", {"passive_arm.delay": samples}) for samples in range(1, 11)),
        *(
            (
                name,
                {f"scenario.pull[1].F.{a}": 1.5 * K_P[a] * AWAY[a] for a in "xyz"}
                | {f"scenario.pull[2].F.{a}": -1.5 * K_P[a] * AWAY[a] for a in "xyz"}
                | {"scenario.pull[1].begin": 60.0, "scenario.pull[2].begin": 60.0 + duration}
                | {f"scenario.pull[{i}].duration": duration for i in (1, 2)},
            )
            for name, duration in (("out_of_reach", 3.0), ("far_out_of_reach", 6.0))
        ),
        (
            "set_point_step",
            {"scenario.step.x": 0.3, "scenario.step.y": -0.2, "scenario.step.z": 0.2}
            | {"scenario.step.psi": 1.5708, "scenario.step_begin": 60.0},
        ),
        ("set_point_motion", {"scenario.motion.x": 0.1, "scenario.motion.z": 0.1, "scenario.motion.psi": 0.35}),
    ],
)
def test_a_trouble_is_what_its_description_says(papers, name, expected):
    changed = {end: new for end, (_, new) in changed_by(name, papers).items()}
    assert changed == pytest.approx(expected)


def test_the_other_troubles_are_for_vehicles_that_differ_from_the_papers(papers, loop):
    tested = test_a_trouble_is_what_its_description_says.pytestmark[0].args[1]
    others = {"paper_gains", "six_dof", "six_dof_tilted", "wrong_r_B", "varying_current_1", "varying_current_3"}
    single = {name for name in TROUBLES if "+" not in name}
    assert {name for name, _ in tested if "+" not in name} | others == single
    gains = changed_by("paper_gains", loop)
    assert {end.split(".")[1] for end in gains} == {"K_P", "K_D", "Gamma"}
    assert gains["controller.K_P.z"][1] == 100.0
    assert changed_by("six_dof", loop) == {"controller.control_roll_pitch": (False, True)}
    assert changed_by("wrong_r_B", loop) == {"controller.r_B.x": (0.0, pytest.approx(0.1 * 0.147))}
    tilted = changed_by("six_dof_tilted", loop)
    assert tilted["controller.control_roll_pitch"] == (False, True)
    assert np.degrees([tilted[f"scenario.step.{axis}"][1] for axis in ("phi", "theta")]) == pytest.approx(
        [10, -8], abs=0.3
    )
    for name, why in (("paper_gains", "changes nothing"), ("six_dof", "locked"), ("wrong_r_B", "locked")):
        with pytest.raises(DoesNotApplyError, match=why):
            TROUBLES[name].applied(papers)


def test_a_pair_is_both_of_its_troubles_at_once(papers):
    for name in (name for name in TROUBLES if "+" in name):
        first, second = (changed_by(part, papers) for part in name.split("+"))
        assert changed_by(name, papers) == {**first, **second}
        assert not set(first) & set(second)


def test_the_forces_are_the_same_whatever_controls_the_vehicle(loops):
    for name in ("far_out_of_reach", "load_ramp", "arm_pull"):
        values = [TROUBLES[name].values(Nominal(wiring)) for wiring in loops.values()]
        assert all(value == values[0] for value in values)


def test_a_reversed_thruster_runs_away_where_more_than_half_of_a_direction_is_its_own(fmus):
    # With the share h of the direction of its own thrust, reversed, the loop's gain in it is 1 - 2 h.
    loops = wired(list(VEHICLES), ["pid"])
    scores = run_all(loops, ["thruster_reversed"], jobs=2).scores
    for (vehicle, _), wiring in loops.items():
        r, d = (
            np.array([[wiring.value(f"rov_plant.thruster[{i}].{g}.{a}") for a in "xyz"] for i in range(1, 9)])
            for g in "rd"
        )
        on = np.array([wiring.value(f"rov_plant.thruster[{i}].enabled") for i in range(1, 9)])
        B = (np.hstack([d, np.cross(r, d)])[on] * [1, 1, 1, 0, 0, 1]).T
        h = (np.linalg.pinv(B) @ B)[0, 0]
        lost = scores[Cell(vehicle, "pid", "thruster_reversed")].verdict == "lost"
        assert lost == (1 - 2 * h < 0)


def test_the_limits_of_saturation_are_about_what_holding_takes(loop):
    at_rest = simulate(loop)[-2000:]
    needed = max(abs(at_rest[f"controller.u[{i}]"].mean()) for i in range(1, 9))
    for name, share in (("saturation", 1.25), ("overload", 0.8)):
        limit = TROUBLES[name].applied(loop).value("rov_plant.thrust_max")
        # At rest the vehicle is tilted a little, which the limit leaves out.
        assert limit == pytest.approx(share * needed, rel=0.05)


def test_pulls_are_worth_their_offset_of_a_pd_controller(loops):
    pd = TROUBLES["umbilical_steps"].applied(loops[VEHICLE, "pd"])
    results = simulate(pd, stop_time=ONSET + 30.0)
    time = results["time"]
    before, after = ((time > t - 5.0) & (time < t) for t in (ONSET, ONSET + 30.0))
    for axis, offset in (("x", 0.1), ("y", -0.1), ("z", 0.1)):
        eta = results[f"rov_plant.eta.{axis}"]
        assert eta[after].mean() - eta[before].mean() == pytest.approx(offset, abs=5e-3)


def test_the_arm_is_out_of_reach_for_a_while_and_comes_back(loop):
    results = simulate(TROUBLES["out_of_reach"].applied(loop), stop_time=100.0)
    away = results["time"][~results["passive_arm.attached"]]
    assert ONSET < away.min() < away.max() < 80.0


def test_a_trouble_of_what_a_loop_has_not_does_not_apply(loops):
    with pytest.raises(DoesNotApplyError, match=r"no controller\.r_A\.x, which the trouble is about"):
        TROUBLES["wrong_r_A"].applied(loops[VEHICLE, "pid"])
