"""The loop that all systems share: the arm measures, the controller commands, the vehicle moves."""

from collections.abc import Mapping

from rov_cosim.exporters.model_description import STOP_TIME
from rov_cosim.systems.declaration import System
from rov_cosim.systems.wiring import Value

ELEMENTS = ("passive_arm", "adaptive_pd", "rov_plant")
CONNECTIONS = (
    ("rov_plant.eta", "passive_arm.eta"),
    ("rov_plant.nu", "adaptive_pd.nu_m"),
    ("passive_arm.eta_m", "adaptive_pd.eta_m"),
    ("passive_arm.eta_m_valid", "adaptive_pd.eta_m_valid"),
    ("passive_arm.F_arm", "rov_plant.F_arm"),
    ("adaptive_pd.u", "rov_plant.u"),
)


def station_keeping_loop(
    name: str, description: str, parameters: Mapping[str, Mapping[str, Value]], stop_time: float = STOP_TIME
) -> System:
    """Return the system of arm, controller and vehicle, stepped in this order by a sequential master."""
    return System(
        name=name,
        description=description,
        elements={element: element for element in ELEMENTS},
        connections=CONNECTIONS,
        parameters=parameters,
        stop_time=stop_time,
    )


def without_adaptation(system: System, name: str, description: str) -> System:
    """Return the same system with the controller's adaptation off: the paper's PD comparison."""
    controller = {**system.parameters.get("adaptive_pd", {}), "adaptation": False}
    return station_keeping_loop(name, description, {**system.parameters, "adaptive_pd": controller}, system.stop_time)
