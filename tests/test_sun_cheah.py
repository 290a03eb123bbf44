"""The adaptive controller with saturated errors: the function, its bounds, the estimate."""

import numpy as np
import pytest

from closed_loop import last, run
from rig import Rig, parameters, random_inputs
from rov_cosim.components.adaptive_pd import COMPONENT as ADAPTIVE
from rov_cosim.components.interface import POSE
from rov_cosim.components.sun_cheah import COMPONENT as CONTROLLER
from rov_cosim.components.sun_cheah.equations import saturated_error

T = 0.03


def controller(**values: float) -> Rig:
    rig = Rig(CONTROLLER, values)
    rig.set({"eta_m_valid": 1})
    return rig.start()


def test_the_saturated_error_is_arimotos():
    e, Delta = np.linspace(-2.0, 2.0, 401), 0.4
    s = saturated_error(e, Delta)
    assert np.all(np.diff(s) >= 0)
    assert s == pytest.approx(-s[::-1])
    assert s[np.abs(e) >= Delta * np.pi / 2] == pytest.approx(Delta * np.sign(e[np.abs(e) >= Delta * np.pi / 2]))
    assert (s[201] - s[199]) / (e[201] - e[199]) == pytest.approx(1.0, rel=1e-3)
    # Its potential is positive definite: s(e) has the sign of e.
    assert np.all(s[e != 0] * e[e != 0] > 0)


def test_with_a_wide_bound_it_is_adaptive_pd_with_a_constant_weight():
    wide = {f"Delta.{axis}": 1e6 for axis in POSE}
    settings = {"control_roll_pitch": 1, "thrust_max": 12.0, "r_G.x": 0.01}
    ours, theirs = Rig(CONTROLLER, settings | wide).start(), Rig(ADAPTIVE, settings | {"alpha": 0}).start()
    random = np.random.default_rng(7)
    for _ in range(300):
        values = random_inputs(CONTROLLER, random)
        for rig in (ours, theirs):
            rig.set(values)
            rig.step()
        for group in ("u", "tau", "disturbance", "eta_dot", "e", "saturated"):
            assert ours.get(group) == pytest.approx(theirs.get(group), rel=1e-9, abs=1e-9), group


@pytest.mark.parametrize("F", [15.0, 25.0])
def test_without_adaptation_a_force_leaves_the_predicted_offset(fmus, F):
    Delta = 0.3  # K_P Delta is 30 N
    results = run("sun_cheah", 60.0, {"adaptation": False, "Delta.z": Delta}, {"F_C.z": F})
    assert results["rov_plant.eta.z"][-1] == pytest.approx(Delta * np.arcsin(F / (100.0 * Delta)), rel=1e-5)


def test_a_force_beyond_the_bound_takes_the_vehicle_away_until_it_is_learned(fmus):
    F, Delta = 25.0, 0.1  # K_P Delta is 10 N
    values = {"Delta.z": Delta, "use_measured_velocity": True}
    results = run("sun_cheah", 30.0, {"adaptation": False, **values}, {"F_C.z": F})
    # D v^2 + K_D v = F - K_P Delta
    speed = (-120.0 + np.sqrt(120.0**2 + 4 * 286.0 * (F - 10.0))) / (2 * 286.0)
    assert results["rov_plant.nu.w"][-1] == pytest.approx(speed, rel=1e-4)
    results = run("sun_cheah", 200.0, values, {"F_C.z": F})
    assert results["rov_plant.eta.z"].max() > Delta * np.pi / 2
    assert abs(results["rov_plant.eta.z"][-1]) < 1e-3


def test_the_estimate_goes_where_the_vehicle_is_pushed_no_faster_than_the_bound_allows():
    rig = controller(**{"Delta.x": 0.2, "Delta.z": 0.2})
    rig.set({"eta_m.x": 5.0, "eta_m.z": -0.05})
    rig.step()
    rig.run(10 * T)
    found = dict(zip(rig.component.y.names, rig.outputs(), strict=True))
    assert found["theta_hat.F_C.x"] == pytest.approx(10.0 * 0.3 * 0.2 * 10 * T)
    slow = 10.0 * 0.3 * 0.2 * np.sin(-0.05 / 0.2) * 10 * T
    assert [found[f"theta_hat.{force}"] for force in ("dB", "F_C.z", "F_A.z")] == pytest.approx([slow] * 3)
    assert found["theta_hat.F_A.y"] == 0


def test_with_buoyancy_alone_unknown_it_is_of_their_scope(fmus):
    """Gamma of umbilical and arm zero: buoyancy is learned, and a horizontal force leaves the offset of PD."""
    values = {f"Gamma.{point}.{axis}": 0.0 for point in ("F_C", "F_A") for axis in "xyz"}
    results = run("sun_cheah", 200.0, values, {"dB": 8.0, "F_C.x": 8.0})
    assert last(results, "rov_plant.eta", "xz") == pytest.approx([np.arcsin(8.0 / 80.0), 0.0], abs=1e-3)
    assert results["controller.theta_hat.dB"][-1] == pytest.approx(8.0, abs=0.05)


def test_no_offset_remains_and_the_wrench_is_learned(fmus):
    true = {"dB": 5.0, "F_C.x": 4.0, "F_A.y": 8.0, "eta_0.psi": 0.8}
    results = run("sun_cheah", 600.0, {"Delta.psi": 0.3}, true)
    assert last(results, "rov_plant.eta", POSE) == pytest.approx(np.zeros(6), abs=1e-3)
    assert last(results, "controller.disturbance", "XYZN") == pytest.approx([4.0, 8.0, 5.0, 3.2], abs=0.05)


def test_the_gains_are_the_papers():
    p, paper = parameters(CONTROLLER), parameters(ADAPTIVE)
    for gain in ("K_P", "K_D", "epsilon_0"):
        assert np.array_equal(getattr(p, gain), getattr(paper, gain)), gain
    assert np.array_equal(p.Gamma, paper.Gamma[: len(p.Gamma)])
