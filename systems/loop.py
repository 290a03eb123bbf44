"""The loop that all systems share: the arm measures, the controller commands, the vehicle moves."""

from collections.abc import Mapping

from rov_cosim.exporters.model_description import STOP_TIME
from rov_cosim.ssp.declaration import System
from rov_cosim.ssp.values import Value

CONTROLLER = "controller"
"""The element that controls, in every system."""

CONTROLLER_COMPONENTS = ("adaptive_pd", "pid", "sliding_mode", "sun_cheah")
"""The components that fit into the loop as its controller."""

CONNECTIONS = (
    ("scenario.eta_d", f"{CONTROLLER}.eta_d"),
    ("scenario.current", "rov_plant.current"),
    ("scenario.F_umbilical", "rov_plant.F_umbilical"),
    ("scenario.thrust_loss", "rov_plant.thrust_loss"),
    ("rov_plant.eta", "passive_arm.eta"),
    ("rov_plant.nu", f"{CONTROLLER}.nu_m"),
    ("passive_arm.eta_m", f"{CONTROLLER}.eta_m"),
    ("passive_arm.eta_m_valid", f"{CONTROLLER}.eta_m_valid"),
    ("passive_arm.F_arm", "rov_plant.F_arm"),
    (f"{CONTROLLER}.u", "rov_plant.u"),
)
"""The connections of the loop with a scenario."""

SET_POINT_RATE = ("scenario.eta_dot_d", f"{CONTROLLER}.eta_dot_d")
"""The connection that lets the controller follow a moving set-point, which the paper has not."""


def element_of(component: str) -> str:
    """Return the name of the element that a component is in the loop."""
    return CONTROLLER if component in CONTROLLER_COMPONENTS else component


def station_keeping_loop(
    name: str, description: str, parameters: Mapping[str, Mapping[str, Value]], stop_time: float = STOP_TIME
) -> System:
    """Return the system of arm, controller and vehicle, stepped in this order by a sequential master."""
    return System(
        name=name,
        description=description,
        elements={element_of(name): name for name in ("passive_arm", "adaptive_pd", "rov_plant")},
        connections=tuple(pair for pair in CONNECTIONS if not pair[0].startswith("scenario.")),
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
) -> System:
    """Return the same loop with a scenario before the arm, and one of `CONTROLLER_COMPONENTS` as its controller.

    The controller is told the rate of the set-point, or not.
    """
    return System(
        name=name,
        description=description,
        elements={element_of(name): name for name in ("scenario", "passive_arm", controller, "rov_plant")},
        connections=(*CONNECTIONS, SET_POINT_RATE) if set_point_rate else CONNECTIONS,
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
