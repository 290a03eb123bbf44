"""The tables of a system in C, for `c/`: what the shell knows of its variables, and its elements with their links."""

from collections.abc import Iterable, Sequence
from hashlib import sha256

import numpy as np

from ..exporters.c_tables import limits, lines, number, text
from ..exporters.model_description import LOG_CATEGORIES
from ..master.exchange import PASSES
from ..ssp.rates import Rate, rate_of
from ..ssp.values import parse
from .layout import TYPES, Layout, Shown

STATE_VERSION = 1
"""Version of a saved state; raised whenever `State` in c/state.h changes."""


def sources(layout: Layout, guid: str, libraries: Sequence[tuple[str, str]]) -> dict[str, bytes]:
    """Return the generated C by file name; `libraries` are the binary of each element and the folder where it lies."""
    made = {
        "component.h": _sizes(layout),
        "component.c": _variables(layout, guid),
        "links.h": _link_sizes(layout),
        "links.c": _links(layout, libraries),
    }
    return {name: content.encode() for name, content in made.items()}


def _sizes(layout: Layout) -> str:
    return f"""\
/* Sizes of {layout.wiring.name}. */
enum {{
    N_U = {len(layout.inputs)},
    N_Y = {len(layout.outputs)},
    N_VARIABLES = {len(layout.variables)}
}};

{limits()}"""


def _variables(layout: Layout, guid: str) -> str:
    return f"""\
/* The variables of {layout.wiring.name}. */
#include <float.h>

#include "interface.h"

const char guid[] = {text(guid)};
const unsigned char fingerprint[16] = {{{", ".join(map(str, _fingerprint(layout, guid)))}}};

const Variable variables[N_VARIABLES] = {{
{lines(map(_variable, layout.variables))}
}};

const char *const log_categories[] = {{
{lines([text(name) for name in LOG_CATEGORIES] + ["0"])}
}};
"""


def _variable(shown: Shown) -> str:
    variable = shown.variable
    low = -np.inf if variable.min is None else float(variable.min)
    high = np.inf if variable.max is None else float(variable.max)
    # An output has a legal value before it is known.
    start = min(max(0.0, low), high) if variable.start is None else float(parse(variable.start, variable.type))
    fixed = int(variable.causality == "parameter" and variable.variability != "tunable")
    values = ", ".join(map(number, (start, low, high)))
    return f"{{{text(variable.name)}, {variable.type.upper()}, {fixed}, {values}}}"


def _fingerprint(layout: Layout, guid: str) -> bytes:
    """Return what tells the saved states of this version of this system from all others."""
    made_of = [str(STATE_VERSION), guid, repr(layout.wiring.links), repr(layout.wiring.step_size)]
    return sha256("\n".join(made_of).encode()).digest()[:16]


def _link_sizes(layout: Layout) -> str:
    outputs = {type_: sum(shown.variable.type == type_ for shown in layout.outputs) for type_ in TYPES}
    fed = {type_: sum(len(by_type[type_]) for by_type in layout.fed) for type_ in TYPES}
    return f"""\
/* Sizes of the tables in links.c. */
#ifndef LINKS_H
#define LINKS_H

#include "loop.h"

enum {{
    N_ELEMENTS = {len(layout.wiring.elements)},
    N_COPIES = {len(layout.copies)},
    N_WHOLE_OUTPUTS = {outputs["Integer"] + outputs["Boolean"]},
    N_FED_REALS = {fed["Real"]},
    N_FED_WHOLES = {fed["Integer"] + fed["Boolean"]},
    ROW_SIZE = {8 + 8 * outputs["Real"] + 4 * outputs["Integer"] + outputs["Boolean"]},
    MOST_PASSES = {PASSES + len(layout.wiring.links)}
}};

extern const Copy copies[];
extern const uint32_t whole_references[]; /* of the outputs that are no Reals */

#endif
"""


def _links(layout: Layout, libraries: Sequence[tuple[str, str]]) -> str:
    fed = [variable.valueReference for by_type in layout.fed for vs in by_type.values() for variable in vs]
    wholes = [shown.variable.valueReference for shown in layout.outputs if shown.variable.type != "Real"]
    copies: list[str] = []
    places: list[int] = []
    factors: list[float] = []
    for copy in layout.copies:
        at = f"&places[{len(places)}], &places[{len(places) + len(copy.to)}], &factors[{len(factors)}]"
        copies.append(f"{{{copy.sender}, {copy.receiver}, {copy.type.upper()}, {len(copy.to)}, {at}}}")
        places += [*copy.from_, *copy.to]
        factors += copy.factors
    return f"""\
/* The elements of {layout.wiring.name} and their links. */
#include "elements.h"
#include "links.h"

const uint32_t first_output = {len(layout.inputs)};
const double inner_step = {number(layout.wiring.step_size)};

const Element elements_table[] = {{
{lines(_elements(layout, libraries))}
}};

const uint32_t owners[] = {{
{_row(shown.element for shown in layout.variables)}
}};

const fmi2ValueReference references[] = {{
{_row(shown.reference for shown in layout.variables)}
}};

const uint32_t whole_references[] = {{
{_row([*wholes, 0])}
}};

const fmi2ValueReference fed_references[] = {{
{_row([*fed, 0])}
}};

static const size_t places[] = {{
{_row([*places, 0])}
}};

static const double factors[] = {{
{_row(map(number, [*factors, 1.0]))}
}};

const Copy copies[] = {{
{lines([*copies, "{0, 0, REAL, 0, 0, 0, 0}"])}
}};
"""


def _elements(layout: Layout, libraries: Sequence[tuple[str, str]]) -> Iterable[str]:
    for i, (element, fed, names) in enumerate(zip(layout.wiring.elements, layout.fed, libraries, strict=True)):
        counts = [
            "{" + ", ".join(str(len(by_type.get(type_, ()))) for type_ in (*TYPES, "String")) + "}"
            for by_type in (layout.outputs_of(i), fed)
        ]
        words = ", ".join(map(text, (element.name, element.description.guid, *names)))
        parts, every = rate_of(element, layout.wiring.step_size) or Rate()
        yield f"{{{words}, {', '.join(counts)}, {parts}, {every}}}"


def _row(items: Iterable[object]) -> str:
    return lines([", ".join(map(str, items))]).removesuffix(",")
