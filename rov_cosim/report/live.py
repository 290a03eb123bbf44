"""What the page knows of the loops that run in it: their modules, names, values, controls, and how a run is judged."""

import gzip
from base64 import b64encode
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from ..components.interface import POSE, WRENCH, XYZ, count
from ..components.vehicle import N_THRUSTERS
from ..ssp.values import parse
from ..ssp.wiring import Wiring
from ..study import assessment, scores
from ..study.assessment import AXES
from ..study.matrix import Loops, wired
from ..study.nominal import DoesNotApplyError
from ..study.troubles import ONSET, TROUBLES
from ..systems.fleet import CONTROLLERS, VEHICLES, named
from ..whole.layout import COUPLING, Layout, Shown, laid_out
from . import controls, terms, wasm

STOP_TIME = 84.0
"""Of a run on the page at first, in s, as long as the system of the paper's experiment."""

LABELS = {
    "pd": "PD",
    "pid": "PID",
    "adaptive_pd": "adaptive PD",
    "extended": "extended",
    "sliding_mode": "sliding mode",
    "sun_cheah": "Sun & Cheah",
}
"""Of the controllers of the fleet, in the order of the page."""

FIRST = ("pd", "pid", "adaptive_pd")
"""The controllers that are shown at first, the one that the picture is of last."""

RECORDED = (
    *(f"rov_plant.eta.{axis}" for axis in POSE),
    *(f"scenario.eta_d.{axis}" for axis in POSE),
    *(f"controller.u[{i}]" for i in count(N_THRUSTERS)),
    *(f"scenario.thrust_loss[{i}]" for i in count(N_THRUSTERS)),
    *(f"passive_arm.q[{i}]" for i in count(6)),
    "passive_arm.reach",
    "passive_arm.attached",
    "passive_arm.eta_m_valid",
    *(f"passive_arm.eta_m.{axis}" for axis in AXES),
    *(f"scenario.F_umbilical.{axis}" for axis in XYZ),
    *(f"scenario.current.{axis}" for axis in XYZ),
    *(f"{element}.disturbance.{axis}" for element in ("controller", "rov_plant") for axis in WRENCH),
)
"""The outputs that the page shows."""


def loops(vehicles: Sequence[str] = (), progress: Callable[[str], object] = lambda line: None) -> Loops:
    """Return the loops of the page, of which the FMUs are built first.

    Parameters
    ----------
    vehicles : SSV files of further vehicles, which come first.
    progress : is told in a line what begins.

    Raises
    ------
    BuildError : the compiler fails.
    WiringError : a vehicle's file is wrong.
    """
    return wired([*vehicles, *VEHICLES], list(CONTROLLERS), progress=progress)


def data(loops: Loops, progress: Callable[[str], object] = lambda line: None) -> dict[str, Any]:
    """Return all that the page knows of loops, to be written as JSON; BuildError if the compiler fails."""
    alike = {pair: _made_of(wiring) for pair, wiring in loops.items()}
    first = {made_of: loops[pair] for pair, made_of in reversed(alike.items())}
    kinds = list(dict.fromkeys(alike.values()))
    made = wasm.modules([first[kind] for kind in kinds], progress)
    modules = [_module(layout, content) for layout, content in made]
    systems: dict[str, dict[str, Any]] = {}
    controllers = [name for name in LABELS if any(name == controller for _, controller in loops)]
    known = {name for module in modules for name in module["names"]}
    for (vehicle, controller), wiring in loops.items():
        place = kinds.index(alike[vehicle, controller])
        systems.setdefault(vehicle, {})[controller] = {
            "name": named(vehicle, controller),
            "module": place,
            "values": _differences(modules[place]["start"], laid_out(wiring)),
            "troubles": _troubles(wiring),
        }
    return {
        "step": next(iter(loops.values())).step_size,
        "stop_time": STOP_TIME,
        "vehicles": {vehicle: VEHICLES.get(vehicle, vehicle) for vehicle in systems},
        "controllers": {name: LABELS[name] for name in controllers},
        "lines": {name: line for line, name in enumerate(LABELS)},
        "first": [name for name in FIRST if name in controllers] or controllers,
        "recorded": (*RECORDED, *terms.TERMS),
        "coupling": COUPLING,
        "modules": modules,
        "systems": systems,
        "controls": controls.as_data(known),
        "troubles": {trouble.name: trouble.description for trouble in TROUBLES.values()},
        "onset": ONSET,
        "judged": judged(),
    }


def _made_of(wiring: Wiring) -> Hashable:
    """Return what systems of one module have in common."""
    return tuple((element.name, element.fmu) for element in wiring.elements), wiring.links


def _troubles(wiring: Wiring) -> Mapping[str, Mapping[str, float]]:
    """Return the start values of each trouble that applies to a loop."""
    found = {}
    for trouble in TROUBLES.values():
        with suppress(DoesNotApplyError):
            values = trouble.values_in(wiring)
            wiring.with_values(values)
            found[trouble.name] = {end: float(value) for end, value in values.items()}
    return found


def judged() -> dict[str, Any]:
    """Return the limits by which a run is judged, in m and rad, by axis."""
    return {
        "hold": assessment.HOLD,
        "settled": assessment.SETTLED,
        "offset": scores.OFFSET,
        "sway": scores.SWAY,
        "lost": scores.LOST,
        "capsized": scores.CAPSIZED,
        "unmeasured": scores.UNMEASURED,
    }


def _module(layout: Layout, content: bytes) -> dict[str, Any]:
    return {
        "wasm": packed(content),
        "size": len(content),
        "names": names(layout),
        "start": _starts(layout.variables),
        "booleans": [shown.variable.name for shown in layout.parameters if shown.variable.type == "Boolean"],
        "limits": {
            shown.variable.valueReference: [_number(shown.variable.min), _number(shown.variable.max)]
            for shown in layout.parameters
            if shown.variable.min is not None or shown.variable.max is not None
        },
    }


def names(layout: Layout) -> list[str]:
    """Return what a module can record, by reference: its variables and, if it has them, `terms.TERMS`."""
    return [*(shown.variable.name for shown in layout.variables), *(terms.TERMS if terms.are_in(layout) else ())]


def packed(content: bytes) -> str:
    """Return bytes as text that a browser unpacks."""
    return b64encode(gzip.compress(content, 9, mtime=0)).decode("ascii")


def _number(text: str | None) -> float | None:
    return None if text is None else float(text)


def _starts(variables: Iterable[Shown]) -> list[float | None]:
    return [None if v.start is None else float(parse(v.start, v.type)) for v in (shown.variable for shown in variables)]


def _differences(start: Sequence[float | None], layout: Layout) -> Mapping[int, float | None]:
    own = _starts(layout.variables)
    return {i: value for i, value in enumerate(own) if value != start[i]}
