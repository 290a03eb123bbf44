"""Which term of a plant is not what its parameters make it: each is weighed by itself against Newton's laws.

A term is weighed by how the plant begins to move in states that differ in this term alone: the acceleration, times the
inertia, is its wrench. That holds a controller to nothing, which would hide what is wrong.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import NamedTuple

import numpy as np

from ...components.interface import POSE, VELOCITY, WRENCH, XYZ, count
from ...components.vehicle import FORCES, FOUR_DOF, N_THRUSTERS
from ...ssp.wiring import Element, Wiring, WiringError
from ..settings import Settings
from .bench import Motion, Release, begun
from .newton import INERTIA, NAMES, THRUSTERS, Array, Newton

SHARE, NOISE = 0.1, 0.005
"""What a term may be off, as a part of itself and of the largest wrench that it is told from."""
MOST = 8
"""Sentences on a plant, beyond which they are counted: a wrong inertia spoils all that comes after it."""
STILL = 1e-3
"""Acceleration in m/s2 and rad/s2 that is taken for none."""
_YAWED, _TILTED = np.array([0.0, 0, 0, 0, 0, 0.9]), np.array([0.0, 0, 0, 0.6, -0.5, 0.9])
_SPEEDS = np.array([[0.5, -0.4, 0.3, 0, 0, 0], [0, 0, 0, 0.9, -0.7, 1.1], [0.4, 0.5, -0.3, -0.6, 0.9, 0.8]])
"""Velocities in m/s and rad/s at which what the products of speeds do is weighed."""
_ADDED = np.array([0.4, 0.6, 0.9, 0.5, 0.7, 0.3])
"""Added mass as a part of that of the dry vehicle."""
_CURRENT = np.array([0.3, -0.2, 0.1])
_SLOW = 0.2
"""Speed in m/s and rad/s, and a fourth of another, by which linear damping is told from quadratic."""
_NO_LAG, _LONG_LAG = 1e-4, 1e3
"""Lags in s after which a thruster is there at once, or not at all."""
_INPUTS = tuple(f"{load}.{axis}" for load in ("F_arm", "F_umbilical") for axis in XYZ)
_COMMANDS = tuple(f"u[{i}]" for i in count(N_THRUSTERS))
_NEUTRAL = {
    **dict.fromkeys((*FORCES, *_INPUTS, *_COMMANDS, *(f"current.{axis}" for axis in XYZ)), 0.0),
    **dict.fromkeys((f"thrust_loss[{i}]" for i in count(N_THRUSTERS)), 0.0),
    **dict.fromkeys(("thruster_time_constant", "thruster_dead_band", "thrust_max", "lock_roll_pitch"), 0.0),
}
_LOADS_AND_THRUSTERS = (*FORCES, *_INPUTS, *THRUSTERS)
_STARTS = (*(f"eta_0.{axis}" for axis in POSE), *(f"nu_0.{axis}" for axis in VELOCITY))


def plant_in(wiring: Wiring) -> Element | None:
    """Return the element of a system that has a vehicle's inputs and parameters by our names; None if none has."""
    needed = {*NAMES, *_NEUTRAL, *_STARTS}
    return next((element for element in wiring.elements if needed <= element.variables.keys()), None)


def _general(plant: Element) -> dict[str, float]:
    """Return parameters with which every term of a plant acts, in the size of its vehicle."""
    mass, I_zz = (float(plant.value(name) or 0.0) for name in ("mass", "I.zz"))
    length = np.sqrt(I_zz / mass)
    vectors = {
        "r_G": length * np.array([0.1, -0.15, 0.05]),
        "r_B": length * np.array([-0.05, 0.1, 0.3]),
        "r_C": length * np.array([-0.4, 0.3, 0.8]),
        "r_A": length * np.array([1.0, -0.2, 0.3]),
    }
    inertia = I_zz * np.array([0.8, 1.1, 1.0, 0.05, -0.08, 0.06])
    dry = np.array([mass, mass, mass, *inertia[:3]])
    groups = {**{name: (vector, XYZ) for name, vector in vectors.items()}, "I": (inertia, INERTIA)}
    of_water = {"added_mass": _ADDED, "D_linear": 0.5, "D_quadratic": 1.5}
    groups |= {name: (share * dry, VELOCITY) for name, share in of_water.items()}
    return {
        f"{name}.{axis}": float(values[i]) for name, (values, axes) in groups.items() for i, axis in enumerate(axes)
    }


class _Term(NamedTuple):
    """A term: its name, releases with weights, whose wrenches add up to it, and what it should be, shape (6,)."""

    name: str
    parts: tuple[tuple[float, Release], ...]
    expected: Array


