"""What keeps a system of FMUs from running: its elements, links and times, all told at once."""

from collections import Counter
from collections.abc import Iterable

import numpy as np
from fmpy.model_description import ModelVariable

from .rates import fixed_step, rate_of
from .units import conversion, units_of
from .values import TYPES
from .wiring import Element, End, Wiring, suggestion

MOST_STEPS = 10_000_000


def problems_of(wiring: Wiring) -> list[str]:
    """Return a sentence for everything that keeps the system from running."""
    times = list(_experiment_problems(wiring))
    rates = [] if times else _rate_problems(wiring)
    return [*_element_problems(wiring), *_link_problems(wiring), *times, *rates]


def _element_problems(wiring: Wiring) -> Iterable[str]:
    for name, times in Counter(element.name for element in wiring.elements).items():
        if times > 1:
            yield f"There are {times} elements of the name {name}: give each a name of its own."
        if "." in name or "/" in name or "\\" in name:
            yield f"The element name {name} holds a dot or a slash: rename it."
    for element in wiring.elements:
        for variable in element.start_values:
            if variable not in element.variables:
                hint = suggestion(variable, element.variables, f"{element.name}.")
                yield f"There is no parameter {element.name}.{variable}." + hint
            elif element.variables[variable].causality not in ("input", "parameter"):
                yield f"{element.name}.{variable} cannot be set: it is neither a parameter nor an input."


def _link_problems(wiring: Wiring) -> Iterable[str]:
    known = {element.name: element for element in wiring.elements}
    driven: dict[End, End] = {}
    for source, target, factor in wiring.links:
        ends = []
        where = f"Connection {source} -> {target}"
        for end, causality in ((source, "output"), (target, "input")):
            element = known.get(end.element)
            variable = element.variables.get(end.variable) if element else None
            if element is None:
                yield f"{where}: there is no element {end.element}." + suggestion(end.element, known)
            elif variable is None:
                hint = suggestion(end.variable, element.variables)
                yield f"{where}: the FMU of {element.name} has no variable {end.variable}." + hint
            elif variable.causality != causality:
                yield f"{where}: {end} is of causality {variable.causality}, not {causality}."
            else:
                ends.append((element, variable))
        if len(ends) == 2:
            yield from _mismatches(where, *ends[0], *ends[1])
            if factor != 1 and (ends[0][1].type != "Real" or not np.isfinite(factor)):
                yield f"{where}: the factor {factor:g} is not for a {ends[0][1].type}, or not finite."
        if target in driven:
            yield f"Input {target} has two sources, {driven[target]} and {source}: remove one connection."
        driven[target] = source


def _experiment_problems(wiring: Wiring) -> Iterable[str]:
    start, stop, step = wiring.start_time, wiring.stop_time, wiring.step_size
    if not start < stop < np.inf or start == -np.inf:
        yield f"The run is from {start} s to {stop} s; expected finite times, the stop after the start."
    elif not 0 < step < np.inf:
        yield f"The step size is {step} s; expected a positive number of seconds."
    elif (stop - start) / step * (1 + 1e-9) < 1:
        yield f"The run from {start} s to {stop} s is shorter than a step of {step} s."
    elif (stop - start) / step > MOST_STEPS:
        n = (stop - start) / step
        yield f"The run has {n:.3g} steps; expected at most {MOST_STEPS:.3g}: take longer steps."


def _rate_problems(wiring: Wiring) -> Iterable[str]:
    for element in wiring.elements:
        if rate_of(element, wiring.step_size) is None:
            fixed = fixed_step(element)
            yield (
                f"{element.name} takes steps of {fixed:g} s alone (canHandleVariableCommunicationStepSize is false), "
                f"the system steps by {wiring.step_size:g} s: one must divide the other, as by --step {fixed:g}."
            )


def _mismatches(where: str, from_: Element, source: ModelVariable, to: Element, target: ModelVariable) -> Iterable[str]:
    if source.type != target.type:
        yield f"{where}: type {source.type} does not match {target.type}."
    elif source.type not in TYPES:
        yield f"{where}: type {source.type} is not supported; {', '.join(TYPES)} are."
    if conversion(source.unit, units_of(from_.description), target.unit, units_of(to.description)) is None:
        yield f"{where}: unit {source.unit} does not match {target.unit}: no factor converts one to the other."
