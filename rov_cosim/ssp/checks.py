"""What keeps a system of FMUs from running: its elements, links and times, all told at once."""

from collections import Counter
from collections.abc import Iterable, Mapping
from functools import lru_cache

import numpy as np
from fmpy.model_description import ModelDescription

from .rates import fixed_step, rate_of
from .values import are_alike, is_settable
from .wiring import Element, End, Link, Wiring, suggestion, unit_factor, variables_of

MOST_STEPS = 10_000_000
_TIME_RESOLUTION = 1e-3
"""Of a step: what the rounding of a time may come to."""
LONGEST_NAME = 100
"""Characters of an element's name, which is that of a file too."""


def problems_of(wiring: Wiring) -> list[str]:
    """Return a sentence for everything that keeps the system from running."""
    times = list(_experiment_problems(wiring))
    rates = [] if times else _rate_problems(wiring)
    return [*faults_of(wiring), *times, *rates]


def faults_of(wiring: Wiring) -> list[str]:
    """Return a sentence for everything that is wrong with a system in whatever times and steps it runs."""
    form = tuple((element.name, element.description) for element in wiring.elements)
    return [*_form_problems(form, wiring.links), *_value_problems(wiring)]


def unit_problems(links: Iterable[Link], elements: Mapping[str, Element]) -> Iterable[str]:
    """Yield a sentence for every link between units that no factor converts."""
    for link in links:
        found = [elements[end.element].variables.get(end.variable) for end in link[:2] if end.element in elements]
        units = [variable.unit for variable in found if variable is not None]
        if len(units) == 2 and unit_factor(link, elements) is None:
            what = f"unit {units[0]} does not match {units[1]}: no factor converts one to the other."
            yield f"Connection {link.source} -> {link.target}: {what}"


_Form = tuple[tuple[str, ModelDescription], ...]
"""The elements of a system, by name and description."""


@lru_cache(maxsize=8)  # runs of a campaign differ in values alone
def _form_problems(form: _Form, links: tuple[Link, ...]) -> tuple[str, ...]:
    return (*_element_problems(form), *_link_problems(form, links))


def _element_problems(form: _Form) -> Iterable[str]:
    for name, times in Counter(name for name, _ in form).items():
        if times > 1:
            yield f"There are {times} elements of the name {name}: give each a name of its own."
        if {*name} & {*"/\\"} or not name.isprintable() or not name.strip():
            yield f"The element name {name!r:.80} is blank, or holds a slash or what cannot be shown: rename it."
        if len(name) > LONGEST_NAME:
            yield f"The element name {name[:40]}... has {len(name)} characters; expected at most {LONGEST_NAME}."
    for name, times in Counter(sorted(_columns(form))).items():
        if times > 1:
            yield f"{name} is {times} outputs, of elements whose names have dots: rename one."
    yield from _single_problems(form)


def _value_problems(wiring: Wiring) -> Iterable[str]:
    for element in wiring.elements:
        known = element.variables
        for variable in element.start_values:
            if variable not in known:
                hint = suggestion(variable, known, f"{element.name}.")
                yield f"There is no parameter {element.name}.{variable}." + hint
            elif not is_settable(known[variable]):
                yield f"{element.name}.{variable} cannot be set: it is neither a parameter nor an input, nor exact."


def _columns(form: _Form) -> Iterable[str]:
    """Yield the columns of the results, elements of one name but once."""
    for name, description in dict(form).items():
        yield from (
            f"{name}.{variable.name}"
            for variable in variables_of(description).values()
            if variable.causality == "output"
        )


def _single_problems(form: _Form) -> Iterable[str]:
    """Yield a sentence for each FMU that stands twice in a system and can be instantiated only once in a process."""
    users: dict[tuple[str, str], list[str]] = {}
    for name, description in form:
        if description.coSimulation.canBeInstantiatedOnlyOncePerProcess:
            key = description.coSimulation.modelIdentifier, description.guid
            users.setdefault(key, []).append(name)
    for (model, _), names in users.items():
        if len(names) > 1:
            yield (
                f"{' and '.join(names)} are of one FMU, {model}, of which a process can have one instance alone "
                "(canBeInstantiatedOnlyOncePerProcess): leave one out."
            )


def _link_problems(form: _Form, links: Iterable[Link]) -> Iterable[str]:
    known = {name: variables_of(description) for name, description in form}
    driven: dict[End, End] = {}
    for source, target, factor in links:
        ends = []
        where = f"Connection {source} -> {target}"
        for end, causality in ((source, "output"), (target, "input")):
            variables = known.get(end.element)
            variable = variables.get(end.variable) if variables is not None else None
            if variables is None:
                yield f"{where}: there is no element {end.element}." + suggestion(end.element, known)
            elif variable is None:
                hint = suggestion(end.variable, variables)
                yield f"{where}: the FMU of {end.element} has no variable {end.variable}." + hint
            elif variable.causality != causality:
                yield f"{where}: {end} is of causality {variable.causality}, not {causality}."
            else:
                ends.append(variable)
        if len(ends) == 2:
            types = [variable.type for variable in ends]
            if not are_alike(*types):
                yield f"{where}: type {types[0]} does not match {types[1]}."
            elif types[0] == "String":
                yield f"{where}: Strings are not handed on; set the parameter by its value."
            if factor != 1 and (ends[0].type != "Real" or not np.isfinite(factor)):
                yield f"{where}: the factor {factor:g} is not for a {ends[0].type}, or not finite."
        if target in driven:
            yield f"Input {target} has two sources, {driven[target]} and {source}: remove one connection."
        driven[target] = source


def _experiment_problems(wiring: Wiring) -> Iterable[str]:
    start, stop, step = wiring.start_time, wiring.stop_time, wiring.step_size
    if not wiring.has_stop_time:
        yield "There is no time at which a run ends: give one by --stop-time."
    elif not start < stop or not np.isfinite(start):
        yield f"The run is from {start} s to {stop} s; expected finite times, the stop after the start."
    elif not 0 < step < np.inf:
        yield f"The step size is {step} s; expected a positive number of seconds."
    elif (stop - start) / step * (1 + 1e-9) < 1:
        yield f"The run from {start} s to {stop} s is shorter than a step of {step} s."
    elif (stop - start) / step > MOST_STEPS:
        n = (stop - start) / step
        yield f"The run has {n:.3g} steps; expected at most {MOST_STEPS:.3g}: take longer steps."
    elif np.spacing(max(abs(start), abs(stop))) > _TIME_RESOLUTION * step:
        yield f"From {start:g} s to {stop:g} s numbers are too coarse for steps of {step:g} s: start nearer to 0 s."


def _rate_problems(wiring: Wiring) -> Iterable[str]:
    duration = wiring.stop_time - wiring.start_time
    for element in wiring.elements:
        fixed = fixed_step(element)
        if fixed is None:
            continue
        what = f"{element.name} takes steps of {fixed:g} s alone (canHandleVariableCommunicationStepSize is false), "
        if duration / fixed > MOST_STEPS:
            yield f"{what}which are {duration / fixed:.3g} in the run; expected at most {MOST_STEPS:.3g}."
        elif duration / fixed * (1 + 1e-9) < 1:
            yield f"{what}and the run from {wiring.start_time:g} s to {wiring.stop_time:g} s is shorter than one."
        elif rate_of(element, wiring.step_size) is None:
            yield (
                f"{what}the system steps by {wiring.step_size:g} s: one must divide the other, as by --step {fixed:g}."
            )
