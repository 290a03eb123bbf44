"""The controllers' gains for a vehicle, by two rules.

`scaled`: each gain of an axis is the paper's times the ratio of the inertias, added mass included, so the closed loop
has the paper's frequency and the damping that the paper's controller gives; a vehicle's own damping comes on top, as
there. The gains of x and y are in the earth frame, where surge and sway turn into each other: both take the mean of the
two ratios. Gamma of a force takes the ratio of the inertia that it moves, and so do the forces of umbilical and arm: a
PD controller has the paper's offsets. `by_rule` and `extended`: those of `control.tuning`, from the lag of the loop.
Roll and pitch are free but, as in the paper, not controlled.
"""

from collections.abc import Iterable, Mapping
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray

from rov_cosim.components.interface import POSE, VELOCITY, XYZ, Component, Sampled
from rov_cosim.components.passive_arm import COMPONENT as PASSIVE_ARM
from rov_cosim.components.rov_plant import COMPONENT as ROV_PLANT
from rov_cosim.components.vehicle import COUPLE, FORCES
from rov_cosim.control.softening import softening
from rov_cosim.control.tuning import Rule, Timing, stiffened, tuned
from rov_cosim.ssp.values import Value
from rov_cosim.systems import station_keeping, station_keeping_taut_wire

EXTENSIONS: Mapping[str, Value] = {"bridging": 0.3, "projection": True, "adapt_by_pose": True, "alpha": 0.5}
"""What the controllers have beyond the paper, as far as a component has it; the gains by the tuning rule go with it."""

ARM_SHARE = 0.4
"""Of the adaptation that the rule gives the arm's force, as much is left to it; the umbilical's force takes the rest.

What the arm's force is taken for wrongly turns the vehicle by its lever, and the couple learns the yaw without it.
"""

YAW_SHARE = 0.54
"""W Gamma W^T over M omega^2 in yaw, which is measured without noise; elsewhere it is `Rule.adapted`."""


def inertia(plant: Mapping[str, Value]) -> NDArray[np.float64]:
    """Return the inertia of each axis, shape (6,), in kg and kg m^2: the diagonal of M."""
    rigid = ["mass", "mass", "mass", "I.xx", "I.yy", "I.zz"]
    return np.array(
        [float(plant[name]) + float(plant[f"added_mass.{axis}"]) for name, axis in zip(rigid, VELOCITY, strict=True)]
    )


def ratios(plant: Mapping[str, Value]) -> tuple[dict[str, float], dict[str, float]]:
    """Return the inertia relative to the paper's vehicle: by axis of the pose, and by unknown force or couple."""
    paper = _declared(ROV_PLANT)
    ratio = inertia(plant) / inertia(paper)
    ratio[:2] = ratio[:2].mean()
    by_axis = dict(zip(POSE, ratio.tolist(), strict=True))
    by_load = {force: by_axis["x" if force[-1] in "xy" else "z"] for force in FORCES}
    by_load |= dict(zip(COUPLE, ratio[3:].tolist(), strict=True))
    return by_axis, by_load


def scaled(component: Component, plant: Mapping[str, Value]) -> dict[str, Value]:
    """Return the gains of a controller for a vehicle: the declared ones, which are the paper's, scaled."""
    by_axis, by_load = ratios(plant)
    declared = _declared(component)
    ratio = {name: by_axis[axis] for name, axis in _parted(declared, "K_") if axis in by_axis}
    ratio |= {name: by_load[load] for name, load in _parted(declared, "Gamma.")}
    return {name: float(f"{declared[name] * r:.4g}") for name, r in ratio.items()}


def _parted(names: Iterable[str], start: str) -> list[tuple[str, str]]:
    """Return the names that begin so, each with what follows its group."""
    return [(name, name.partition(".")[2]) for name in names if name.startswith(start)]


def extended(component: Sampled, plant: Mapping[str, Value], timing: Timing, rule: Rule) -> dict[str, Value]:
    """Return the gains of a controller for a vehicle by the tuning rule, and what it has of `EXTENSIONS`."""
    has = {name: value for name, value in EXTENSIONS.items() if name in component.p.names}
    gains = tuned(component, inertia(plant), shared(component, plant), timing, rule)
    if "Gamma.M.z" in gains:
        gains |= _learnt_by_couple(gains, plant, inertia(plant)[3:] * rule.omega(timing) ** 2, rule)
    gains = _held_in_current(component, gains, plant, timing, rule)
    return {**gains, **has, "filter_time_constant": timing.filter_time_constant}


