"""The linearised loop: beside transfer functions by hand, beside runs of the FMUs, and where it turns unstable."""

import os
import re
import signal
import subprocess
import sys
import time
from contextlib import suppress
from copy import copy
from dataclasses import replace

import numpy as np
import psutil
import pytest

from rov_cosim.components.interface import POSE
from rov_cosim.control.certificate import Certificate
from rov_cosim.control.effective import gains
from rov_cosim.control.loop import LoopError
from rov_cosim.control.margins import Margin, linear
from rov_cosim.master.simulation import simulate
from rov_cosim.ssp.declaration import wire
from rov_cosim.study.certificate_page import loop_lines, page, work_lines
from rov_cosim.study.changes import Changes
from rov_cosim.study.looped import loop_of
from rov_cosim.systems.catalogue import SYSTEMS
from typed import ok

T, T_F = 0.03, 0.1
WITHOUT_NOISE = {"passive_arm.noise_std": 0.0, "passive_arm.encoder_counts": 0}

WITHOUT_LOADS = {f"rov_plant.{name}": 0.0 for name in ("dB", "F_C.x", "F_C.y", "F_A.y", "F_A.z")}


@pytest.fixture(scope="module")
def wirings(fmus):
    return {name: wire(SYSTEMS[name]) for name in ("station_keeping", "station_keeping_pd", "rexrov", "bluerov2_heavy")}


@pytest.fixture(scope="module")
def certificates(wirings):
    return {name: Certificate(name, loop_of(wiring)) for name, wiring in wirings.items()}


@pytest.mark.parametrize("axis", [2, 5])
def test_the_response_is_the_transfer_function_by_hand(wirings, axis):
    loop = Certificate("", loop_of(wirings["station_keeping_pd"].with_values(WITHOUT_LOADS))).linear
    m, K_P, K_D = {2: (136.0, 100.0, 120.0), 5: (14.7, 30.0, 45.0)}[axis]
    omega = np.geomspace(0.01, 100, 40)
    z = np.exp(1j * omega * T)
    a = np.exp(-T / T_F)
    plant = T**2 * (z + 1) / (2 * m * (z - 1) ** 2)  # a held force on a mass
    law = K_P + K_D / T_F * (z - 1) / (z - a)
    by_hand = -plant * law * z**-2  # two steps of delay of the loop's own
    assert loop.response(axis, omega) == pytest.approx(
        by_hand, rel=5e-4
    )  # the difference quotient of |w| w is not quite 0


def test_margins_by_frequency_are_those_by_eigenvalues(certificates):
    found = certificates["station_keeping"]
    yaw, common = found.margins[5], found.common_margin
    # Yaw goes first, so what is common to all axes is its own.
    assert common.delay == pytest.approx(yaw.delay, rel=0.01)
    assert common.gain_up == pytest.approx(yaw.gain_up, rel=0.01)
    assert yaw.phase == pytest.approx(yaw.delay * yaw.crossover)


@pytest.mark.parametrize(("name", "first"), [("station_keeping", 8), pytest.param("rexrov", 7, marks=pytest.mark.slow)])
def test_the_delay_at_which_the_loop_turns_unstable(wirings, certificates, name, first):
    assert first - 1 < certificates[name].common_margin.delay / T < first
    for delay in (first - 1, first):
        loop = loop_of(wirings[name].with_values({"passive_arm.delay": delay}))
        found = Certificate(name, loop).level
        assert found.is_stable == (delay < first)


def test_an_unstable_loop_grows_in_a_run_as_its_eigenvalue_says(wirings):
    values = {**WITHOUT_NOISE, "passive_arm.delay": 8, "rov_plant.eta_0.y": 0.0, "rov_plant.eta_0.psi": 1e-5}
    wiring = wirings["station_keeping"].with_values({**values, **WITHOUT_LOADS})
    psi = simulate(wiring, stop_time=80.0)["rov_plant.eta.psi"]
    mode = linear(loop := loop_of(wiring), loop.equilibrium()).modes()[0]
    assert mode.axis == "psi"
    turns = np.flatnonzero(np.diff(np.sign(np.diff(psi))) != 0)[10:] + 1  # the extremes, once the mode is alone
    growth = np.polyfit(turns * T, np.log(np.abs(psi[turns])), 1)[0]
    assert growth == pytest.approx(-1 / mode.time_constant, rel=0.1)
    assert np.diff(turns).mean() * T == pytest.approx(np.pi / mode.frequency, rel=0.03)


