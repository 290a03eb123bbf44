"""Gains by the rule: what they promise by hand, as a file from the command to a run, and vehicles that hold by them."""

import re
from collections import Counter
from contextlib import nullcontext, suppress
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from rov_cosim.components.adaptive_pd import COMPONENT as ADAPTIVE_PD
from rov_cosim.components.interface import Sampled, Signal, switch, vector
from rov_cosim.components.pid import COMPONENT as PID
from rov_cosim.control.certificate import Certificate
from rov_cosim.control.loop import LoopError
from rov_cosim.control.tuning import Rule, Timing, TuningError, tuned
from rov_cosim.master.simulation import simulate
from rov_cosim.ssp.declaration import wire
from rov_cosim.ssp.writer import values_set
from rov_cosim.study.changes import Changes
from rov_cosim.study.looped import loop_of
from rov_cosim.study.scores import score
from rov_cosim.systems import fleet
from rov_cosim.systems.fleet import VEHICLES, parameters_of
from rov_cosim.systems.gains import EXTENSIONS, extended, inertia
from typed import call, ok, one_line

INERTIA = np.array([120.0, 128.0, 136.0, 9.2, 15.7, 14.7])
OMEGA = 0.2 / (2.5 * 0.03 + 0.1)
SCALED = ("mass", "I.", "added_mass.")


def learned(gains, r_A=0.4):
    """Return the diagonal of W Gamma W^T in x, y, z and yaw, by the lever of the default vehicle and the couple."""
    g = {name.removeprefix("Gamma."): value for name, value in gains.items() if name.startswith("Gamma.")}
    z = g["dB"] + g["F_C.z"] + g["F_A.z"]
    return np.array([g["F_C.x"] + g["F_A.x"], g["F_C.y"] + g["F_A.y"], z, r_A**2 * g["F_A.y"] + g["M.z"]])


def test_the_gains_are_those_of_the_rule():
    gains = tuned(ADAPTIVE_PD, INERTIA)
    M = np.array([124.0, 124.0, 136.0, 14.7])
    K_P = np.array([gains[f"K_P.{axis}"] for axis in ("x", "y", "z", "psi")])
    K_D = np.array([gains[f"K_D.{axis}"] for axis in ("x", "y", "z", "psi")])
    assert K_P + learned(gains) == pytest.approx(M * OMEGA**2, rel=1e-3)
    assert pytest.approx(2 * 0.7 * M * OMEGA, rel=1e-3) == K_D
    assert gains["epsilon_0"] * learned(gains) == pytest.approx(OMEGA / 10 * M * OMEGA**2, rel=1e-3)


def test_the_pid_has_the_same_stiffness_and_integral_gain():
    gains, adaptive = tuned(PID, INERTIA), tuned(ADAPTIVE_PD, INERTIA)
    assert gains["K_P.z"] == pytest.approx(adaptive["K_P.z"] + learned(adaptive)[2], rel=1e-3)
    assert gains["K_I.z"] == pytest.approx(adaptive["epsilon_0"] * learned(adaptive)[2], rel=1e-3)
    assert gains["K_D.z"] == adaptive["K_D.z"]


def test_the_bandwidth_falls_with_every_lag():
    timing = Timing(0.05, 0.2, 0.3, 3)
    assert timing.lag == pytest.approx(5.5 * 0.05 + 0.5)
    gains = tuned(PID, INERTIA, timing=timing, rule=Rule(0.1, 1.0))
    assert gains["K_P.z"] == pytest.approx(136 * (0.1 / timing.lag) ** 2, rel=1e-3)
    assert gains["K_D.z"] == pytest.approx(2 * 136 * 0.1 / timing.lag, rel=1e-3)


def controller_with_couples(W):
    """Return a controller that estimates as W says, with couples among what it estimates."""
    n = W.shape[1]
    names = tuple(str(i) for i in range(n))
    poses = ("x", "y", "z", "phi", "theta", "psi")
    return Sampled(
        name="couples",
        title="",
        description="",
        symbol="",
        inputs=(switch("eta_m_valid", ""),),
        outputs=(vector("disturbance", poses, ""),),
        parameters=(
            vector("K_P", poses, ""),
            vector("K_D", poses, ""),
            vector("Gamma", names, ""),
            Signal("epsilon_0", "", maximum=1.0),
            switch("control_roll_pitch", ""),
            Signal("sample_time", "", start=0.03),
        ),
        states=(vector("theta_hat", names, ""),),
        initial_state=lambda p: {"theta_hat": np.zeros(n)},
        sample=lambda x, u, p, w: ({"theta_hat": x.theta_hat}, {"disturbance": W @ x.theta_hat}),
    )


