"""The life of an instance: clock, checks, save, restore, reset."""

import numpy as np
import pytest

from rig import Rig
from rov_cosim.components.adaptive_pd import COMPONENT as CONTROLLER
from rov_cosim.components.instance import ComponentError, Instance
from rov_cosim.components.passive_arm import COMPONENT as ARM
from rov_cosim.components.pid import COMPONENT as PID
from rov_cosim.components.rov_plant import COMPONENT as PLANT
from rov_cosim.components.scenario import COMPONENT as SCENARIO
from rov_cosim.components.sliding_mode import COMPONENT as SLIDING_MODE
from rov_cosim.components.sun_cheah import COMPONENT as SUN_CHEAH

COMPONENTS = [PLANT, ARM, CONTROLLER, PID, SLIDING_MODE, SUN_CHEAH, SCENARIO]
NAMES = [component.name for component in COMPONENTS]


def exercised(component, steps: int = 20) -> Rig:
    """Return a rig in the middle of a lively run."""
    rig = Rig(component)
    if "eta_m_valid" in component.u.names:
        rig.set({"eta_m_valid": 1})
    rig.start()
    excite(rig, 0, steps)
    return rig


def excite(rig: Rig, first: int, steps: int) -> list[list[float]]:
    """Step with inputs that depend on the step's number; return all outputs after each."""
    rows = []
    inputs = [name for name in rig.component.u.names if name not in ("eta_m_valid", "disable")]
    for k in range(first, first + steps):
        rig.set({name: 0.3 * np.sin(0.1 * k + i) for i, name in enumerate(inputs)})
        rig.step()
        rows.append([rig.get(name) for name in rig.component.y.names])
    return rows


@pytest.mark.parametrize("component", COMPONENTS, ids=NAMES)
def test_restore_repeats_the_rest_bit_for_bit_also_in_another_instance(component):
    rig = exercised(component)
    saved = rig.instance.save()
    rest = excite(rig, 20, 20)
    rig.instance.restore(saved)
    assert excite(rig, 20, 20) == rest
    other = Rig(component)
    other.instance.restore(saved)
    assert excite(other, 20, 20) == rest
    assert other.instance.save() == rig.instance.save()


@pytest.mark.parametrize("phase", ["instantiated", "initializing"])
def test_restore_works_before_the_run_too(phase):
    rig = Rig(ARM, {"noise_std": 0.02, "seed": 9})
    if phase == "initializing":
        rig.instance.set_times(1.5)
        rig.instance.enter_initialization()
    saved = rig.instance.save()
    rig.set({"noise_std": 0.0, "seed": 1})
    if phase == "instantiated":
        rig.start(3.0)
    rig.instance.restore(saved)
    assert (rig.get("noise_std"), rig.get("seed")) == (0.02, 9)
    if phase == "instantiated":
        rig.instance.enter_initialization()
    rig.instance.exit_initialization()
    rig.step()
    assert rig.instance.time == pytest.approx(1.53 if phase == "initializing" else 0.03)


@pytest.mark.parametrize("broken", [b"", b"x" * 2000, "cut", "nan", "phase", "other"])
def test_a_state_that_was_never_saved_is_refused_and_nothing_changes(broken):
    rig = exercised(ARM)
    saved = rig.instance.save()
    bad = {
        "cut": saved[:-8],
        "nan": saved[:-8] + np.array([np.nan]).tobytes(),
        "phase": saved[:16] + np.array([7.0]).tobytes() + saved[24:],
        "other": exercised(PLANT).instance.save(),
    }.get(broken, broken)
    with pytest.raises(ComponentError, match="saved state"):
        rig.instance.restore(bad)
    assert rig.instance.save() == saved


@pytest.mark.parametrize("h", [0.03, 0.01, 0.06, 0.015, 0.05])
def test_samples_are_taken_at_multiples_of_the_sample_time_whatever_the_step(h):
    rig = Rig(ARM).start()
    seen = []
    for _ in range(round(3.0 / h)):
        rig.step(h)
        seen.append(rig.get("eta_m.x"))
    reference = Rig(ARM).start()
    every = []
    for _ in range(100):
        reference.step(0.03)
        every.append(reference.get("eta_m.x"))
    due = [int(np.ceil((n + 1) * h / 0.03 - 1e-6)) - 1 for n in range(len(seen))]
    assert seen == [every[k] for k in due]


