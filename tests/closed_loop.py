"""A controller and the vehicle in a loop without error of measurement: what closed forms are about."""

from rov_cosim.components.interface import SAMPLE_TIME
from rov_cosim.master.exchange import gauss_seidel
from rov_cosim.master.simulation import simulate
from rov_cosim.ssp.declaration import System, wire

CONNECTIONS = (
    ("rov_plant.eta", "controller.eta_m"),
    ("rov_plant.nu", "controller.nu_m"),
    ("controller.u", "rov_plant.u"),
)


def run(controller, duration, values, plant, step=SAMPLE_TIME):
    """Return the results of native FMUs: the named controller, started with `values`, and the vehicle with `plant`."""
    elements = {"controller": controller, "rov_plant": "rov_plant"}
    parameters = {"controller": {"eta_m_valid": True, "sample_time": step, **values}, "rov_plant": plant}
    system = System("ideal", "A controller and the vehicle", elements, CONNECTIONS, duration, parameters, step)
    return simulate(wire(system), gauss_seidel)


def last(results, group, names):
    """Return the values of ``group.name`` at the end."""
    return [float(results[f"{group}.{name}"][-1]) for name in names]
