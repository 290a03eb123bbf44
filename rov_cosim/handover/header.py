"""The header of a component's FMU for hosts in C and C++: value references by name, types and counts."""

import re
import textwrap
from collections.abc import Iterator
from itertools import combinations

from ..components.interface import SAMPLE_TIME, Component, Signal
from ..exporters.model_description import describe
from ..exporters.native_export import description

_PREFACE = """\
/* {name}.fmu, version {version}: its variables in C or C++. Generated from the declared interface.

   A group g of n elements has g_count = n and g[], the value references of all, for one call of fmi2SetReal; an
   element has its own name, g_x or g_1. {name}_variables[] has all variables by their names in the FMU. */
"""


def header(component: Component) -> str:
    """Return the header of a component: a group for each signal, and a table of all variables by name."""
    name = component.name
    guard = f"{name.upper()}_H"
    references = {v.name: v.valueReference for v in describe(component).modelVariables}
    groups = {"Inputs": component.inputs, "Outputs": component.outputs, "Parameters": component.parameters}
    every = [signal for signals in groups.values() for signal in signals]
    called = {signal.names: signal.key for signal in every}
    for first, second in combinations(every, 2):
        if first.key == second.key:  # as thrust_loss, an output of scenario and parameters thruster[i].loss
            called[second.names] = _identifier(re.sub(r"\[\d+]", "", second.names[0]))
    lines = [_PREFACE.format(name=name, version=description(component).version)]
    lines += [f"#ifndef {guard}", f"#define {guard}", ""]
    lines += [f'#define {name.upper()}_GUID "{description(component).guid}"']
    lines += [f"#define {name.upper()}_STEP {SAMPLE_TIME!r} /* s */"]
    for title, signals in groups.items():
        lines += ["", f"/* {title} */"]
        for signal in signals:
            lines += _group(f"{name}_{called[signal.names]}", name, signal, references)
    lines += ["", f"enum {{ {name}_variable_count = {len(references)} }};", ""]
    lines += ["static const struct {", "    const char *name;", "    unsigned int reference;"]
    lines += ["    char type; /* R: Real, I: Integer, B: Boolean */", f"}} {name}_variables[] = {{"]
    lines += [f"    {{\"{n}\", {references[n]}, '{signal.type[0]}'}}," for signal in every for n in signal.names]
    return "\n".join([*lines, "};", "", "#endif", ""])


def _group(group: str, prefix: str, signal: Signal, references: dict[str, int]) -> Iterator[str]:
    numbers = [references[name] for name in signal.names]
    what = ", ".join(filter(None, [signal.type, *dict.fromkeys(signal.units)]))
    elements = [f"{prefix}_{_identifier(n)} = {i}" for n, i in zip(signal.names, numbers, strict=True) if signal.axes]
    yield f"/* {signal.description}: {what} */"
    yield _wrapped(f"enum {{ {', '.join([f'{group}_count = {signal.size}', *elements])} }};")
    yield _wrapped(f"static const unsigned int {group}[] = {{{', '.join(map(str, numbers))}}};")


def _wrapped(line: str) -> str:
    return textwrap.fill(line, 120, subsequent_indent="    ")


def _identifier(name: str) -> str:
    return re.sub(r"\W+", "_", name).strip("_")
