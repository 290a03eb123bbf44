"""A system and its elements on the screen: connections, and what every variable is, groups of variables in a row."""

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from textwrap import wrap

from fmpy.model_description import ModelVariable

from ..ssp.swap_map import stem
from ..ssp.values import items_of, parse
from ..ssp.wiring import Element, End, Link, Wiring
from . import table

SECTIONS = {"inputs": "input", "outputs": "output", "parameters": "parameter"}
MOST_VALUES = 6
MOST_NAMES = 12
_WIDEST = (26, 14, 28, 7)


def system_lines(wiring: Wiring, width: int) -> Iterator[str]:
    """Yield what a system is made of."""
    yield from wrap(f"{wiring.name}: {wiring.description or 'no description'}", width)
    until = f"to {wiring.stop_time:g} s" if wiring.has_stop_time else "on, to a --stop-time"
    yield f"{wiring.start_time:g} s {until} in steps of {wiring.step_size:g} s"
    yield "\nelements"
    rows = [(e.name, e.description.modelName, e.description.description or "") for e in wiring.elements]
    yield from table.lines(rows, _WIDEST[:2], width)
    yield "\nconnections"
    groups: dict[tuple[str, ...], list[Link]] = {}
    for link in wiring.links:
        ends = (part for end in link[:2] for part in (end.element, stem(end.variable)))
        groups.setdefault(tuple(ends), []).append(link)
    for links in groups.values():
        sources, targets = ([str(link[i]) for link in links] for i in (0, 1))
        yield f"{joined(sources)} -> {joined(targets)}{_factors(links)}"


def element_lines(wiring: Wiring, element: Element, text: str, width: int) -> Iterator[str]:
    """Yield the variables of an element that have a text in name or meaning, or nothing if none has."""
    found = [v for v in element.description.modelVariables if text.lower() in _searched(element, v)]
    rows = {section: [v for v in found if v.causality == causality] for section, causality in SECTIONS.items()}
    if any(rows.values()):
        model = "" if element.description.modelName == element.name else f" ({element.description.modelName})"
        yield from wrap(f"{element.name}{model}: {element.description.description or 'no description'}", width)
    for section, variables in rows.items():
        if variables:
            what = {"outputs": "receiver", "inputs": "start (* set here) or source"}.get(section, "start (* set here)")
            cells = [_cells(wiring, element, group) for group in _groups(variables)]
            yield ""
            yield from table.lines([(section, "unit", what, "", "meaning"), *cells], _WIDEST, width)


def joined(names: Sequence[str]) -> str:
    """Return names that belong together as one: ``eta.x/y/z``, ``thruster[1..8].r.x/y/z``, ``K_P_off.x.y (of 15)``."""
    parts = [re.findall(r"\[\d+\]|\.?[^.\[]+", name) for name in names]
    if len({len(of) for of in parts}) == 1:
        columns = [list(dict.fromkeys(column)) for column in zip(*parts, strict=True)]
        if ["".join(combined) for combined in product(*columns)] == list(names):
            return "".join(map(_alternatives, columns))
    if len(names) > MOST_NAMES:
        return f"{names[0]} (of {len(names)})"
    first = f"{stem(names[0])}."
    return "/".join([names[0], *(name.removeprefix(first) for name in names[1:])])


def _alternatives(parts: Sequence[str]) -> str:
    if len(parts) == 1:
        return parts[0]
    if not all(part.startswith("[") for part in parts):
        return "/".join([parts[0], *(part.removeprefix(".") for part in parts[1:])])
    numbers = [int(part[1:-1]) for part in parts]
    is_range = numbers == list(range(numbers[0], numbers[-1] + 1))
    return f"[{numbers[0]}..{numbers[-1]}]" if is_range else f"[{'/'.join(map(str, numbers))}]"


def _searched(element: Element, variable: ModelVariable) -> str:
    return f"{element.name}.{variable.name} {variable.description or ''}".lower()


def _meaning(variable: ModelVariable) -> str:
    """Return the description without the label at its end that tells the members of a group apart."""
    text = variable.description or ""
    label = re.search(r" \(([^()]*)\)$", text)
    tells = label and {*re.findall(r"\w+", label[1])} <= {*re.findall(r"\w+", variable.name)}
    return text[: label.start()] if label and tells else text


def _groups(variables: Iterable[ModelVariable]) -> Iterable[list[ModelVariable]]:
    """Return variables of one group, kind and meaning together; without a meaning, of one name but the last part."""
    groups: dict[tuple[object, ...], list[ModelVariable]] = {}
    for v in variables:
        alike = _meaning(v) or re.sub(r"(\[\d+\]|\.\w+)$", "", v.name)
        is_labelled = (v.description or "").endswith(f" ({v.name})")  # a group without a name of its own
        groups.setdefault(("" if is_labelled else stem(v.name), v.type, v.variability, alike), []).append(v)
    return groups.values()


def _cells(wiring: Wiring, element: Element, group: Sequence[ModelVariable]) -> tuple[str, ...]:
    first = group[0]
    of = [*dict.fromkeys(v.unit or "" for v in group)]
    units = (", ".join(of) if len(of) < 3 else f"{of[0]}, ...") or ("" if first.type == "Real" else first.type)
    ends = {f"{element.name}.{v.name}" for v in group}
    into = [link for link in wiring.links if str(link.target) in ends]
    out = [link for link in wiring.links if str(link.source) in ends]
    what = [f"<- {source}{_factors(into)}" for source in _folded_by_group([link.source for link in into])]
    what += [f"-> {target}" for target in _folded_by_group([link.target for link in out])]
    if first.causality != "output" and len(into) < len(group):
        what.insert(0, _values(element, [v for v in group if not wiring.link_to(f"{element.name}.{v.name}")]))
    tunable = "tunable" if first.causality == "parameter" and first.variability == "tunable" else ""
    return joined([v.name for v in group]), units, ", ".join(what), tunable, _meaning(first)


def _folded_by_group(ends: Sequence[End]) -> Iterator[str]:
    groups: dict[str, list[str]] = {}
    for end in ends:
        groups.setdefault(f"{end.element}.{stem(end.variable)}", []).append(str(end))
    for group, members in groups.items():
        yield members[0] if len(members) == 1 else group


def _values(element: Element, group: Sequence[ModelVariable]) -> str:
    texts = [_value(element, variable) for variable in group]
    if len(set(texts)) == 1:
        return texts[0]
    return " ".join(texts[:MOST_VALUES]) + (f" ... ({len(texts)})" if len(texts) > MOST_VALUES else "")


def _value(element: Element, variable: ModelVariable) -> str:
    """Return the start value in the system, marked if it is not that of the FMU."""
    try:
        own = None if variable.start is None else parse(str(variable.start), variable.type)
    except ValueError:
        own = variable.start
    value = element.start_values.get(variable.name, own)
    text = str(value) if type(value) is str else str(value).lower()
    if type(value) in (int, float):
        names = [name for name, number in items_of(variable).items() if number == value]
        text = names[0] if names else f"{value:.6g}"
    return text if value == own else f"{text}*"


def _factors(links: Sequence[Link]) -> str:
    factors = [f"{link.factor:.6g}" for link in links]
    if {*factors} <= {"1"}:
        return ""
    return f", times {factors[0] if len({*factors}) == 1 else ' '.join(factors)}"
