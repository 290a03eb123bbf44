"""Tracing a component's functions, and others, unchanged, into C by CasADi's NumPy mode."""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import version
from threading import Lock
from typing import Any

import casadi as ca
import numpy as np

from ..components.interface import Component, Continuous, Layout, Sampled

_OPTIONS: dict[str, Any] = {"casadi_int": "int", "with_export": False}
_HEADER = """\
/* The equations of {title} by CasADi {version}. */
#include <math.h>

#include "hidden.h"

#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

"""

_STEPPED = ("model_advance", "model_outputs", "model_sample")
"""The functions that are called at every step."""

ALONE = Lock()
"""To be held while tracing and writing: CasADi's graphs are for one thread at a time."""


def functions(component: Component) -> dict[str, ca.Function]:
    """Return the component's equations as CasADi functions of flat column vectors by name, as c/interface.h lists them.

    What follows from the parameters alone is a function of its own, for it need not be worked out at every step.
    """
    with _numpy_mode():
        return {function.name(): function for function in _traced(component)}


def of_parameters(name: str, function: Callable[[Any, Any], Any], n: int, n_p: int) -> dict[str, ca.Function]:
    """Return a function of flat arrays of n values and of n_p parameters, traced, as two by name.

    NAME_constants gives what follows from the parameters alone, NAME the result of the values, the parameters and that.
    """
    with _numpy_mode():
        x, p = ca.SX.sym("x", n), ca.SX.sym("p", n_p)
        (result,), constants, given = _prepared([function(_array(x), _array(p))], p)
        known = {name: ([x, p, constants], [result]), f"{name}_constants": ([p], [given])}
        return {name: ca.Function(name, *ends) for name, ends in known.items()}


def n_constants(traced: Mapping[str, ca.Function], name: str = "model") -> int:
    """Return how many values follow from the parameters alone."""
    return int(traced[f"{name}_constants"].numel_out(0))


def source(component: Component, traced: Mapping[str, ca.Function]) -> str:
    """Return the C source of `functions`."""
    text = code(f"{component.name}, traced from the NumPy functions of its component", "model", traced)
    for name in traced:
        if name in _STEPPED:
            text = _by_processor(text, name)
    return text.replace('#include "hidden.h"\n', '#include "hidden.h"\n#include "processor.h"\n', 1)


def code(title: str, name: str, traced: Mapping[str, ca.Function]) -> str:
    """Return traced functions in C, told of by a title; what they share begins with the name."""
    generator = ca.CodeGenerator(name, _OPTIONS)
    for function in traced.values():
        generator.add(function)
    text = str(generator.dump())
    assert not re.search(r"\b(w|iw)\[", text)  # the shell passes no memory to work in
    # CasADi asks at each value whether its vector was passed; the shell passes all, and asking is a third of the time.
    text = re.sub(r"arg\[(\d+)\]\? arg\[\1\]\[(\d+)\] : 0", r"arg[\1][\2]", text)
    text = re.sub(r"if \(res\[(\d+)\]!=0\) (?=res\[\1\])", "", text)
    assert not re.search(r"\? *arg\[|!= *0\) *res\[", text)
    return _HEADER.format(title=title, version=version("casadi")) + text


def _by_processor(text: str, name: str) -> str:
    """Return C of CasADi with a function in the forms of c/processor.h."""
    found = re.search(rf"int {name}\([^)]*\)\{{\s*return (casadi_f\d+)\([^)]*\);\s*\}}", text)
    assert found
    body = found[1]
    text = text.replace(found[0], f"BY_PROCESSOR({name}, {body})")
    return text.replace(f"static int {body}(", f"STEPPED int {body}(", 1)


@contextmanager
def _numpy_mode() -> Iterator[None]:
    mode = ca.GlobalOptions.getNumpyMode()
    ca.GlobalOptions.setNumpyMode(1)
    try:
        yield
    finally:
        ca.GlobalOptions.setNumpyMode(mode)


def _traced(component: Component) -> Iterator[ca.Function]:
    x, u, p = (ca.SX.sym(name, layout.size) for name, layout in zip("xup", _layouts(component), strict=True))
    X, U, P = (layout.unpack(_array(v)) for layout, v in zip(_layouts(component), (x, u, p), strict=True))
    yield _function("initial_state", [p], [component.x.pack(component.initial_state(P))])
    if component.requirements:
        yield _function("margins", [p], [ca.vertcat(*(ca.SX(r.margin(P)) for r in component.requirements))])
    if isinstance(component, Sampled):
        w = ca.SX.sym("w", component.draws)
        known = [x, u, p, w]
        state, outputs = component.sample(X, U, P, _array(w))
        y = component.y.pack(outputs)
        (after, now), constants, given = _prepared([component.x.pack(state), y], p)
        yield _function("sample", [*known, constants], [after, now])
    else:
        assert isinstance(component, Continuous)
        h = ca.SX.sym("h")
        known = [x, u, p]
        y = component.y.pack(component.outputs_of(X, U, P))
        (after, now), constants, given = _prepared([component.x.pack(component.advance(X, U, P, _array(h)[0])), y], p)
        yield _function("advance", [*known, h, constants], [after])
        yield _function("outputs", [*known, constants], [now])
    yield ca.Function("model_constants", [p], [given])
    change = ca.SX.sym("du", component.u.size)
    yield _function("derivative", [*known, change], [ca.jtimes(_column(y), u, change)])


def _prepared(values: list[Any], p: ca.SX) -> tuple[list[ca.SX], ca.SX, ca.SX]:
    """Return values in terms of constants, the symbols of these, and what they are in terms of the parameters p."""
    found, symbols, given = ca.extract_parametric(ca.cse([_column(value) for value in values]), p)
    return found, ca.vertcat(*symbols), ca.vertcat(*given)


def _layouts(component: Component) -> tuple[Layout, Layout, Layout]:
    return component.x, component.u, component.p


def _array(column: ca.SX) -> Any:
    """Return a column vector as the one-dimensional array that the equations expect."""
    return ca.array(column.T)[0] if column.numel() else np.zeros(0)


def _column(values: Any) -> ca.SX:
    return ca.densify(ca.vec(ca.SX(values)))


def _function(name: str, known: list[ca.SX], values: list[Any]) -> ca.Function:
    return ca.Function(f"model_{name}", known, ca.cse([_column(value) for value in values]))