def test_time_stays_exact_over_a_long_run_of_accumulated_steps():
    # A master that sums 0.03 drifts by more than rounding; each step must still hold exactly one sample.
    rig = Rig(SCENARIO).start(10.0)
    time = 10.0
    samples = []
    for _ in range(4000):
        rig.instance.do_step(time, 0.03)
        time += 0.03
        samples.append(rig.instance._samples)
    assert abs(time - 130.0) > 1e-12
    assert samples == list(range(1, 4001))


def test_a_sliver_of_a_step_changes_nothing():
    for component in COMPONENTS:
        rig = exercised(component)
        before = [rig.get(name) for name in rig.component.y.names]
        for _ in range(5):  # however many: the clock follows, nothing else does
            rig.instance.do_step(rig.instance.time, 5e-10)
        assert [rig.get(name) for name in rig.component.y.names] == before
        rest, unbroken = excite(rig, 20, 3), excite(exercised(component), 20, 3)
        assert np.array(rest) == pytest.approx(np.array(unbroken), abs=1e-8)


@pytest.mark.parametrize("h", [0.0, -0.03, np.nan, np.inf])
def test_a_step_size_that_is_not_positive_is_refused(h):
    rig = exercised(PLANT)
    before = rig.instance.save()
    with pytest.raises(ComponentError, match=r"step size is .*; expected a positive"):
        rig.instance.do_step(rig.instance.time, h)
    assert rig.instance.save() == before


@pytest.mark.parametrize("time", [0.3, np.nan, 1e9])
def test_a_wrong_communication_point_is_refused(time):
    rig = Rig(PLANT).start()
    with pytest.raises(ComponentError, match="Expected the communication point 0 s but was"):
        rig.instance.do_step(time, 0.03)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_inputs_that_are_not_finite_are_refused(value):
    rig = exercised(PLANT)
    before = rig.instance.save()
    with pytest.raises(ComponentError, match=r"u\[3\] is .*; expected a finite number"):
        rig.set({"u[2]": 1.0, "u[3]": value})
    assert rig.instance.save() == before  # u[2] is not set either


@pytest.mark.parametrize(
    ("component", "name", "value", "message"),
    [
        (PLANT, "mass", -1.0, r"mass is -1; expected a finite number of at least 0\.001"),
        (PLANT, "max_step", 0.0, "max_step is 0"),
        (CONTROLLER, "epsilon_0", 1.5, "epsilon_0 is 1.5; expected a finite number of at least 0 and at most 1"),
        (CONTROLLER, "K_P.x", -1.0, r"K_P\.x is -1"),
        (CONTROLLER, "thruster[2].d.x", 1.5, r"thruster\[2\]\.d\.x is 1\.5"),
        (ARM, "sample_time", 0.0, "sample_time is 0"),
        (ARM, "encoder_counts", -1, "encoder_counts is -1"),
    ],
)
def test_parameters_out_of_range_are_refused(component, name, value, message):
    with pytest.raises(ComponentError, match=message):
        Rig(component, {name: value})


@pytest.mark.parametrize(
    ("component", "values", "message"),
    [
        (PLANT, {"I.xx": 0.1, "r_G.z": 0.2, "added_mass.p": 0.0}, "mass matrix is not positive definite.*check mass"),
        (PLANT, {"eta_0.phi": 0.1}, "Roll and pitch are locked.*set these to 0"),
        (PLANT, {"thruster[1].d.x": 0.1}, "not of unit length: normalise"),
        (
            CONTROLLER,
            {f"thruster[{i}].enabled": 0 for i in range(5, 9)},
            "cannot produce every controlled wrench.*enable",
        ),
    ],
)
def test_parameters_that_contradict_each_other_are_refused(component, values, message):
    rig = Rig(component, values)
    rig.instance.enter_initialization()
    with pytest.raises(ComponentError, match=message):
        rig.instance.exit_initialization()


def test_a_tunable_that_breaks_the_allocation_fails_the_step_and_mending_it_cures():
    rig = exercised(CONTROLLER)
    lost = {f"thruster[{i}].enabled": 0 for i in range(5, 9)}
    rig.set(lost)
    with pytest.raises(ComponentError, match="cannot produce every controlled wrench"):
        rig.step()
    rig.set(dict.fromkeys(lost, 1))
    rig.step()