def test_a_couple_makes_up_for_what_the_lever_leaves():
    forces = np.concatenate([np.eye(6)[:, :3], np.eye(6)[:, :3]], axis=1)
    forces[5, 1] = 0.4
    W = np.concatenate([forces, np.eye(6)[:, 3:]], axis=1)
    gains = tuned(controller_with_couples(W), INERTIA)
    gamma = np.array([gains[f"Gamma.{i}"] for i in range(9)])
    M = np.array([124.0, 124.0, 136.0, 0, 0, 14.7])
    assert gains["epsilon_0"] * (W**2 @ gamma) == pytest.approx(OMEGA / 10 * M * OMEGA**2, rel=1e-3)
    assert gamma[6] == gamma[7] == 0  # roll and pitch are not controlled


def test_long_levers_do_not_stiffen_the_yaw_beyond_the_rule():
    gains = tuned(ADAPTIVE_PD, INERTIA, {"r_A.x": 3.0, "r_C.x": 3.0})
    assert gains["K_P.psi"] > 0.7 * 14.7 * OMEGA**2


def test_what_cannot_be_tuned_is_refused():
    with pytest.raises(TuningError, match=r"leave no K_P beside what adaptive_pd adapts"):
        tuned(ADAPTIVE_PD, INERTIA, rule=Rule(bandwidth=3.0))
    bare = replace(PID, parameters=tuple(s for s in PID.parameters if s.key != "K_P"))
    with pytest.raises(TuningError, match="no gains K_P and K_D"):
        tuned(bare, INERTIA)


def scaled(vehicle, factor):
    """Return a vehicle with another inertia and the same weight."""
    plant = dict(parameters_of(vehicle))
    values = {name: float(value) * factor for name, value in plant.items() if name.startswith(SCALED)}
    return {**plant, **values, "g": float(plant["g"]) / factor}


def crate():
    """Return an invented vehicle: a long heavy crate whose thrusters lag."""
    values = {**scaled("hoang_kreuzer", 1.0), "mass": 300.0, "I.xx": 20.0, "I.yy": 60.0, "I.zz": 70.0}
    values |= {"added_mass.u": 60.0, "added_mass.v": 350.0, "added_mass.w": 400.0, "added_mass.r": 60.0}
    return values | {"r_A.x": 0.55, "r_C.z": 0.5, "thruster_time_constant": 0.1, "dB": -40.0}


def pod():
    """Return an invented vehicle: a small pod whose arm sits at its side, free to tilt."""
    values = {**scaled("hoang_kreuzer", 1.0), "mass": 25.0, "I.xx": 0.5, "I.yy": 0.7, "I.zz": 0.8}
    values |= {f"added_mass.{axis}": m for axis, m in zip("uvwpqr", (12, 14, 20, 0.4, 0.5, 0.6), strict=True)}
    values |= {f"D_linear.{axis}": d for axis, d in zip("uvwpqr", (8, 10, 12, 1, 1, 1), strict=True)}
    return values | {"r_A.x": 0.1, "r_A.y": 0.2, "r_C.z": 0.1, "dB": 3.0, "lock_roll_pitch": False}


def file_of(folder, plant):
    """Return a vehicle's file."""
    wiring = wire(fleet.holding("hoang_kreuzer"))
    path = folder / "mine.ssv"
    named = {f"rov_plant.{name}": value for name, value in plant.items()}
    path.write_bytes(values_set(wiring, named, "nominal", "").replace(b'name="rov_plant.', b'name="'))
    return path


def holds(wiring, **gains):
    """Tell how a vehicle holds, in still water and in a current."""
    changed = [Changes(**gains, troubles=troubles).applied(wiring) for troubles in ((), ("current",))]
    return [score(simulate(one), one).verdict for one in changed]


@pytest.mark.parametrize("plant", [crate(), pytest.param(pod(), marks=pytest.mark.slow)], ids=["crate", "pod"])
def test_a_new_vehicle_holds_at_the_first_try(fmus, tmp_path, plant):
    vehicle, gains = file_of(tmp_path, plant), tmp_path / "gains.ssv"
    for controller in ("adaptive_pd", "extended"):
        ok("tune", vehicle, "--controller", controller, "-o", gains)
        assert holds(wire(fleet.holding(str(vehicle), controller)), parameters=(gains,)) == ["held", "held"]


