"""The equations, traced by CasADi, give the numbers that NumPy gives."""

import numpy as np
import pytest

from rov_cosim.components.interface import Continuous
from rov_cosim.exporters import tracing
from rov_cosim.exporters.build import components

COMPONENTS = components()


def untraced(component):
    """Return the functions that are traced, of flat arrays, by name, with the kinds of their arguments."""
    x, u, p = component.x.unpack, component.u.unpack, component.p.unpack

    def initial_state(p_):
        return component.x.pack(component.initial_state(p(p_)))

    def margins(p_):
        return np.array([requirement.margin(p(p_)) for requirement in component.requirements])

    def advance(x_, u_, p_, h):
        return component.x.pack(component.advance(x(x_), u(u_), p(p_), h[0]))

    def outputs(x_, u_, p_):
        return component.y.pack(component.outputs_of(x(x_), u(u_), p(p_)))

    def sample(x_, u_, p_, w):
        state, after = component.sample(x(x_), u(u_), p(p_), w)
        return np.concatenate([component.x.pack(state), component.y.pack(after)])

    functions = {"model_initial_state": (initial_state, "p")}
    if component.requirements:
        functions["model_margins"] = (margins, "p")
    if isinstance(component, Continuous):
        return functions | {"model_advance": (advance, "xuphk"), "model_outputs": (outputs, "xupk")}
    return functions | {"model_sample": (sample, "xupwk")}


@pytest.mark.parametrize("component", COMPONENTS.values(), ids=list(COMPONENTS))
def test_traced_functions_are_those_of_numpy(component):
    random = np.random.default_rng(4)
    single = [s.names[0] for s in component.parameters if s.type == "Boolean" and not s.axes]
    switches = [component.p.names.index(name) for name in single]
    traced = tracing.functions(component)
    for name, (function, kinds) in untraced(component).items():
        for _ in range(30):
            p = component.p.start * random.uniform(0.9, 1.1, component.p.size)
            p[switches] = random.integers(0, 2, len(switches))
            drawn = {"p": p, "h": np.array([0.01]), "w": random.normal(size=getattr(component, "draws", 0))}
            drawn |= {"x": random.normal(scale=0.3, size=component.x.size)}
            drawn |= {"u": random.normal(scale=0.3, size=component.u.size)}
            drawn["k"] = traced["model_constants"](p).full().ravel()
            results = traced[name].call([drawn[kind] for kind in kinds])
            numbers = np.concatenate([result.full().ravel() for result in results])
            relative = 1e-9 if name == "model_margins" else 1e-12  # determinants by another elimination
            expected = function(*(drawn[kind] for kind in kinds if kind != "k"))
            assert numbers == pytest.approx(expected, rel=relative, abs=1e-12), name
    assert set(traced) == {*untraced(component), "model_constants", "model_derivative"}
