"""The loop that all systems share: arm or wire measures, the controller commands, the vehicle moves."""

from collections.abc import Mapping

from rov_cosim.exporters.model_description import STOP_TIME
from rov_cosim.ssp.declaration import System
from rov_cosim.ssp.values import Value

CONTROLLER = "controller"
"""The element that controls, in every system."""

CONTROLLER_COMPONENTS = ("adaptive_pd", "pid", "sliding_mode", "sun_cheah")
"""The components that fit into the loop as its controller."""

ARM, WIRE = SENSORS = ("passive_arm", "taut_wire")
"""The components that fit into the loop as what measures the pose; the element has the component's name."""

SET_POINT_RATE = ("scenario.eta_dot_d", f"{CONTROLLER}.eta_dot_d")
"""The connection that lets the controller follow a moving set-point, which the paper has not."""


def element_of(component: str) -> str:
    """Return the name of the element that a component is in the loop."""
    return CONTROLLER if component in CONTROLLER_COMPONENTS else component


def connections(sensor: str = ARM) -> tuple[tuple[str, str], ...]:
    """Return the connections of the loop with a scenario, in which one of `SENSORS` measures."""
    return (
        ("scenario.eta_d", f"{CONTROLLER}.eta_d"),
        ("scenario.current", "rov_plant.current"),
        ("scenario.F_umbilical", "rov_plant.F_umbilical"),
        ("scenario.thrust_loss", "rov_plant.thrust_loss"),
        ("rov_plant.eta", f"{sensor}.eta"),
        ("rov_plant.nu", f"{CONTROLLER}.nu_m"),
        (f"{sensor}.eta_m", f"{CONTROLLER}.eta_m"),
        (f"{sensor}.eta_m_valid", f"{CONTROLLER}.eta_m_valid"),
        (f"{sensor}.F_arm", "rov_plant.F_arm"),
        (f"{CONTROLLER}.u", "rov_plant.u"),
    )


def station_keeping_loop(
    name: str,
    description: str,
    parameters: Mapping[str, Mapping[str, Value]],
    stop_time: float = STOP_TIME,
    sensor: str = ARM,
) -> System:
    """Return the system of one of `SENSORS`, controller and vehicle, stepped in this order by a sequential master."""
    return System(
        name=name,
        description=description,
        elements={element_of(name): name for name in (sensor, "adaptive_pd", "rov_plant")},
        connections=tuple(pair for pair in connections(sensor) if not pair[0].startswith("scenario.")),
        parameters=parameters,
        stop_time=stop_time,
    )


def scenario_loop(
    name: str,
    description: str,
    parameters: Mapping[str, Mapping[str, Value]],
    stop_time: float,
    controller: str,
    set_point_rate: bool = False,
    sensor: str = ARM,
) -> System:
    """Return the same loop with a scenario before the sensor, and one of `CONTROLLER_COMPONENTS` as its controller.

    The controller is told the rate of the set-point, or not.
    """
    links = connections(sensor)
    return System(
        name=name,
        description=description,
        elements={element_of(name): name for name in ("scenario", sensor, controller, "rov_plant")},
        connections=(*links, SET_POINT_RATE) if set_point_rate else links,
        parameters=parameters,
        stop_time=stop_time,
    )


def controller_in(system: System) -> str:
    """Return what controls a system of this loop: a component, or pd for the adaptive one without adaptation."""
    component = system.elements[CONTROLLER]
    adapts = system.parameters.get(CONTROLLER, {}).get("adaptation", True)
    return component if adapts or component != "adaptive_pd" else "pd"


def without_adaptation(system: System, name: str, description: str) -> System:
    """Return the same system with the controller's adaptation off: the paper's PD comparison."""
    controller = {**system.parameters.get(CONTROLLER, {}), "adaptation": False}
    return station_keeping_loop(name, description, {**system.parameters, CONTROLLER: controller}, system.stop_time)
