"""A wired system as a loop of this project's components, to linearise it."""

import numpy as np

from ..components.interface import Component, Layout, Sampled
from ..control.loop import Loop, LoopError, Port
from ..exporters.build import components
from ..exporters.model_description import GENERATION_TOOL
from ..ssp.wiring import Element, Wiring


def loop_of(wiring: Wiring) -> Loop:
    """Return the loop of a system, with its values.

    Raises
    ------
    LoopError : an element is not of this project, or is sampled at another time than the others.
    """
    known = components()
    for element in wiring.elements:
        if element.description.modelName not in known or element.description.generationTool != GENERATION_TOOL:
            raise LoopError(f"{element.name} is an FMU of others: only components of this project have slopes.")
    of = {element.name: known[element.description.modelName] for element in wiring.elements}
    loop = Loop(
        of,
        {e.name: _values(e, of[e.name].p) for e in wiring.elements},
        {e.name: _values(e, of[e.name].u) for e in wiring.elements},
        tuple((_port(of, *link.source, "y"), _port(of, *link.target, "u"), link.factor) for link in wiring.links),
        wiring.step_size,
    )
    for name, component in of.items():
        if isinstance(component, Sampled) and name in loop.moving:
            period = float(getattr(loop.p(name), component.period))
            if abs(period - wiring.step_size) > 1e-9 * period:
                raise LoopError(
                    f"{name} is sampled every {period:g} s in steps of {wiring.step_size:g} s: "
                    f"set {name}.{component.period} and the others to one time, and the step by --step."
                )
    return loop


def _values(element: Element, layout: Layout) -> np.ndarray:
    return np.array([float(element.value(name)) for name in layout.names])


def _port(of: dict[str, Component], element: str, variable: str, layout: str) -> Port:
    names: tuple[str, ...] = getattr(of[element], layout).names
    return Port(element, names.index(variable))