def test_fixed_parameters_and_outputs_cannot_be_set_during_a_run():
    rig = exercised(PLANT)
    with pytest.raises(ComponentError, match="mass is a fixed parameter: set it before"):
        rig.set({"mass": 90.0})
    with pytest.raises(ComponentError, match=r"eta\.x is an output"):
        rig.set({"eta.x": 1.0})
    rig.set({"dB": 3.0})  # tunable


def test_calls_out_of_order_are_refused():
    instance = Instance(PLANT)
    refused = pytest.raises(ComponentError, match=r"only while (instantiated|initializing|running); the component is")
    for call in (lambda: instance.do_step(0.0, 0.03), instance.exit_initialization, instance.terminate):
        with refused:
            call()
    instance.enter_initialization()
    for call in (instance.enter_initialization, lambda: instance.set_times(1.0)):
        with refused:
            call()
    instance.exit_initialization()
    with refused:
        instance.exit_initialization()
    instance.do_step(0.0, 0.03)
    instance.terminate()
    with refused:
        instance.do_step(0.03, 0.03)


def test_initial_values_out_of_range_are_refused():
    rig = Rig(PLANT, {"lock_roll_pitch": 0})
    with pytest.raises(ComponentError, match=r"eta_0\.theta is 2; expected"):
        rig.set({"eta_0.theta": 2.0})
    arm = Rig(ARM, {"eta.x": 1e200})
    arm.instance.enter_initialization()
    with pytest.raises(ComponentError, match=r"The initialization at 0 s failed: .* is .*; expected a finite number"):
        arm.instance.exit_initialization()


def test_a_restored_state_still_owes_its_checks():
    rig = Rig(PLANT, {"eta_0.phi": 0.1})  # contradicts the lock
    saved = rig.instance.save()
    other = Rig(PLANT).start()
    other.instance.restore(saved)
    other.instance.enter_initialization()
    with pytest.raises(ComponentError, match="Roll and pitch are locked"):
        other.instance.exit_initialization()


def test_parameters_can_be_read_back_while_a_group_of_them_is_being_set():
    rig = Rig(PLANT, {"thruster[1].d.x": 0.0})
    assert rig.get("mass") == 80.0
    with pytest.raises(ComponentError, match="not of unit length"):
        rig.get("tau")


def test_the_communication_point_is_checked_at_any_start_time():
    rig = Rig(PLANT).start(1.7e9)
    for wrong in (1.5, -0.5, 1e-5):
        with pytest.raises(ComponentError, match="Expected the communication point"):
            rig.instance.do_step(1.7e9 + wrong, 0.03)
    rig.instance.do_step(1.7e9 + 1e-7, 0.03)


@pytest.mark.parametrize("start", [3.1e7, 1.7e9])
def test_samples_are_taken_at_any_start_time(start):
    rig = Rig(CONTROLLER).start(start)
    for n in range(100):
        rig.instance.do_step(start + n * 0.03, 0.03)
        assert rig.instance._samples == n + 1


def test_a_very_long_step_needs_no_memory():
    rig = Rig(CONTROLLER, {"sample_time": 100.0}).start()
    rig.instance.do_step(0.0, 1e5)
    assert rig.instance._samples == 1000


def test_gains_changed_during_a_run_do_not_jump_the_estimate():
    changed, unchanged = exercised(CONTROLLER), exercised(CONTROLLER)
    changed.set({"Gamma.dB": 50.0, "K_P.x": 200.0, "alpha": 0.5})
    assert np.array_equal(changed.get("theta_hat"), unchanged.get("theta_hat"))
    for rig in (changed, unchanged):
        rig.step()
    assert np.array_equal(changed.get("theta_hat"), unchanged.get("theta_hat"))
    assert changed.get("tau")[0] != unchanged.get("tau")[0]


def test_instances_are_independent():
    rigs = [Rig(ARM, {"seed": seed}).start() for seed in (1, 1, 2)]
    for _ in range(5):
        for rig in rigs:
            rig.step()
    assert np.array_equal(rigs[0].get("eta_m"), rigs[1].get("eta_m"))
    assert not np.array_equal(rigs[0].get("eta_m"), rigs[2].get("eta_m"))
