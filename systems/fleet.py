"""Published vehicles in the loop: their parameters from a file each, the controllers' gains by the rules of `gains`."""

from collections.abc import Mapping
from functools import cache
from itertools import product
from pathlib import Path
from typing import NamedTuple

from rov_cosim.components.adaptive_pd import COMPONENT as ADAPTIVE_PD
from rov_cosim.components.instance import ComponentError, Instance
from rov_cosim.components.interface import XYZ, Sampled
from rov_cosim.components.passive_arm import COMPONENT as PASSIVE_ARM
from rov_cosim.components.pid import COMPONENT as PID
from rov_cosim.components.rov_plant import COMPONENT as ROV_PLANT
from rov_cosim.components.sliding_mode import COMPONENT as SLIDING_MODE
from rov_cosim.components.sun_cheah import COMPONENT as SUN_CHEAH
from rov_cosim.components.taut_wire import COMPONENT as TAUT_WIRE
from rov_cosim.control.tuning import Rule, Timing
from rov_cosim.exporters.model_description import describe
from rov_cosim.ssp.declaration import System
from rov_cosim.ssp.parameter_set import read_parameter_set
from rov_cosim.ssp.values import Value
from rov_cosim.ssp.wiring import WiringError
from rov_cosim.systems.gains import by_rule, extended, loads, scaled, shared, winch
from rov_cosim.systems.loop import CONTROLLER, scenario_loop

VEHICLES = {
    "hoang_kreuzer": "The paper's vehicle, 80 kg",
    "bluerov2_heavy": "BlueROV2 Heavy, 13.5 kg, after von Benzon et al. 2022",
    "bluerov2": "BlueROV2, 11.5 kg, after Wu 2018, with a fraction of the damping",
    "rexrov": "RexROV, 1.9 t, with the figures of the SF 30k",
    "minerva": "Minerva, 460 kg, after Mo 2015, five thrusters",
}
"""Description of each vehicle by name; its parameters are those in vehicles/NAME.ssv."""

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
"""Those with `EXTENSIONS`, gains by `TUNING` or `TUNINGS`, and the rate of the set-point."""


class Tuning(NamedTuple):
    """By what a controller is tuned: what delays its loop, and the figures of the rule."""

    timing: Timing
    rule: Rule


TUNING = Tuning(Timing(filter_time_constant=0.15), Rule(integral=0.17, adapted=0.3))
"""Of all vehicles but those of `TUNINGS`.

It integrates faster than the rule by itself, for currents vary in a minute; the theorem certifies its epsilon_0. The
filter is slower than the paper's because the rule damps more: K_D / T_f is what noise takes of the thrust. The
thrusters are taken for ideal: what Heavy and RexROV have of lag, 20 and 50 ms, costs more of the integral than it takes
of the margins.
"""

TUNINGS = {
    "hoang_kreuzer": Tuning(
        Timing(filter_time_constant=0.13), Rule(bandwidth=0.209, damping=1.1, integral=0.313, adapted=0.57)
    ),
    "minerva": Tuning(
        Timing(filter_time_constant=0.185), Rule(bandwidth=0.242, damping=0.8, integral=0.24, adapted=0.3)
    ),
    "bluerov2_heavy_taut_wire": Tuning(
        Timing(filter_time_constant=0.107), Rule(bandwidth=0.165, damping=1.13, integral=0.185, adapted=0.39)
    ),
}
"""Of those for which another controller holds what `extended` by `TUNING` does not, for it and `pid`; see FLEET.md."""

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
    gains = extended(component, plant, *tuning_of(controller, vehicle)) if is_extended else scaled(component, plant)
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


def tuning_of(controller: str, vehicle: str = "") -> Tuning:
    """Return by what a controller is tuned for a vehicle, or for one without a tuning of its own, as by a file."""
    return TUNINGS.get(vehicle, TUNING) if controller in EXTENDED else Tuning(Timing(), Rule())


def tuned_for(controller: str, plant: Mapping[str, Value], timing: Timing, rule: Rule) -> dict[str, Value]:
    """Return the gains by the rule, shares of the estimates included, of one of `CONTROLLERS` for a vehicle."""
    component = CONTROLLERS[controller]
    by = extended if controller in EXTENDED else by_rule
    return {**by(component, plant, timing, rule)}
