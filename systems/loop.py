"""The loop that all systems share: the arm measures, the controller commands, the vehicle moves."""

from collections.abc import Mapping

from rov_cosim.exporters.model_description import STOP_TIME
from rov_cosim.ssp.declaration import System
from rov_cosim.ssp.wiring import Value

CONTROLLER_COMPONENTS = ("adaptive_pd", "pid")
"""The components that fit into the loop as its controller."""


def connections(controller: str) -> tuple[tuple[str, str], ...]:
    """Return the connections of the loop with a scenario and this element as its controller."""
    return (
        ("scenario.eta_d", f"{controller}.eta_d"),
        ("scenario.current", "rov_plant.current"),
        ("scenario.F_umbilical", "rov_plant.F_umbilical"),
        ("rov_plant.eta", "passive_arm.eta"),
        ("rov_plant.nu", f"{controller}.nu_m"),
        ("passive_arm.eta_m", f"{controller}.eta_m"),
        ("passive_arm.eta_m_valid", f"{controller}.eta_m_valid"),
        ("passive_arm.F_arm", "rov_plant.F_arm"),
        (f"{controller}.u", "rov_plant.u"),
    )


def station_keeping_loop(
    name: str, description: str, parameters: Mapping[str, Mapping[str, Value]], stop_time: float = STOP_TIME
) -> System:
    """Return the system of arm, controller and vehicle, stepped in this order by a sequential master."""
    return System(
        name=name,
        description=description,
        elements={element: element for element in ("passive_arm", "adaptive_pd", "rov_plant")},
        connections=tuple(c for c in connections("adaptive_pd") if not c[0].startswith("scenario.")),
        parameters=parameters,
        stop_time=stop_time,
    )


def scenario_loop(
    name: str, description: str, parameters: Mapping[str, Mapping[str, Value]], stop_time: float, controller: str
) -> System:
    """Return the same loop with a scenario, and one of `CONTROLLER_COMPONENTS` as the element ``controller``."""
    return System(
        name=name,
        description=description,
        elements={
            "scenario": "scenario",
            "passive_arm": "passive_arm",
            "controller": controller,
            "rov_plant": "rov_plant",
        },
        connections=connections("controller"),
        parameters=parameters,
        stop_time=stop_time,
    )


def without_adaptation(system: System, name: str, description: str) -> System:
    """Return the same system with the controller's adaptation off: the paper's PD comparison."""
    controller = {**system.parameters.get("adaptive_pd", {}), "adaptation": False}
    return station_keeping_loop(name, description, {**system.parameters, "adaptive_pd": controller}, system.stop_time)