def by_rule(component: Sampled, plant: Mapping[str, Value], timing: Timing, rule: Rule) -> dict[str, float]:
    """Return the gains of a controller for a vehicle by the tuning rule alone."""
    gains = tuned(component, inertia(plant), shared(component, plant), timing, rule)
    return _held_in_current(component, gains, plant, timing, rule)


def _held_in_current(
    component: Sampled, gains: Mapping[str, float], plant: Mapping[str, Value], timing: Timing, rule: Rule
) -> dict[str, float]:
    """Return tuned gains that hold the yaw in a current, too, under the vehicle's loads."""
    p_law = _unpacked(component, {**shared(component, plant), **gains})
    p = _unpacked(ROV_PLANT, {**plant, **loads(plant)})
    K_s = softening(component, p_law, p, rule.current)
    return stiffened(gains, K_s, inertia(plant)[5], rule.omega(timing))


def _unpacked(component: Component, values: Mapping[str, Value]) -> SimpleNamespace:
    """Return a component's parameters as its equations see them; those that are left out are the declared ones."""
    named = {**_declared(component), **values}
    return component.p.unpack(np.array([float(named[name]) for name in component.p.names]))


def _learnt_by_couple(
    gains: Mapping[str, float], plant: Mapping[str, Value], stiffness: NDArray[np.float64], rule: Rule
) -> dict[str, float]:
    """Return what `ARM_SHARE` and `YAW_SHARE` change in tuned gains.

    stiffness, shape (3,), is M omega^2 of roll, pitch and yaw in N m/rad. The couple is adapted in roll and pitch too,
    for the case that they are controlled: the moment about the line from r_C to r_A is no force's.
    """
    gamma: dict[str, float] = {}
    for axis in XYZ:
        arm, umbilical = (gains[f"Gamma.F_{point}.{axis}"] for point in "AC")
        gamma |= {f"Gamma.F_A.{axis}": ARM_SHARE * arm, f"Gamma.F_C.{axis}": umbilical + (1 - ARM_SHARE) * arm}
    by_levers = sum(
        gamma[f"Gamma.F_{point}.{axis}"] * float(plant[f"r_{point}.{lever}"]) ** 2
        for point in "AC"
        for axis, lever in ("xy", "yx")
    )
    couple = dict(zip(COUPLE, rule.adapted * stiffness, strict=True))
    gamma |= {f"Gamma.{moment}": value for moment, value in couple.items()}
    gamma["Gamma.M.z"] = max(YAW_SHARE * stiffness[2] - by_levers, 0.0)
    changed = {**gamma, "K_P.psi": (1 - YAW_SHARE) * stiffness[2]}
    return {name: float(f"{value:.4g}") for name, value in changed.items()}


def loads(plant: Mapping[str, Value], sensor: Component = PASSIVE_ARM) -> dict[str, Value]:
    """Return the forces of umbilical and arm, if there is one: those of the paper's experiment, scaled."""
    _, by_load = ratios(plant)
    system = station_keeping if sensor is PASSIVE_ARM else station_keeping_taut_wire
    paper = system.SYSTEM.parameters["rov_plant"]
    return {
        name: float(f"{float(paper[name]) * by_load[name]:.4g}") for name in FORCES if name != "dB" and name in paper
    }


def winch(sensor: Component, plant: Mapping[str, Value]) -> dict[str, Value]:
    """Return tensions and stiffness of the winch, if a sensor has one: the declared ones, scaled as the arm's force."""
    ratio, declared = ratios(plant)[1]["F_A.x"], _declared(sensor)
    scalable = ("winch_tension", "winch_stiffness", "slack_tension")
    return {name: float(f"{declared[name] * ratio:.4g}") for name in scalable if name in declared}


def _declared(component: Component) -> dict[str, float]:
    return dict(zip(component.p.names, component.p.start.tolist(), strict=True))


def shared(component: Component, plant: Mapping[str, Value]) -> dict[str, Value]:
    """Return the parameters of a vehicle that another component declares too."""
    return {name: plant[name] for name in component.p.names if name in plant}
