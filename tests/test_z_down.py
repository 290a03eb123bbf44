"""A plant that counts z downwards is held by the unchanged controller, wired with signs."""

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from pythonfmu.builder import FmuBuilder
from scipy.spatial.transform import Rotation

from rov_cosim.components.frames import rotation
from rov_cosim.components.interface import POSE
from rov_cosim.components.vehicle import FORCES
from rov_cosim.exporters.build import components
from rov_cosim.importers.measuring import measure
from rov_cosim.importers.tools import IMPORTERS
from rov_cosim.master.simulation import simulate
from rov_cosim.ssp import reader as ssp_reader
from rov_cosim.ssp.declaration import System, wire
from rov_cosim.ssp.z_down import Z_DOWN, sign
from rov_cosim.whole import writer as ssp_writer
from typical import typical

SET_POINT = {"x": 0.3, "y": -0.2, "z": 0.4, "psi": 0.5}
PUSH = {"x": 3.0, "y": -2.0, "z": 4.0}  # north, east, down
LABELS = ("x", "y", "z", "phi", "theta", "psi")


def system(*transformation):
    return System(
        "ned",
        "A plant of another tool",
        {"plant": "ned_plant", "controller": "adaptive_pd"},
        (
            ("plant.pose", "controller.eta_m", *transformation),
            ("plant.valid", "controller.eta_m_valid"),
            ("controller.tau", "plant.force", *transformation),
        ),
        120.0,
        {
            "plant": {f"push.{axis}": force for axis, force in PUSH.items()},
            # Without an arm's force the yaw is corrected through the umbilical alone: quick gains, for a short run.
            "controller": {
                **{f"eta_d.{axis}": value for axis, value in SET_POINT.items()},
                **{f"Gamma.{force}": 100.0 for force in FORCES},
            },
        },
    )


@pytest.fixture(scope="module")
def ned_fmus(fmus, tmp_path_factory):
    folder = tmp_path_factory.mktemp("ned")
    return {**fmus, "ned_plant": FmuBuilder.build_FMU(Path(__file__).parent / "fmus" / "ned_plant.py", folder)}


def run(ned_fmus, tmp_path, *transformation, stop_time=120.0):
    path = tmp_path / "ned.ssp"
    ssp_writer.write(wire(system(*transformation), ned_fmus), path, plain=True)
    with ssp_reader.opened(path) as wiring:
        return simulate(wiring, stop_time=stop_time)


def test_the_signs_are_those_of_a_half_turn_about_x():
    turn = Rotation.from_euler("x", np.pi).as_matrix()
    factors = np.array([Z_DOWN.get(label, 1.0) for label in LABELS])
    assert np.diag(turn) == pytest.approx(factors[:3])
    for angles in ([0.3, -0.4, 1.2], [-1.0, 1.1, -2.5]):
        assert rotation(factors[3:] * angles) == pytest.approx(turn @ rotation(np.array(angles)) @ turn)


TURNED = {
    *("F_A", "F_C", "attachment", "bias", "current_mean", "eta_0", "integral_0", "motion", "nu_0", "preload", "pull"),
    *("attitude_bias", "wire_bias", "r_A", "r_B", "r_C", "r_G", "step", "theta_hat_0", "thruster"),
}


def test_parameters_with_a_direction_turn_and_gains_masses_and_damping_do_not():
    labelled = {
        name
        for component in components().values()
        for signal in component.parameters
        for name in signal.names
        if name.rsplit(".")[-1] in Z_DOWN and "_off." not in name
    }
    turned = {name for name in labelled if sign(name) == -1}
    assert {re.split(r"[.\[]", name)[0] for name in turned} == TURNED
    still = {name.partition(".")[0] for name in labelled - turned}
    assert still == {
        *("K_P", "K_D", "K_I", "K_S", "Lambda", "Gamma", "Delta", "boundary_layer"),
        *("added_mass", "D_linear", "D_quadratic", "current_std", "attitude_noise_std", "attitude_drift_std"),
    }


def test_products_of_inertia_turn_as_the_matrix_does():
    turn = np.diag([1.0, -1.0, -1.0])
    turned = turn @ np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]]) @ turn
    factors = [sign(f"I.{label}") for label in ("xx", "xy", "xz", "yy", "yz", "zz")]
    assert np.array(factors) * [1.0, 2.0, 3.0, 4.0, 5.0, 6.0] == pytest.approx(turned[np.triu_indices(3)])


def test_a_gain_between_two_axes_turns_as_the_matrix_does():
    turn = np.diag([Z_DOWN.get(axis, 1.0) for axis in POSE])
    turned = turn @ np.ones((6, 6)) @ turn
    for (i, one), (j, other) in combinations(enumerate(POSE), 2):
        assert sign(f"K_P_off.{one}.{other}") == turned[i, j]
    forces = ["Gamma_off.dB.F_C.z", "Gamma_off.F_C.x.F_A.x", "Gamma_off.F_C.y.F_A.z", "Gamma_off.F_C.x.F_C.z"]
    assert [sign(name) for name in forces] == [-1, 1, 1, -1]


def test_ports_of_any_name_turn_by_their_last_part():
    names = ["tau.X", "tau.Y", "nu.w", "their.heave.z", "u[1]", "mass", "z"]
    assert [sign(name) for name in names] == [1, -1, -1, -1, 1, 1, -1]


def test_the_controller_holds_a_plant_that_counts_z_downwards(ned_fmus, tmp_path):
    results = run(ned_fmus, tmp_path, Z_DOWN)
    for axis, wanted in SET_POINT.items():
        assert results[f"plant.pose.{axis}"][-1] == pytest.approx(Z_DOWN.get(axis, 1.0) * wanted, abs=1e-3)
    # Held still, the estimate is the push, in axes with z up and turned to the body.
    up = np.array([Z_DOWN.get(axis, 1.0) * force for axis, force in PUSH.items()])
    body = rotation(np.array([0.0, 0.0, SET_POINT["psi"]])).T @ up
    estimated = [results[f"controller.disturbance.{axis}"][-1] for axis in "XYZ"]
    assert estimated == pytest.approx(body, abs=0.05)


@pytest.mark.parametrize("tool", typical(["ecos", "libcosim"], "ecos"))
def test_other_tools_apply_the_signs(ned_fmus, tmp_path, tool):
    if IMPORTERS[tool].version() is None:
        pytest.skip(f"{tool} is not installed; it is part of the extra importers")
    path = tmp_path / "ned.ssp"
    ssp_writer.write(wire(system(Z_DOWN), ned_fmus), path)
    assert measure(tool, "loop", path, 6.0) <= IMPORTERS[tool].tolerance


@pytest.mark.slow
def test_without_the_signs_the_plant_runs_away(ned_fmus, tmp_path):
    results = run(ned_fmus, tmp_path, stop_time=20.0)
    assert abs(results["plant.pose.z"][-1] + SET_POINT["z"]) > 0.1


def test_a_system_with_factors_is_read_back(ned_fmus, tmp_path):
    wiring = wire(system(Z_DOWN), ned_fmus)
    path = tmp_path / "ned.ssp"
    ssp_writer.write(wiring, path, plain=True)
    with ssp_reader.opened(path) as read:
        assert read.links == wiring.links
        assert {link.factor for link in read.links} == {1.0, -1.0}