def test_the_equilibrium_is_where_a_run_ends(wirings, certificates):
    results = simulate(wirings["bluerov2_heavy"].with_values(WITHOUT_NOISE), stop_time=300.0)
    last = results["time"] > 270.0
    at_rest = [np.mean(results[f"rov_plant.eta.{axis}"][last]) for axis in POSE]
    assert certificates["bluerov2_heavy"].pose == pytest.approx(at_rest, abs=5e-3)


def test_the_slow_mode_of_yaw_is_that_of_a_run(certificates):
    slowest = max(certificates["station_keeping"].linear.modes(), key=lambda mode: mode.time_constant)
    assert slowest.axis == "psi"
    assert slowest.time_constant == pytest.approx(140, rel=0.05)


def test_noise_moves_the_thrusters_as_predicted(wirings, certificates):
    wiring = wirings["station_keeping"].with_values({"passive_arm.encoder_counts": 0})
    results = simulate(wiring, stop_time=300.0)
    u = results["controller.u[1]"][results["time"] > 150]
    assert certificates["station_keeping"].thrust_noise == pytest.approx(u.std(), rel=0.05)


@pytest.mark.slow
def test_the_largest_sample_time_is_where_the_loop_turns_unstable(certificates):
    found = certificates["station_keeping_pd"]
    period = found.largest_sample_time
    for factor, stable in ((0.97, True), (1.1, False)):
        assert linear(found.loop.sampled_every(factor * period), found.equilibrium).is_stable == stable


@pytest.mark.parametrize("name", ["station_keeping", "station_keeping_pd"])
def test_the_gains_are_what_the_controller_does(certificates, name):
    found = gains(certificates[name].loop)
    assert np.diag(found.K_P) == pytest.approx([80, 80, 100, 0, 0, 30])
    assert np.diag(found.K_D) == pytest.approx([90, 90, 120, 0, 0, 45])
    # Gamma of 10: two forces in x and y, three in z, and in yaw the arm's lever of 0.4 m.
    learned = np.array([20, 20, 30, 0, 0, 1.6]) if name == "station_keeping" else np.zeros(6)
    assert np.diag(found.adapted) == pytest.approx(learned, abs=1e-4)
    assert np.diag(found.K_I) == pytest.approx(0.3 * learned, abs=1e-4)


def test_a_load_without_gamma_is_not_learned(wirings):
    """The couple has no Gamma by default; without the arm's nothing has a lever to learn the yaw by."""
    wiring = wirings["station_keeping"]
    assert Certificate("", loop_of(wiring)).learned[0] == 7
    wiring = wiring.with_values({f"controller.Gamma.F_A.{axis}": 0.0 for axis in "xyz"})
    found = Certificate("", loop_of(wiring))
    assert (found.learned[0], int(np.sum(found.learned[1] > 0))) == (4, 3)
    text = "\n".join(work_lines(found))
    assert "CANNOT BE LEARNED: the moment about (0.00 0.00 1.00) in body axes" in text


@pytest.mark.slow
def test_the_page_says_what_cannot_be_learned(wirings):
    wiring = Changes(troubles=("six_dof",)).applied(wirings["bluerov2_heavy"])
    text = "\n".join(page(Certificate("six", loop_of(wiring))))
    assert "rank 5" in text
    assert "whatever the constant loads are that it estimates" in text
    assert "the line from r_A to r_C, about which neither arm nor umbilical has a lever" in text


