"""What a current takes from the stiffness in yaw, by hand."""

import numpy as np
import pytest

from rov_cosim.components.adaptive_pd import COMPONENT as ADAPTIVE_PD
from rov_cosim.components.pid import COMPONENT as PID
from rov_cosim.components.rov_plant import COMPONENT as ROV_PLANT
from rov_cosim.control.softening import softening
from rov_cosim.control.tuning import stiffened
from rov_cosim.systems.fleet import parameters_of

U = 0.3
MUNK = (128.0 - 120.0) * U**2


def parameters(component, **values):
    """Return a component's parameters, the declared ones but for some by key."""
    p = component.p.unpack(component.p.start.copy())
    for key, value in values.items():
        setattr(p, key, np.asarray(value, dtype=float))
    return p


def test_an_integral_in_the_earth_frame_leaves_the_munk_moment():
    found = softening(PID, parameters(PID), parameters(ROV_PLANT), U)
    assert found == pytest.approx(MUNK, rel=1e-4)


@pytest.mark.parametrize(("arm", "umbilical"), [(20.0, 20.0), (5.0, 15.0), (1e-6, 20.0)])
def test_drag_that_is_learned_as_the_arms_force_turns_the_vehicle_by_its_lever(arm, umbilical):
    p_law = parameters(ADAPTIVE_PD, Gamma=[10.0, *[umbilical] * 3, *[arm] * 3, 0.0, 0.0, 0.0])
    of_arm = arm / (arm + umbilical) * 130.0 * U**2
    assert softening(ADAPTIVE_PD, p_law, parameters(ROV_PLANT), U) == pytest.approx(MUNK + 0.4 * of_arm, rel=1e-3)


def test_a_force_that_does_stand_at_the_arms_base_takes_nothing_once_it_is_known():
    forces = parameters(ROV_PLANT, forces=[0.0] * 4 + [20.0, 0.0, 0.0])
    told = [0.0] * 4 + [20.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    found = softening(ADAPTIVE_PD, parameters(ADAPTIVE_PD, theta_hat_0=told), forces, 0.0)
    assert found == pytest.approx(0.0, abs=1e-6)
    assert softening(PID, parameters(PID), forces, 0.0) == pytest.approx(-0.4 * 20.0, rel=1e-3)  # it aligns itself


def test_free_roll_and_pitch_follow_the_yaw():
    """Yawed under a pull at the umbilical's point the vehicle rolls, which turns the arm's upward pull to the side."""
    loads = {"forces": [0.0, 10.0, 0.0, 0.0, 0.0, 0.0, 10.0], "r_C": [0.0, 0.0, 0.3]}
    locked, free = (
        softening(PID, parameters(PID), parameters(ROV_PLANT, lock_roll_pitch=lock, **loads), 0.0) for lock in (1, 0)
    )
    assert locked == pytest.approx(0.0, abs=1e-6)
    rolled = 10.0 * 0.3 / (80.0 * 9.81 * 0.05)  # over the yaw, for a small tilt
    assert free == pytest.approx(10.0 * 0.4 * rolled, rel=0.1)


def test_a_current_that_turns_the_vehicle_over_leaves_no_yaw_to_hold():
    values = {name: float(value) for name, value in parameters_of("bluerov2_heavy").items()}
    heavy = ROV_PLANT.p.unpack(np.array([values.get(name, 0.0) for name in ROV_PLANT.p.names]))
    assert np.isfinite(softening(PID, parameters(PID), heavy, 0.2))
    assert softening(PID, parameters(PID), heavy, 0.5) == np.inf


@pytest.mark.parametrize(("K_s", "stiffness"), [(-3.0, 100.0), (50.0, 100.0), (80.0, 130.0), (np.inf, 400.0)])
def test_half_of_the_stiffness_is_left_as_far_as_the_lag_allows_and_the_damping_ratio_stays(K_s, stiffness):
    gains = stiffened({"K_P.psi": 60.0, "K_D.psi": 2 * 0.7 * 100.0, "K_P.x": 1.0}, K_s, 100.0, 1.0)
    assert gains["K_P.psi"] == 60.0 + stiffness - 100.0
    assert gains["K_D.psi"] == pytest.approx(2 * 0.7 * np.sqrt(100.0 * stiffness), rel=1e-3)
    assert gains["K_P.x"] == 1.0
