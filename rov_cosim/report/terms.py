"""The Lyapunov function along the runs in a page: traced into C, beside a table of what it takes of a system."""

from collections.abc import Iterable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from ..components.adaptive_pd import COMPONENT as LAW
from ..components.interface import Component, Layout
from ..components.passive_arm import COMPONENT as ARM
from ..components.rov_plant import COMPONENT as PLANT
from ..components.scenario import COMPONENT as SCENARIO
from ..control import lyapunov
from ..exporters import tracing
from ..exporters.native_export import hand_written
from ..systems.loop import element_of
from ..whole import layout as whole
from ..whole import linking

TERMS = ("lyapunov.of_motion", "lyapunov.of_estimate")
"""The terms of V in J, of `lyapunov.terms`, as the page names them beside the variables of a system."""

_NAME = "lyapunov"


class _Part(NamedTuple):
    """Some outputs or parameters of a component, by key."""

    component: Component
    keys: tuple[str, ...]

    @property
    def layout(self) -> Layout:
        signals = {signal.key: signal for signal in (*self.component.outputs, *self.component.parameters)}
        return Layout(tuple(signals[key] for key in self.keys))

    @property
    def ends(self) -> list[str]:
        return [f"{element_of(self.component.name)}.{name}" for name in self.layout.names]


_MOTION = (
    _Part(PLANT, ("eta", "nu")),
    _Part(SCENARIO, ("eta_d", "F_umbilical")),
    _Part(ARM, ("F_arm",)),
    _Part(LAW, ("theta_hat",)),
)
_OF_PLANT = _Part(PLANT, ("mass", "I", "r_G", "added_mass", "forces"))
_OF_LAW = _Part(LAW, ("K_P", "K_P_off", "Gamma", "Gamma_off", "epsilon_0", "alpha", "adaptation", "control_roll_pitch"))


def are_in(layout: whole.Layout) -> bool:
    """Tell whether a system has all that the terms take: it is one of the adaptive law."""
    return set(_ends(_MOTION) + _ends((_OF_PLANT, _OF_LAW))) <= {shown.variable.name for shown in layout.variables}


def unit() -> dict[str, bytes]:
    """Return the C of the terms, to be compiled apart; it is the same for all systems."""
    code = {f"{_NAME}.c": _traced()[0].encode(), "hidden.h": hand_written()["hidden.h"]}
    return linking.unit(_NAME, _NAME, [f"{_NAME}.c"], code, "The terms of the Lyapunov function.")


def table(layout: whole.Layout) -> bytes:
    """Return lyapunov.h: the value references of what the terms take of a system, none if it has not all of that."""
    places = {shown.variable.name: shown.variable.valueReference for shown in layout.variables}
    motion, parameters = (
        [places[end] for end in _ends(parts)] if are_in(layout) else [] for parts in (_MOTION, (_OF_PLANT, _OF_LAW))
    )
    return f"""\
/* What the terms of the Lyapunov function take of the system, and the functions that give them. */
enum {{
    N_TERMS = {len(TERMS) if motion else 0},
    N_MOTION = {len(motion)},
    N_GAINS = {len(parameters)},
    N_CONSTANTS = {_traced()[1]}
}};

static const uint32_t of_motion[] = {{{", ".join(map(str, [*motion, 0]))}}};
static const uint32_t of_gains[] = {{{", ".join(map(str, [*parameters, 0]))}}};

int {_NAME}(const double **arg, double **res, int *iw, double *w, int mem);
int {_NAME}_constants(const double **arg, double **res, int *iw, double *w, int mem);
""".encode()


@cache
def _traced() -> tuple[str, int]:
    """Return the C, and how many values follow from the parameters alone."""
    motion = Layout(tuple(signal for part in _MOTION for signal in part.layout.signals))
    plant, law = _OF_PLANT.layout, _OF_LAW.layout

    def terms(x: Any, p: Any) -> Any:
        return np.stack(lyapunov.terms(motion.unpack(x), plant.unpack(p[: plant.size]), law.unpack(p[plant.size :])))

    with tracing.ALONE:
        traced = tracing.of_parameters(_NAME, terms, motion.size, plant.size + law.size)
        return tracing.code(
            "the Lyapunov function, traced from control/lyapunov.py", _NAME, traced
        ), tracing.n_constants(traced, _NAME)


def _ends(parts: Iterable[_Part]) -> list[str]:
    return [end for part in parts for end in part.ends]