def test_the_page_calls_no_loop_stable_without_its_free_roll(certificates):
    certificate = copy(certificates["bluerov2_heavy"])
    free = certificate.linear
    growth = 1.001 / free.radius  # its roll is damped by hardly more
    linear_ = replace(free, A=growth * free.A, B=growth * free.B)
    level = {"margins": {}, "common_margin": Margin(0.0, 2.0, 0.1), "largest_sample_time": 0.1}
    vars(certificate).update(linear=linear_, **level)
    text = "\n".join(loop_lines(certificate))
    assert re.search(r"^Stable while the vehicle is level, with .* samples of delay to spare;", text, re.M)
    told = text.partition("Roll and pitch are free and not controlled:")[2]
    assert re.match(r"\n  UNSTABLE in the small: (.*\n)+  That is a warning, ", told)


@pytest.mark.slow
def test_several_systems_are_certified_in_processes_as_in_one(fmus, tmp_path):
    pages, path = [], tmp_path / "table.md"
    for jobs in (1, 2):
        told = ok("certify", "paper_simulation", "station_keeping", "--states", 0, "--jobs", jobs, "--table", path)
        pages.append((told, re.findall(r"^\| `.*", path.read_text(encoding="utf-8"), re.M)))
    assert pages[0] == pages[1]
    assert [row.split("`")[1] for row in pages[0][1]] == ["paper_simulation", "station_keeping"]


@pytest.fixture
def certifying(fmus):
    """Start a command whose processes certify for minutes."""
    command = [sys.executable, "-m", "rov_cosim.cli.main", "certify", "station_keeping", "rexrov", "minerva"]
    process = subprocess.Popen(
        [*command, "--states", "100000", "--jobs", "2"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    time.sleep(10)
    yield process
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


@pytest.mark.slow
@pytest.mark.parametrize("is_to_all", [True, False])
def test_ctrl_c_ends_the_processes_that_certify_at_once(certifying, is_to_all):
    # A terminal interrupts the parent and its processes.
    (os.killpg if is_to_all else os.kill)(certifying.pid, signal.SIGINT)
    _, told = certifying.communicate(timeout=30)  # they all have its pipes
    assert certifying.returncode == 1
    assert "Traceback" not in told


@pytest.mark.slow
def test_a_process_that_is_ended_while_it_certifies_ends_the_command(certifying):
    busiest = max(psutil.Process(certifying.pid).children(recursive=True), key=lambda one: sum(one.cpu_times()[:2]))
    busiest.kill()
    _, told = certifying.communicate(timeout=30)
    assert certifying.returncode == 1
    assert "A process that certifies was ended" in told
    assert "Traceback" not in told


@pytest.mark.slow
def test_the_page_tells_of_thrusters_that_are_too_weak(wirings):
    wiring = Changes(troubles=("overload",)).applied(wirings["rexrov"])
    assert any("TOO WEAK" in line for line in page(Certificate("weak", loop_of(wiring))))


@pytest.mark.parametrize(("share", "stable"), [pytest.param(0.75, True, marks=pytest.mark.slow), (1.1, False)])
def test_the_munk_moment_of_a_current_turns_a_yaw_that_is_held_too_softly(wirings, share, stable):
    values = {f"controller.Gamma.F_A.{axis}": 0.0 for axis in "xyz"}  # the drag taken for the arm's would turn it too
    values |= {"controller.K_P.psi": 1.0, "controller.Gamma.M.z": 1.6}
    wiring = wirings["station_keeping"].with_values({**WITHOUT_LOADS, **values})
    limit = Certificate("", loop_of(wiring)).current_limit
    K, K_I, K_D = 1.0 + 1.6, 0.3 * 1.6, 45.0
    assert limit == pytest.approx(np.sqrt((K - 14.7 * K_I / K_D) / 8.0), rel=1e-3)
    assert (
        Certificate("", loop_of(wiring.with_values({"rov_plant.current.x": share * limit}))).linear.is_stable == stable
    )


def test_a_loop_of_two_sample_times_is_refused(wirings):
    with pytest.raises(LoopError, match=r"controller is sampled every 0\.06 s"):
        loop_of(wirings["station_keeping"].with_values({"controller.sample_time": 0.06}))