def with_gains(folder, plant, controller, rule):
    """Return the system of a vehicle's file, and gains by a rule as start values."""
    wiring = wire(fleet.holding(str(file_of(folder, plant)), controller))
    timing = Timing(
        filter_time_constant=float(wiring.value("controller.filter_time_constant")),
        thruster_time_constant=float(plant["thruster_time_constant"]),
    )
    gains = fleet.tuned_for(controller, plant, timing, rule)
    return wiring, {f"controller.{name}": gain for name, gain in gains.items()}


@pytest.mark.slow
@pytest.mark.parametrize("controller", ["adaptive_pd", "extended", "pid"])
@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("vehicle", VEHICLES)
def test_every_vehicle_holds_at_the_first_try(fmus, tmp_path, vehicle, factor, controller):
    wiring, gains = with_gains(tmp_path, scaled(vehicle, factor), controller, fleet.tuning_of(controller).rule)
    assert holds(wiring, values=gains) == ["held", "held"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("vehicle", "factor", "controller"),
    [
        ("bluerov2_heavy", 0.5, "adaptive_pd"),  # the drag, learned as the arm's force
        ("bluerov2_heavy", 2.0, "extended"),  # roll and pitch, which follow the yaw
        ("bluerov2", 1.0, "pid"),  # the Munk moment
    ],
)
def test_a_vehicle_sways_in_a_current_that_takes_the_stiffness_of_its_yaw(fmus, tmp_path, vehicle, factor, controller):
    plant, rule, current = scaled(vehicle, factor), fleet.tuning_of(controller).rule, float(np.hypot(0.2, 0.1))
    for bare in (True, False):
        wiring, gains = with_gains(tmp_path, plant, controller, replace(rule, current=0.0) if bare else rule)
        changed = Changes(values=gains).applied(wiring)
        in_current = Changes(troubles=("current",)).applied(changed)
        assert (Certificate("", loop_of(changed)).current_limit < current) == bare
        assert score(simulate(in_current), in_current).verdict == ("oscillates" if bare else "held")
        with suppress(LoopError) if bare else nullcontext():  # none: no pose at which it could rest
            unstable = [m.axis for m in Certificate("", loop_of(in_current)).linear.modes() if abs(m.eigenvalue) > 1]
            assert ("psi" in unstable) == bare


@pytest.mark.slow
def test_without_what_a_current_takes_eight_of_eighteen_sway(fmus, tmp_path):
    """With it none does: see `test_every_vehicle_holds_at_the_first_try`."""
    verdicts = []
    for vehicle, factor in product(("bluerov2_heavy", "bluerov2"), (0.5, 1.0, 2.0)):
        for controller in ("adaptive_pd", "extended", "pid"):
            folder = tmp_path / f"{vehicle}{factor}{controller}"  # a file is read once
            folder.mkdir()
            rule = replace(fleet.tuning_of(controller).rule, current=0.0)
            wiring, gains = with_gains(folder, scaled(vehicle, factor), controller, rule)
            verdicts += holds(wiring, values=gains)[1:]
    assert Counter(verdicts) == {"held": 10, "oscillates": 8}


@pytest.mark.slow
def test_the_certificate_tells_of_the_roll_that_a_current_makes_unstable(fmus, tmp_path):
    plant, rule = scaled("bluerov2_heavy", 1.0), Rule()
    _, gains = with_gains(tmp_path, plant, "adaptive_pd", rule)
    wiring = wire(fleet.holding("bluerov2_heavy"))
    for troubles, stable in (((), True), (("current",), False)):
        found = Certificate("", loop_of(Changes(values=gains, troubles=troubles).applied(wiring))).linear
        assert found.is_stable == stable
        assert stable or [mode.axis for mode in found.modes() if abs(mode.eigenvalue) > 1] == ["phi"]


