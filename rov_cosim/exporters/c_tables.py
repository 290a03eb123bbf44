"""The declared interface of a component as C tables, for the hand-written shell in `c/`."""

import json
from collections.abc import Iterable
from hashlib import sha256
from importlib.metadata import version

import numpy as np

from ..components.instance import MOST_INTERNAL_STEPS, TIME_TOLERANCE
from ..components.interface import Component, Continuous, Sampled
from ..components.stepping import SAMPLE_TOLERANCE, SINGLE, STEP_TOLERANCE
from .model_description import LOG_CATEGORIES

STATE_VERSION = 4
"""Version of a saved state; raised whenever `State` in c/state.h changes."""


def header(component: Component, n_constants: int) -> str:
    """Return component.h: sizes, the places of the parameters that the shell reads, and the limits of time."""
    names = component.p.names
    if isinstance(component, Sampled):
        draws, internal_step = component.draws, names.index(component.period)
        seed = names.index(component.seed) if component.seed else 0
    else:
        assert isinstance(component, Continuous)
        draws, internal_step, seed = 0, names.index(component.max_step), 0
    return f"""\
/* Sizes of {component.name}. */
enum {{
    N_U = {component.u.size},
    N_Y = {component.y.size},
    N_X = {component.x.size},
    N_VARIABLES = {component.u.size + component.y.size + component.p.size},
    N_REQUIREMENTS = {len(component.requirements)},
    N_DRAWS = {draws},
    N_CONSTANTS = {max(n_constants, 1)}, /* at least one, for C has no empty array */
    INTERNAL_STEP = {internal_step}, /* the parameter with the time between samples, or the longest internal step */
    SEED = {seed} /* the parameter that selects the draws; without draws any, and not to be read */
}};

{limits()}"""


def limits() -> str:
    """Return the limits of time as C macros."""
    return f"""\
/* As in the Python sources, which tell what they are. */
#define TIME_TOLERANCE {TIME_TOLERANCE!r}
#define MOST_INTERNAL_STEPS {float(MOST_INTERNAL_STEPS)!r}
#define SINGLE {SINGLE!r}
#define STEP_TOLERANCE {STEP_TOLERANCE!r}
#define SAMPLE_TOLERANCE {SAMPLE_TOLERANCE!r}
"""


def source(component: Component, guid: str) -> str:
    """Return component.c: variables, messages, and what identifies the component."""
    return f"""\
/* The declared interface of {component.name}. */
#include <float.h>

#include "interface.h"

const char guid[] = {text(guid)};
const unsigned char fingerprint[16] = {{{", ".join(map(str, _fingerprint(component)))}}};

const Variable variables[N_VARIABLES] = {{
{lines(_variables(component))}
}};

const char *const states[N_X] = {{
{lines(map(text, component.x.names))}
}};

const char *const requirements[] = {{
{lines([text(requirement.message) for requirement in component.requirements] + ["0"])}
}};

const Notice notices[] = {{
{lines([*_notices(component), "{0, 0.0, 0}"])}
}};

const char *const log_categories[] = {{
{lines([text(name) for name in LOG_CATEGORIES] + ["0"])}
}};
"""


def arrays(title: str, sizes: Iterable[tuple[str, int]]) -> str:
    """Return arrays.c: the arrays of FMI 3.0 by name and size, each where its first element is among the variables."""
    rows = [f"{{{text(name)}, {size}}}" if i == 0 else "{0, 0}" for name, size in sizes for i in range(size)]
    return f"""\
/* The arrays of {title}. */
#include "fmi3_arrays.h"

const Array arrays[N_VARIABLES] = {{
{lines(rows)}
}};
"""


def _variables(component: Component) -> Iterable[str]:
    for signals, is_parameter in ((component.inputs + component.outputs, False), (component.parameters, True)):
        for signal in signals:
            fixed = int(is_parameter and not signal.tunable)
            columns = (signal.elements(values) for values in (signal.start, signal.minimum, signal.maximum))
            for name, *numbers in zip(signal.names, *columns, strict=True):
                values = ", ".join(number(value) for value in numbers)
                yield f"{{{text(name)}, {signal.type.upper()}, {fixed}, {values}}}"


def _notices(component: Component) -> list[str]:
    names = component.y.names
    return [f"{{{names.index(n.key)}, {number(n.value)}, {text(n.message)}}}" for n in component.notices]


def _fingerprint(component: Component) -> bytes:
    """Return what tells the saved states of this version of this component from all others."""
    layouts = (component.u, component.y, component.p, component.x)
    names = [
        component.name,
        version("rov-cosim"),
        str(STATE_VERSION),
        *(name for layout in layouts for name in layout.names),
    ]
    return sha256("\n".join(names).encode()).digest()[:16]


def number(value: float) -> str:
    """Return a number as C reads it, to the last bit."""
    if np.isinf(value):
        return "DBL_MAX" if value > 0 else "-DBL_MAX"
    return repr(float(value))


def text(words: str) -> str:
    """Return a string literal of C."""
    return json.dumps(words, ensure_ascii=False)


def lines(items: Iterable[str]) -> str:
    """Return items of a table, a line each."""
    return "\n".join(f"    {item}," for item in items)
