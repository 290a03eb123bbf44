"""The paper's two cases, and the properties that it proves, on the FMUs in closed loop."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rig import inputs, parameters
from rov_cosim.components import frames, vehicle
from rov_cosim.components.adaptive_pd import COMPONENT as CONTROLLER
from rov_cosim.components.adaptive_pd import equations as law
from rov_cosim.components.rov_plant import COMPONENT as PLANT
from rov_cosim.components.rov_plant import equations as motion
from rov_cosim.master.exchange import gauss_seidel, jacobi
from rov_cosim.master.simulation import simulate
from rov_cosim.ssp import reader as ssp_reader
from rov_cosim.study.assessment import axes, errors, forces

POSE = [f"rov_plant.eta.{axis}" for axis in ("x", "y", "z", "psi")]


@pytest.fixture(scope="module")
def run(archives):
    """Return a function that runs a system once and remembers the outcome."""
    done = {}

    def run_(name, coupling=jacobi, stop_time=None):
        key = (name, coupling, stop_time)
        if key not in done:
            with ssp_reader.opened(archives[name]) as wiring:
                done[key] = (simulate(wiring, coupling, stop_time), wiring)
        return done[key]

    return run_


def poses(results):
    return np.stack([results[name] for name in POSE], axis=1)


# --- Case 4.1: the simulation ---------------------------------------------------------------------------------------


def test_pd_settles_where_its_spring_balances_the_disturbance(run):
    results, _ = run("paper_simulation_pd", gauss_seidel)
    final = poses(results)[-1]
    psi = final[3]
    assert final[:3] == pytest.approx([12 / 100, 12 / 100, 5 / 120], abs=1e-4)
    # The arm's moment with r_A turned by the yaw that it causes: 55 psi = 0.4 (8 cos psi - 8 sin psi).
    assert psi == pytest.approx(0.4 * 8.0 * (np.cos(psi) - np.sin(psi)) / 55, abs=1e-4)
    assert psi == pytest.approx(0.055, abs=1e-3)
    settled = np.abs(poses(results) - final).max(axis=1) < 0.02
    assert 5 < results["time"][np.flatnonzero(~settled)[-1]] < 15


def test_adaptation_removes_the_offset_in_about_thirty_seconds(run):
    results, wiring = run("paper_simulation", gauss_seidel)
    entered = max(axis.settling for axis in axes(results, wiring) if axis.name != "psi")
    assert entered == pytest.approx(30, abs=2)
    time, error = results["time"], np.abs(poses(results))
    late = np.array([error[(time > t) & (time <= t + 10)].max(axis=0) for t in (20, 30, 40, 50)])
    # It goes on converging to zero: surge and heave fast, yaw (and sway with it) by the slow mode of the arm's lever.
    assert (late[1:, [0, 2]] < 0.4 * late[:-1, [0, 2]]).all()
    assert (late[1:, 3] < 0.85 * late[:-1, 3]).all()


def test_adaptation_finds_the_disturbance_wrench(run):
    # Nearly at rest, what the estimate still lacks is what the spring K_P e holds: little, and least where it is fast.
    results, wiring = run("paper_simulation", gauss_seidel)
    x, y, z, psi = poses(results)[-1]
    spring = {"X": 100 * (np.cos(psi) * x + np.sin(psi) * y), "Y": 100 * (np.cos(psi) * y - np.sin(psi) * x)}
    spring |= {"Z": 120 * z, "N": 55 * psi}
    found = forces(results, wiring)
    assert [force.name for force in found] == list(spring)
    for force in found:
        assert force.true - force.estimated == pytest.approx(spring[force.name], abs=0.03)
        assert abs(force.true - force.estimated) < abs(force.true) / 4


def test_the_set_point_of_the_errors_is_the_controllers(run):
    results, wiring = run("station_keeping")
    moved = wiring.with_values({"controller.eta_d.x": 0.5, "controller.eta_d.psi": 3.0})
    shift = errors(results, wiring) - errors(results, moved)
    assert shift[:, 0] == pytest.approx(0.5)
    assert np.abs(errors(results, moved)[:, 5]).max() <= np.pi


def reference(adaptation: bool, stop: float, step: float) -> np.ndarray:
    """Integrate the paper's sampled loop anew: four degrees of freedom, pose and velocity measured, command held.

    Written from the paper's equations in [x y z psi] with scipy alone; nothing of this project is called.
    """
    M = np.diag([120.0, 128.0, 136.0, 14.7])
    D = np.array([130.0, 195.0, 286.0, 10.18])
    K_P, K_D = np.array([100.0, 100.0, 120.0, 55.0]), np.array([90.0, 90.0, 90.0, 80.0])
    Gamma, epsilon_0, alpha = 40.0, 0.3, 2.0
    forces = np.array([5.0, 4, 4, 0, 8, 8, 0])

    def J(psi):
        c, s = np.cos(psi), np.sin(psi)
        return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])

    def Phi(psi):  # minus the generalized forces in the earth frame; the arm alone has a lever about the yaw axis
        generalized = np.zeros((4, 7))
        generalized[2, 0] = 1
        generalized[:3, 1:4] = generalized[:3, 4:7] = np.eye(3)
        generalized[3, 4:6] = 0.4 * -np.sin(psi), 0.4 * np.cos(psi)
        return -generalized

    def coriolis(nu):
        u, v, _, r = nu
        return np.array([-128.0 * v * r, 120.0 * u * r, 0.0, (128.0 - 120.0) * u * v])

    def f(t, z, tau):
        eta, nu = z[:4], z[4:]
        unknown = -J(eta[3]).T @ Phi(eta[3]) @ forces
        return np.concatenate([J(eta[3]) @ nu, np.linalg.solve(M, tau + unknown - coriolis(nu) - D * np.abs(nu) * nu)])

    z, estimate = np.array([0.52, 0.73, 0.62, 0.83, 0, 0, 0, 0]), np.zeros(7)
    rows = [z[:4]]
    for _ in range(round(stop / step)):
        e, eta_dot = z[:4], J(z[3]) @ z[4:]
        tau = J(z[3]).T @ (-K_P * e - K_D * eta_dot + Phi(z[3]) @ estimate)
        if adaptation:
            rate = -Gamma * Phi(z[3]).T @ (eta_dot + epsilon_0 / (1 + alpha * np.linalg.norm(e)) * e)
            estimate = estimate + step * rate
        z = solve_ivp(f, (0, step), z, method="DOP853", rtol=1e-10, atol=1e-12, args=(tau,)).y[:, -1]
        rows.append(z[:4])
    return np.array(rows)


@pytest.mark.parametrize(("name", "adaptation"), [("paper_simulation", True), ("paper_simulation_pd", False)])
def test_the_fmus_agree_with_an_independent_integration_of_the_sampled_loop(run, name, adaptation):
    results, _ = run(name, gauss_seidel)
    expected = reference(adaptation, 30.0, 0.03)
    assert np.abs(poses(results)[: len(expected)] - expected).max() < 1e-6


def test_couplings_differ_by_little(run, archives):
    with ssp_reader.opened(archives["paper_simulation"]) as wiring:
        delayed = simulate(wiring, jacobi, stop_time=20.0)
    direct, _ = run("paper_simulation", gauss_seidel)
    difference = np.abs(poses(delayed) - poses(direct)[: len(delayed)])
    assert 1e-5 < difference.max() < 0.05  # while the vehicle moves; see the next test for the hold
    assert difference[-1].max() < 2e-3


# --- Case 4.2: the experiment ---------------------------------------------------------------------------------------


def test_station_keeping_shows_the_described_behaviour(run):
    results, wiring = run("station_keeping")
    time, error = results["time"], errors(results, wiring)
    z = error[:, 2]
    assert z.max() > 0.15  # buoyancy lifts the vehicle in the first 10 s
    assert time[z.argmax()] < 10
    after = np.abs(error[time > 27])
    assert after[:, :3].max() < 0.05  # the set-point is reached after about 25 s
    assert after[:, 5].max() < np.radians(2)


def test_the_mean_error_of_holding_is_below_five_millimetres(run):
    results, wiring = run("station_keeping")
    last = results["time"] > results["time"][-1] - 20
    mean = errors(results, wiring)[last].mean(axis=0)
    assert np.abs(mean[:3]).max() < 5e-3
    assert abs(mean[5]) < np.radians(0.5)


def test_pd_keeps_the_predicted_offset_under_noise(run):
    results, wiring = run("station_keeping_pd", stop_time=45.0)
    last = results["time"] > results["time"][-1] - 20
    mean = errors(results, wiring)[last].mean(axis=0)
    x, y, z, psi = mean[[0, 1, 2, 5]]
    assert [x, y, z] == pytest.approx([2.5 / 80, -8.0 / 80, 25.0 / 100], abs=1e-3)
    assert psi == pytest.approx(0.4 * -5.0 * np.cos(psi) / 30, abs=1e-3)


def test_station_keeping_measures_through_arm_encoders_noise_and_lead_filter(run):
    results, wiring = run("station_keeping")
    assert wiring.value("controller.use_measured_velocity") is False
    assert wiring.value("passive_arm.noise_std") == 0.005
    assert wiring.value("passive_arm.encoder_counts") == 4096
    assert results["passive_arm.eta_m_valid"].all()
    assert results["passive_arm.reach"].max() < 1.4
    # Jacobi: the measurement shown is that of the pose one step before.
    measured = results["passive_arm.eta_m.x"][1:] - results["rov_plant.eta.x"][:-1]
    assert measured.std() == pytest.approx(0.005, rel=0.1)
    assert np.abs(results["controller.eta_dot.x"]).max() > 0.05


# --- What the paper proves and discusses ----------------------------------------------------------------------------


def ideal_loop(
    forces,
    stop,
    gains,
    adapt=None,
    lock=1,
    current=(0.0, 0.0, 0.0),
    start=(0.52, 0.73, 0.62, 0.0, 0.0, 0.83),
    couple=0.0,
):
    """Integrate the continuous loop of equations 1, 4 and 5 with exact measurement; return the states over time.

    The estimate has the paper's seven forces, and a couple of this gain.
    """
    six = {"control_roll_pitch": 1 - lock}
    p_c = parameters(CONTROLLER, use_measured_velocity=1, sample_time=1.0, **six, **gains)
    if adapt is not None:
        p_c.Gamma = p_c.Gamma * adapt
    p_c.Gamma = np.concatenate([p_c.Gamma, [couple] * 3])
    p_v = parameters(PLANT, lock_roll_pitch=lock, forces=forces)
    u_v = inputs(PLANT, current=current)
    M = motion.inertia(p_v)

    def f(_, z):
        x = CONTROLLER.x.unpack(np.zeros(CONTROLLER.x.size))
        x.theta_hat = z[12:]
        measured = inputs(CONTROLLER, eta_m=z[:6], eta_m_valid=1, nu_m=z[6:12])
        after, outputs = law.sample(x, measured, p_c, None)
        # With a sample time of 1 s Euler's step is the rate itself.
        return np.concatenate([motion.rates(z[:6], z[6:12], outputs["tau"], M, u_v, p_v), after["theta_hat"] - z[12:]])

    z_0 = np.concatenate([start, np.zeros(16)])
    solution = solve_ivp(f, (0, stop), z_0, rtol=1e-8, atol=1e-10, dense_output=True)
    return solution, p_c, M


FORCES = np.array([5.0, 4, 4, 0, 8, 8, 0])
# A high adaptation gain, for the moments are estimated through short levers, which is slow.
GAINS = {"K_P": [100, 100, 120, 55, 55, 55], "K_D": [90, 90, 90, 80, 80, 80], "Gamma": [100.0] * 7}


@pytest.mark.parametrize("couple", [pytest.param(0.0, marks=pytest.mark.slow), 30.0])
def test_the_lyapunov_function_falls_along_the_ideal_loop(couple):
    # The proof takes any constant loads with a known map to the wrench: a couple beside the forces is one more.
    solution, p, M = ideal_loop(FORCES, 40.0, {**GAINS, "epsilon_0": 0.26}, lock=1, couple=couple)
    dof, adapted = vehicle.FOUR_DOF, p.Gamma > 0

    def V(z):
        eta, nu, estimate = z[:6], z[6:12], z[12:]
        J_inverse = frames.jacobian_inverse(eta)
        M_eta = J_inverse.T @ M @ J_inverse
        e, rate = eta * dof, frames.jacobian(eta) @ nu
        epsilon = p.epsilon_0 / (1 + p.alpha * np.linalg.norm(e))
        wrong = (estimate - np.concatenate([FORCES, np.zeros(3)]))[adapted]
        kinetic, spring = 0.5 * rate @ M_eta @ rate, 0.5 * e @ (p.K_P * e)
        return kinetic + spring + epsilon * e @ M_eta @ rate + 0.5 * wrong @ (wrong / p.Gamma[adapted])

    values = np.array([V(z) for z in solution.sol(np.linspace(0, 40, 2000)).T])
    assert np.diff(values).max() < 1e-9
    assert values[-1] < 0.5 * values[0]
    assert values.min() > 0


@pytest.mark.slow
def test_six_degrees_of_freedom_are_held_too():
    start = (0.3, -0.2, 0.2, 0.2, -0.15, 0.6)
    solution, _, _ = ideal_loop(FORCES, 150.0, GAINS, lock=0, start=start)
    assert np.abs(solution.y[:6, -1]).max() < 1e-3


def test_without_an_arm_four_adapted_forces_bring_the_error_to_zero():
    umbilical = np.array([5.0, 4, 4, 0, 0, 0, 0])
    solution, _, _ = ideal_loop(umbilical, 100.0, GAINS, adapt=np.array([1, 1, 1, 1, 0, 0, 0]))
    assert np.abs(solution.y[:6, -1]).max() < 1e-3
    assert np.array_equal(solution.y[16:, -1], np.zeros(6))


def test_a_constant_current_is_absorbed_by_the_estimate():
    solution, _, _ = ideal_loop(np.zeros(7), 200.0, GAINS, current=(0.2, -0.1, 0.05))
    assert np.abs(solution.y[:6, -1]).max() < 1e-3
    assert np.abs(solution.y[12:, -1]).max() > 0.5