@pytest.mark.slow
def test_the_command_writes_what_a_run_takes(fmus, tmp_path):
    gains, picture = tmp_path / "gains.ssv", tmp_path / "margins.svg"
    shown = ok("tune", "hoang_kreuzer", "--delay", 2, "-o", gains, "--plot", picture)
    assert "lag 235 ms, so omega 0.851 rad/s" in shown
    assert "samples of delay to spare" in shown
    told = re.search(
        r"in yaw is (\S+) N m/rad, of which .* 0.25 m/s take up to (\S+); by omega alone it would be (\S+)\.\n", shown
    )
    stiffness, taken, by_omega = map(float, told.groups())
    assert by_omega == pytest.approx(14.7 * 0.851**2, rel=5e-3)
    assert stiffness == pytest.approx(max(by_omega, taken + by_omega / 2), rel=5e-3)
    assert f"rov-cosim run hoang_kreuzer --parameters {gains}" in shown
    assert "psi" in picture.read_text(encoding="utf-8")
    wiring = Changes(values={"controller.K_P.x": 7.0}, parameters=(gains,)).applied(
        wire(fleet.holding("hoang_kreuzer"))
    )
    expected = tuned(ADAPTIVE_PD, inertia(parameters_of("hoang_kreuzer")), timing=Timing(delay=2))
    assert {name: wiring.value(f"controller.{name}") for name in expected} == {**expected, "K_P.x": 7.0}
    assert wiring.value("passive_arm.delay") == 2
    assert "gains-" in wiring.name


def test_unstable_gains_end_with_a_status(fmus):
    done = call("tune", "hoang_kreuzer", "--controller", "pid", "--bandwidth", 1)
    assert done.exit_code == 1
    assert "UNSTABLE in the small: yaw grows" in done.output
    assert "The controlled axes are unstable with these gains" in done.output
    assert "Stable" not in done.output


@pytest.mark.slow
def test_a_free_pitch_that_is_unstable_is_a_warning(fmus, tmp_path):
    told = ok("tune", file_of(tmp_path, {**parameters_of("bluerov2"), "D_linear.q": 0.0}))
    assert re.search(
        r"Stable while the vehicle is level(.*\n)+  UNSTABLE in the small: pitch .*\n  That is a warn", told
    )


UPRIGHT = {f"thruster[{i}].d.{axis}": float(axis == "z") for i in range(1, 9) for axis in "xyz"}


@pytest.mark.parametrize("command", ["tune", "run"])
@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"mass": -13.5}, "mine.ssv: mass is -13.5; expected a finite number of at least 0.001."),
        ({"I.zz": -9.0}, "mine.ssv: The mass matrix is not positive definite"),
        ({"thruster[1].d.x": 0.3}, "mine.ssv: A thruster direction is not of unit length"),
        (UPRIGHT, "The enabled thrusters cannot produce every controlled wrench (B B^T is singular)"),
    ],
    ids=["mass", "inertia", "direction", "thrusters"],
)
def test_a_vehicle_that_cannot_be_is_refused_in_a_line(fmus, tmp_path, command, wrong, said):
    assert said in one_line(call(command, file_of(tmp_path, {**parameters_of("hoang_kreuzer"), **wrong})))


@pytest.mark.slow
def test_the_command_gives_the_extended_law_what_the_fleet_gives_it(fmus, tmp_path):
    gains = tmp_path / "gains.ssv"
    ok("tune", "rexrov", "--controller", "extended", "--thruster-lag", 0, "-o", gains)
    wiring = wire(fleet.holding("rexrov", "extended"))
    tuned_too = Changes(parameters=(gains,)).applied(wiring)
    names = extended(ADAPTIVE_PD, parameters_of("rexrov"), *fleet.TUNING)
    assert {f"Gamma.M.{axis}" for axis in "xyz"} | set(EXTENSIONS) <= set(names)
    for name in names:
        assert tuned_too.value(f"controller.{name}") == wiring.value(f"controller.{name}"), name


def test_bad_input_is_told_in_a_line(fmus, tmp_path):
    assert "there is no vehicle bluerov. Did you mean bluerov2" in one_line(call("tune", "bluerov"))
    short = tmp_path / "short.ssv"
    plant = parameters_of("hoang_kreuzer")
    short.write_bytes(file_of(tmp_path, {"mass": plant["mass"]}).read_bytes())
    said = one_line(call("tune", short))
    assert "of a vehicle's parameters: D_linear.p" in said
    gains = tmp_path / "gains.ssv"
    wiring = wire(fleet.holding("hoang_kreuzer"))
    gains.write_bytes(values_set(wiring, {"controller.K_P.x": 1.0}, "a", "").replace(b"controller.K_P", b"pilot.K_P"))
    said = one_line(call("run", "hoang_kreuzer", "--parameters", gains))
    assert "pilot.K_P.x is of none of the elements scenario, passive_arm, controller, rov_plant" in said
