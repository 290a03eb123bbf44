"""The equations, unchanged, traced by CasADi in its NumPy mode give the numbers that NumPy gives."""

import casadi as ca
import numpy as np
import pytest

from rov_cosim.components.adaptive_pd import COMPONENT as CONTROLLER
from rov_cosim.components.passive_arm import COMPONENT as ARM
from rov_cosim.components.rov_plant import COMPONENT as PLANT

RANDOM = np.random.default_rng(4)


@pytest.fixture(autouse=True)
def _numpy_mode():
    ca.GlobalOptions.setNumpyMode(1)


def step_of(component):
    """Return (x, u, p, w) -> all that one step yields, flat; w is the step size or the draws."""

    def sampled(x, u, p, w):
        state, outputs = component.sample(component.x.unpack(x), component.u.unpack(u), component.p.unpack(p), w)
        return np.concatenate([component.x.pack(state), component.y.pack(outputs)])

    def continuous(x, u, p, w):
        u, p = component.u.unpack(u), component.p.unpack(p)
        x = component.x.pack(component.advance(component.x.unpack(x), u, p, w[0]))
        return np.concatenate([x, component.y.pack(component.outputs_of(component.x.unpack(x), u, p))])

    return sampled if component is not PLANT else continuous


def trace(function, *sizes):
    symbols = [ca.SX.sym(f"v{i}", n) for i, n in enumerate(sizes)]
    traced = function(*(ca.array(symbol.T)[0] for symbol in symbols))
    return ca.Function("f", symbols, [ca.vec(ca.SX(traced))])


@pytest.mark.parametrize("component", [PLANT, ARM, CONTROLLER], ids=lambda c: c.name)
def test_a_traced_step_is_the_numpy_step(component):
    step = step_of(component)
    traced = trace(step, component.x.size, component.u.size, component.p.size, 6)
    booleans = {name for s in component.parameters for name in s.names if s.type == "Boolean"}
    for _ in range(30):
        x = RANDOM.normal(size=component.x.size) * 0.3
        u = RANDOM.normal(size=component.u.size) * 0.3
        p = component.p.start * RANDOM.uniform(0.9, 1.1, component.p.size)
        flips = [i for i, name in enumerate(component.p.names) if name in booleans and "enabled" not in name]
        p[flips] = RANDOM.integers(0, 2, len(flips))
        w = np.concatenate([[0.01], RANDOM.normal(size=5)])
        assert np.array(traced(x, u, p, w)).ravel() == pytest.approx(step(x, u, p, w), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("component", [PLANT, CONTROLLER], ids=lambda c: c.name)
def test_the_requirements_can_be_traced_too(component):
    for requirement in component.requirements:

        def margin(p, requirement=requirement):
            return np.reshape(requirement.margin(component.p.unpack(p)), (1,))

        p = component.p.start
        assert float(trace(margin, component.p.size)(p)) == pytest.approx(float(margin(p)[0]), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("component", [PLANT, ARM, CONTROLLER], ids=lambda c: c.name)
def test_the_initial_state_can_be_traced_too(component):
    def initial(p):
        return component.x.pack(component.initial_state(component.p.unpack(p)))

    p = component.p.start
    assert np.array(trace(initial, component.p.size)(p)).ravel() == pytest.approx(initial(p))
