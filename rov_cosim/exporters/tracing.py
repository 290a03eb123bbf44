"""Tracing a component's functions, unchanged, into C by CasADi's NumPy mode."""

import re
from importlib.metadata import version
from typing import Any

import casadi as ca
import numpy as np

from ..components.interface import Component, Continuous, Layout, Sampled

_OPTIONS: dict[str, Any] = {"casadi_int": "int", "with_export": False}
_HEADER = """\
/* The equations of {name}, traced from the NumPy functions of its component by CasADi {version}. */
#include <math.h>

#include "hidden.h"

#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

"""


def functions(component: Component) -> list[ca.Function]:
    """Return the component's equations as CasADi functions of flat column vectors, as c/interface.h lists them."""
    mode = ca.GlobalOptions.getNumpyMode()
    ca.GlobalOptions.setNumpyMode(1)
    try:
        return _traced(component)
    finally:
        ca.GlobalOptions.setNumpyMode(mode)


def source(component: Component) -> str:
    """Return the C source of `functions`."""
    generator = ca.CodeGenerator("model", _OPTIONS)
    for function in functions(component):
        generator.add(function)
    code = str(generator.dump())
    assert not re.search(r"\b(w|iw)\[", code)  # the shell passes no memory to work in
    return _HEADER.format(name=component.name, version=version("casadi")) + code


def _traced(component: Component) -> list[ca.Function]:
    x, u, p = (ca.SX.sym(name, layout.size) for name, layout in zip("xup", _layouts(component), strict=True))
    X, U, P = (layout.unpack(_array(v)) for layout, v in zip(_layouts(component), (x, u, p), strict=True))
    traced = [_function("initial_state", [p], [component.x.pack(component.initial_state(P))])]
    if component.requirements:
        traced.append(_function("margins", [p], [ca.vertcat(*(ca.SX(r.margin(P)) for r in component.requirements))]))
    if isinstance(component, Sampled):
        draws = ca.SX.sym("w", component.draws)
        known = [x, u, p, draws]
        state, outputs = component.sample(X, U, P, _array(draws))
        y = component.y.pack(outputs)
        traced.append(_function("sample", known, [component.x.pack(state), y]))
    else:
        assert isinstance(component, Continuous)
        known = [x, u, p]
        h = ca.SX.sym("h")
        y = component.y.pack(component.outputs_of(X, U, P))
        after = component.x.pack(component.advance(X, U, P, _array(h)[0]))
        traced += [_function("outputs", known, [y]), _function("advance", [x, u, p, h], [after])]
    change = ca.SX.sym("du", component.u.size)
    traced.append(_function("derivative", [*known, change], [ca.jtimes(_column(y), u, change)]))
    return traced


def _layouts(component: Component) -> tuple[Layout, Layout, Layout]:
    return component.x, component.u, component.p


def _array(column: ca.SX) -> Any:
    """Return a column vector as the one-dimensional array that the equations expect."""
    return ca.array(column.T)[0] if column.numel() else np.zeros(0)


def _column(values: Any) -> ca.SX:
    return ca.densify(ca.vec(ca.SX(values)))


def _function(name: str, known: list[ca.SX], values: list[Any]) -> ca.Function:
    return ca.Function(f"model_{name}", known, ca.cse([_column(value) for value in values]))
