"""Published vehicles in the loop: their parameters from a file each, the controllers' gains by a rule.

Two rules make the gains. `scaled`: each gain of an axis is the paper's times the ratio of the inertias, added mass
included, so the closed loop has the paper's frequency and the damping that the paper's controller gives; a vehicle's
own damping comes on top, as there. The gains of x and y are in the earth frame, where surge and sway turn into each
other: both take the mean of the two ratios. Gamma of a force takes the ratio of the inertia that it moves, and so do
the forces of umbilical and arm: a PD controller has the paper's offsets. `tuned`: those of `control.tuning`, from the
lag of the loop. Roll and pitch are free but, as in the paper, not controlled.
"""

from collections.abc import Iterable, Mapping
from functools import cache
from itertools import product
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray

from rov_cosim.components.adaptive_pd import COMPONENT as ADAPTIVE_PD
from rov_cosim.components.instance import ComponentError, Instance
from rov_cosim.components.interface import POSE, VELOCITY, XYZ, Component, Sampled
from rov_cosim.components.passive_arm import COMPONENT as PASSIVE_ARM
from rov_cosim.components.pid import COMPONENT as PID
from rov_cosim.components.rov_plant import COMPONENT as ROV_PLANT
from rov_cosim.components.sliding_mode import COMPONENT as SLIDING_MODE
from rov_cosim.components.sun_cheah import COMPONENT as SUN_CHEAH
from rov_cosim.components.taut_wire import COMPONENT as TAUT_WIRE
from rov_cosim.components.vehicle import COUPLE, FORCES
from rov_cosim.control.softening import softening
from rov_cosim.control.tuning import Rule, Timing, stiffened, tuned
from rov_cosim.exporters.model_description import describe
from rov_cosim.ssp.declaration import System
from rov_cosim.ssp.parameter_set import read_parameter_set
from rov_cosim.ssp.values import Value
from rov_cosim.ssp.wiring import WiringError
from rov_cosim.systems import station_keeping, station_keeping_taut_wire
from rov_cosim.systems.loop import CONTROLLER, scenario_loop

VEHICLES = {
    "hoang_kreuzer": "The paper's vehicle, 80 kg",
    "bluerov2_heavy": "BlueROV2 Heavy, 13.5 kg, after von Benzon et al. 2022",
    "bluerov2": "BlueROV2, 11.5 kg, after Wu 2018, with a fraction of the damping",
    "rexrov": "RexROV, 1.9 t, with the figures of the SF 30k",
    "minerva": "Minerva, 460 kg, after Mo 2015, five thrusters",
}
"""Description of each vehicle by name; its parameters are those in vehicles/NAME.ssv."""

EXTENSIONS: Mapping[str, Value] = {
    "filter_time_constant": 0.15,
    "bridging": 0.3,
    "projection": True,
    "adapt_by_pose": True,
    "alpha": 0.5,
}
"""What the controllers have beyond the paper, as far as a component has it; the gains by the tuning rule go with it.

The filter is slower than the paper's because the tuning rule damps more: K_D / T_f is what noise takes of the thrust.
"""

RULE = Rule(integral=0.17, adapted=0.3)
"""Integrates faster than the rule by itself, for currents vary in a minute; the theorem certifies its epsilon_0."""

ARM_SHARE = 0.4
"""Of the adaptation that the rule gives the arm's force, as much is left to it; the umbilical's force takes the rest.

What the arm's force is taken for wrongly turns the vehicle by its lever, and the couple learns the yaw without it.
"""

YAW_SHARE = 0.54
"""W Gamma W^T over M omega^2 in yaw, which is measured without noise; elsewhere it is `RULE.adapted`."""

CONTROLLERS: Mapping[str, Sampled] = {
    "adaptive_pd": ADAPTIVE_PD,
    "extended": ADAPTIVE_PD,
    "pid": PID,
    "sliding_mode": SLIDING_MODE,
    "sun_cheah": SUN_CHEAH,
    "pd": ADAPTIVE_PD,
}
"""The component of each controller to compare.

adaptive_pd is the paper's law with the scaled gains, and pd the same without adaptation. extended is the law with
`EXTENSIONS` and tuned gains, and pid has of these what a PID controller can have. sliding_mode and sun_cheah are as in
the literature, with scaled gains.
"""

WIRED = {f"{vehicle}_taut_wire": vehicle for vehicle in ("hoang_kreuzer", "bluerov2_heavy")}
"""The vehicles that a taut wire measures too, by the name that they have then."""

LOOPS = (*product(VEHICLES, CONTROLLERS), *product(WIRED, ("adaptive_pd", "extended")))
"""Vehicle and controller of each system of the fleet."""

EXTENDED = ("extended", "pid")
"""Those with `EXTENSIONS`, gains by `RULE`, and the rate of the set-point."""

STOP_TIME = 300.0
"""Duration of a run in s: a trouble may come at 60 s, and the yaw is adapted through the arm's lever, which is slow."""

ATTACHMENT = (0.2, 0.5, 0.4)
"""Where arm or wire is fixed to the structure, seen from its base on a vehicle in place, in m; in reach at once."""