def faults(wiring: Wiring, settings: Settings) -> tuple[str, ...] | None:
    """Return a sentence for each kind of thing that is wrong with the terms of the plant in a system.

    None if they are not weighed: `plant_in` finds none, or it does not run beside copies of itself.
    """
    plant = plant_in(wiring)
    if plant is None:
        return None
    plant = replace(plant, start_values={**plant.start_values, **_general(plant)})
    newton = Newton(lambda name: float(plant.value(name) or 0.0))
    terms = list(_terms(newton))
    releases = list({id(release): release for term in terms for _, release in term.parts}.values())
    try:
        motions = begun(plant, releases, settings)
    except WiringError:
        return None
    if motions is None:
        return None
    begins = {id(release): motion for release, motion in zip(releases, motions, strict=True)}
    wrong: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for name, how, axes in chain(_of_outputs(newton, releases, motions), _of_terms(newton, terms, begins)):
        wrong.setdefault((how, axes), []).append(name)
    lines = [f"{', '.join(dict.fromkeys(names))}: {how} in {', '.join(axes)}." for (how, axes), names in wrong.items()]
    more = [f"and {len(lines) - MOST} more of the kind."] if len(lines) > MOST else []
    return tuple(f"{plant.name}: {line}" for line in lines[:MOST] + more)


_Fault = tuple[str, str, tuple[str, ...]]


def _of_terms(newton: Newton, terms: Sequence[_Term], begins: Mapping[int, Motion]) -> Iterator[_Fault]:
    """Yield name, how it acts and axes of each term that is wrong; an inertia that is wrong is told once for all."""
    M = newton.inertia()
    found = []
    for term in terms:
        wrenches = np.array([weight * (M @ begins[id(release)].acceleration) for weight, release in term.parts])
        found.append((term, wrenches.sum(axis=0), np.abs(wrenches).max(axis=0)))
    ratios: list[list[float]] = [[] for _ in WRENCH]
    for term, wrench, _ in found:
        if term.name in _LOADS_AND_THRUSTERS:
            for i in np.flatnonzero(np.abs(term.expected) > SHARE * _largest(np.abs(term.expected))):
                ratios[i].append(float(wrench[i] / term.expected[i]))
    scale = np.array([np.median(one) for one in ratios])
    heavy = (np.abs(scale - 1) > SHARE) & (scale > SHARE)
    for i in np.flatnonzero(heavy):
        told = f"inertia is {M[i, i] / scale[i]:.4g} where mass and added mass make it {M[i, i]:.4g}"
        yield "all forces", told, (WRENCH[i],)
    for term, wrench, largest in found:
        least = np.maximum(largest, newton.mass * STILL / NOISE)
        yield from _compared(term.name, wrench / np.where(heavy, scale, 1.0), term.expected, least)


def _of_outputs(newton: Newton, releases: Sequence[Release], motions: Sequence[Motion]) -> Iterator[_Fault]:
    """Yield what is first wrong with the way of the pose, and with each output."""
    seen = set()
    for release, motion in zip(releases, motions, strict=True):
        pushing, loading = _applied(newton, release)
        for name, told, expected in (
            ("eta against nu", motion.velocity, release.nu),
            ("output nu", motion.nu, release.nu),
            ("output tau", motion.tau, pushing),
            ("output disturbance", motion.disturbance, loading),
        ):
            wrong = list(_compared(name, told, expected, np.maximum(np.abs(expected), 1.0)))
            if wrong and name not in seen:
                seen.add(name)
                yield wrong[0]


def _applied(newton: Newton, release: Release) -> tuple[Array, Array]:
    """Return the wrenches of the thrusters and of loads and current on a vehicle that is held still."""
    values = {**_NEUTRAL, **release.values}
    if values["thruster_time_constant"]:
        values |= dict.fromkeys(_COMMANDS, 0.0)  # outputs are those of the first instant
    most = values["thrust_max"] or np.inf
    thrusts = [
        float(np.clip(values[f"u[{i}]"], -most, most)) * (1 - values[f"thrust_loss[{i}]"]) * newton.thrust(n)
        for n, i in enumerate(count(N_THRUSTERS))
    ]
    loads = [newton.load(name, release.eta, values[load] * axis) for load, name, axis in _loads() if values[load]]
    current = np.array([values[f"current.{axis}"] for axis in XYZ])
    return sum(thrusts, np.zeros(6)), sum(loads, newton.in_current(release.eta, np.zeros(6), current))


def _loads() -> Iterator[tuple[str, str, Array]]:
    """Yield for each load the variable, the name of `POINTS`, and its direction in the earth frame."""
    for load in (*FORCES, *_INPUTS):
        name, _, axis = load.partition(".")
        yield load, name, np.eye(3)[XYZ.index(axis or "z")]


