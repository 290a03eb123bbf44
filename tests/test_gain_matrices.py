"""Gains that couple axes: what counts as positive definite, and that the loop of the theorem holds with them."""

import numpy as np
import pytest

from rig import Rig, parameters
from rov_cosim.components.adaptive_pd import COMPONENT as CONTROLLER
from rov_cosim.components.gain_matrices import definiteness, symmetric
from rov_cosim.components.instance import ComponentError
from rov_cosim.control.certificate import Certificate
from rov_cosim.control.lyapunov import Descent
from rov_cosim.control.theorem import sharp
from rov_cosim.ssp.declaration import wire
from rov_cosim.study.changes import Changes
from rov_cosim.study.looped import loop_of
from rov_cosim.study.runs import simulated
from rov_cosim.systems.catalogue import SYSTEMS

FULL = {"controller.K_P_off.x.y": 12.0, "controller.K_P_off.z.psi": -9.0, "controller.K_D_off.x.psi": 7.0}
FULL |= {"controller.K_D_off.y.z": -8.0, "controller.Gamma_off.dB.F_A.z": 5.0, "controller.Gamma_off.F_C.x.F_A.x": -4.0}


def test_definiteness_is_that_of_the_eigenvalues():
    random, seen = np.random.default_rng(2), []
    for _ in range(400):
        n = int(random.integers(2, 8))
        factor = random.normal(size=(n, n))
        matrix = factor @ factor.T - random.uniform(0, 0.6) * np.eye(n)
        if (ones := np.sqrt(np.diag(matrix).clip(0))).min() == 0:
            continue
        matrix /= np.outer(ones, ones)
        least = np.linalg.eigvalsh(matrix)[0]
        units = 10.0 ** random.uniform(-3, 3, n)
        full = matrix * np.outer(units, units)
        off = full[np.triu_indices(n, 1)]
        assert symmetric(np.diag(full), off) == pytest.approx(full, rel=1e-12)
        if abs(least) > 1e-6:
            assert (definiteness(np.diag(full), off) > 0) == (least > 0)
            seen.append(bool(least > 0))
    assert min(seen.count(True), seen.count(False)) > 50


def test_a_gain_of_0_couples_to_none():
    p = parameters(CONTROLLER)
    p.Gamma = np.array([0.0, *p.Gamma[1:]])  # a force that is not adapted
    assert CONTROLLER.unmet(p) == []
    p.Gamma_off = np.array([1e-3, *p.Gamma_off[1:]])
    assert CONTROLLER.unmet(p) == [one.message for one in CONTROLLER.requirements if "Gamma_off" in one.message]


@pytest.mark.parametrize(
    ("values", "key"),
    [({"K_P_off.x.y": 80.1}, "K_P"), ({"K_D_off.phi.psi": -46.0}, "K_D"), ({"Gamma_off.dB.F_C.z": 10.0}, "Gamma")],
)
def test_gains_that_are_not_positive_definite_are_refused_by_name(values, key):
    with pytest.raises(ComponentError, match=f"{key} is not positive definite: make {key}_off"):
        Rig(CONTROLLER, values).start()


def test_the_theorem_holds_with_full_gains(fmus):
    full = Changes(values=FULL).applied(wire(SYSTEMS["station_keeping"]))
    certificate = Certificate("full", loop_of(full))
    expected = np.array([[80.0, 12, 0, 0], [12, 80, 0, 0], [0, 0, 100, -9], [0, 0, -9, 30]])
    assert np.abs(certificate.case.K_P - expected).max() < 1e-4
    assert all(sharp(case).margin > 0 for case in (certificate.case, certificate.case.undamped))
    assert Descent(certificate.loop).search(100).share < 0
    run = simulated(full, progress=lambda steps: steps)
    assert run.score.verdict == "held"