def named(vehicle: str, controller: str) -> str:
    """Return the name of the system in which a controller holds a vehicle."""
    return vehicle if controller == "adaptive_pd" else f"{vehicle}_{controller}"


def of_file(name: str) -> tuple[str, str] | None:
    """Return the vehicle's file and the controller of a system that is `named` after the file, or None."""
    for controller in CONTROLLERS:
        if name.endswith(named(".ssv", controller)):
            return name.removesuffix(named("", controller)), controller
    return None


def holding(vehicle: str, controller: str = "adaptive_pd") -> System:
    """Return the system in which a controller holds one of `VEHICLES`, from the paper's start, under its loads.

    Or one of `WIRED`, measured by the taut wire, whose tension is then the sensor's load; or the vehicle of an SSV file
    by its path, with the same parameters as those of the fleet.
    """
    measured, sensor = WIRED.get(vehicle, vehicle), TAUT_WIRE if vehicle in WIRED else PASSIVE_ARM
    plant = parameters_of(measured)
    component, is_extended = CONTROLLERS[controller], controller in EXTENDED
    gains = extended(component, plant) if is_extended else scaled(component, plant)
    known = {**shared(component, plant), **gains}
    attachment = {
        f"attachment.{axis}": float(plant[f"r_A.{axis}"]) + gap for axis, gap in zip(XYZ, ATTACHMENT, strict=True)
    }
    described = VEHICLES.get(measured, f"The vehicle of {vehicle}") + ", on a taut wire" * (vehicle in WIRED)
    return scenario_loop(
        named(Path(vehicle).stem, controller),
        f"{described}, held by {controller}",
        {
            sensor.name: {**shared(sensor, plant), **attachment, **winch(sensor, plant)},
            CONTROLLER: {**known, "adaptation": False} if controller == "pd" else known,
            "rov_plant": {**plant, "eta_0.y": 0.5, "eta_0.psi": 2.0, **loads(plant, sensor)},
        },
        STOP_TIME,
        component.name,
        set_point_rate=is_extended,
        sensor=sensor.name,
    )


def file_of(vehicle: str) -> Path:
    """Return the file of one of `VEHICLES`."""
    return Path(__file__).parent / "vehicles" / f"{vehicle}.ssv"


@cache
def parameters_of(vehicle: str) -> Mapping[str, Value]:
    """Return the parameters of `rov_plant` for one of `VEHICLES`, or for the vehicle of an SSV file.

    Raises
    ------
    WiringError : its file is missing or wrong, has not all parameters, or there is no such vehicle.
    """
    path = Path(vehicle) if vehicle.endswith(".ssv") else file_of(vehicle)
    found = read_parameter_set(path, describe(ROV_PLANT))
    if vehicle not in VEHICLES and (lacking := parameters_of(next(iter(VEHICLES))).keys() - found.keys()):
        names = ", ".join(sorted(lacking)[:4])
        more = ", ..." if len(lacking) > 4 else ""
        raise WiringError(vehicle, [f"It lacks {len(lacking)} of a vehicle's parameters: {names}{more}."])
    try:
        asked = Instance(ROV_PLANT)
        first = ROV_PLANT.u.size + ROV_PLANT.y.size
        asked.set([first + ROV_PLANT.p.names.index(name) for name in found], [float(value) for value in found.values()])
        asked.enter_initialization()
        asked.exit_initialization()
    except ComponentError as error:
        raise WiringError(vehicle, [str(error)]) from None
    return found


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


def extended(
    component: Sampled, plant: Mapping[str, Value], timing: Timing | None = None, rule: Rule = RULE
) -> dict[str, Value]:
    """Return the gains of a controller for a vehicle by the tuning rule, and what it has of `EXTENSIONS`.

    If left out, timing is `timing_of` the extended law, with ideal thrusters: what Heavy and RexROV have of lag, 20 and
    50 ms, costs more of the integral than it takes of the margins.
    """
    has = {name: value for name, value in EXTENSIONS.items() if name in component.p.names}
    timing = timing or timing_of("extended")
    gains = tuned(component, inertia(plant), shared(component, plant), timing, rule)
    if "Gamma.M.z" in gains:
        gains |= _learnt_by_couple(gains, plant, inertia(plant)[3:] * rule.omega(timing) ** 2, rule)
    gains = _held_in_current(component, gains, plant, timing, rule)
    return {**gains, **has, "filter_time_constant": timing.filter_time_constant}


def timing_of(controller: str) -> Timing:
    """Return what delays the loop of a controller, with thrusters without lag."""
    has_filter = controller in EXTENDED
    return Timing(filter_time_constant=float(EXTENSIONS["filter_time_constant"])) if has_filter else Timing()


def rule_of(controller: str) -> Rule:
    """Return the rule by which a controller is tuned."""
    return RULE if controller in EXTENDED else Rule()


def tuned_for(controller: str, plant: Mapping[str, Value], timing: Timing, rule: Rule) -> dict[str, Value]:
    """Return the gains by the rule, shares of the estimates included, of one of `CONTROLLERS` for a vehicle."""
    component = CONTROLLERS[controller]
    by = extended if controller in EXTENDED else by_rule
    return {**by(component, plant, timing, rule)}


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