def _terms(newton: Newton) -> Iterator[_Term]:
    """Yield all terms of a plant."""
    still, size = np.zeros(6), newton.mass  # newtons that give some m/s2

    def release(values: Mapping[str, float] | None = None, nu: Array = still, eta: Array = _YAWED) -> Release:
        return Release(eta, nu, {**_NEUTRAL, **(values or {})})

    rest, tilted = release(), release(eta=_TILTED)
    righting = newton.righting(_TILTED) - newton.righting(_YAWED)
    yield _Term("weight and buoyancy", ((1.0, tilted), (-1.0, rest)), righting)
    for load, name, axis in _loads():
        pulled = release({load: size}, eta=_TILTED)
        yield _Term(load, ((1.0, pulled), (-1.0, tilted)), newton.load(name, _TILTED, size * axis))
    for n, command in enumerate(_COMMANDS):
        yield _Term(THRUSTERS[n], ((1.0, release({command: size})), (-1.0, rest)), size * newton.thrust(n))
    first = size * newton.thrust(0)
    for name, way, changed, share in (
        ("short thruster_time_constant", 1.0, {"thruster_time_constant": _NO_LAG}, 1.0),
        ("long thruster_time_constant", 1.0, {"thruster_time_constant": _LONG_LAG}, 0.0),
        ("thrust_loss", 1.0, {"thrust_loss[1]": 0.5}, 0.5),
        ("thrust_max", 1.0, {"thrust_max": size / 2}, 0.5),
        ("thrust_max backwards", -1.0, {"thrust_max": size / 2}, -0.5),
    ):
        yield _Term(name, ((1.0, release({"u[1]": way * size, **changed})), (-1.0, rest)), share * first)
    for i, direction in enumerate(_SLOW * np.eye(6)):
        moving = {times: release(nu=times * direction) for times in (1, -1, 4, -4)}
        for group, of_slow, of_fast, expected in (
            ("D_linear", 16 / 12, -1 / 12, -newton.linear * direction),
            ("D_quadratic", -4 / 12, 1 / 12, -newton.quadratic * direction**2),
        ):
            halves = ((of_slow, 1), (of_fast, 4))
            parts = tuple((of / 2 * way, moving[speed * way]) for of, speed in halves for way in (1, -1))
            yield _Term(f"{group}.{VELOCITY[i]}", parts, expected)
    current = dict(zip((f"current.{axis}" for axis in XYZ), _CURRENT.tolist(), strict=True))
    yield _Term("current", ((1.0, release(current)), (-1.0, rest)), newton.in_current(_YAWED, still, _CURRENT))
    for nu in _SPEEDS:
        told = ", ".join(VELOCITY[i] for i in np.flatnonzero(nu))
        parts = ((0.5, release(nu=nu)), (0.5, release(nu=-nu)), (-1.0, rest))
        yield _Term(f"{told} times each other", parts, newton.gyroscopic(nu))
        drifting = ((1.0, release(current, nu, _TILTED)), (-1.0, release(nu=nu, eta=_TILTED)))
        yield _Term("current", drifting, newton.in_current(_TILTED, nu, _CURRENT))
    locked = release({"lock_roll_pitch": 1.0, "F_C.x": size, "F_C.y": size})
    level = np.ix_(np.flatnonzero(FOUR_DOF), np.flatnonzero(FOUR_DOF))
    pull, M, begins = newton.load("F_C", _YAWED, size * np.array([1.0, 1.0, 0.0])), newton.inertia(), np.zeros(6)
    begins[FOUR_DOF > 0] = np.linalg.solve(M[level], pull[FOUR_DOF > 0])
    yield _Term("lock_roll_pitch", ((1.0, locked), (-1.0, release({"lock_roll_pitch": 1.0}))), M @ begins)


def _compared(name: str, found: Array, expected: Array, largest: Array) -> Iterator[_Fault]:
    """Yield how a wrench is wrong, and the axes in which it is so."""
    allowed = SHARE * np.abs(expected) + NOISE * _largest(largest) + 1e-6
    kinds: dict[str, list[str]] = {}
    for i in np.flatnonzero(~(np.abs(found - expected) <= allowed)):
        if abs(found[i] + expected[i]) <= allowed[i]:
            how = "acts the other way"
        elif abs(found[i]) <= allowed[i]:
            how = "does not act"
        else:
            how = f"is {found[i]:.3g} where it should be {expected[i]:.3g}"
        kinds.setdefault(how, []).append(WRENCH[i])
    for how, axes in kinds.items():
        yield name, how, tuple(axes)


def _largest(values: Array) -> Array:
    """Return for each axis the largest of the forces, or of the moments, shape (6,)."""
    return np.repeat([values[:3].max(), values[3:].max()], 3)
