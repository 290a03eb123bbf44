"""The nominal loop, as its start values tell it: what a trouble is scaled by."""

import numpy as np
from numpy.typing import NDArray

from ..components.adaptive_pd import COMPONENT as ADAPTIVE_PD
from ..components.interface import XYZ, count
from ..components.rov_plant import COMPONENT as ROV_PLANT
from ..components.vehicle import FORCES, N_THRUSTERS, allocation_matrix, degrees_of_freedom, disturbance_map
from ..ssp.values import Value, parse
from ..ssp.wiring import Wiring, WiringError
from ..systems.fleet import VEHICLES
from ..systems.gains import scaled
from ..systems.loop import SENSORS, WIRE


class DoesNotApplyError(WiringError):
    """The trouble is of something that the loop has not."""


class Nominal:
    """Access to the start values of a loop, by ``element.variable``."""

    def __init__(self, wiring: Wiring) -> None:
        self._wiring = wiring

    @property
    def sensor(self) -> str:
        """The element that measures the pose: of a loop that has none of `SENSORS` the first of these."""
        names = {element.name for element in self._wiring.elements}
        return next((name for name in SENSORS if name in names), SENSORS[0])

    def needs_receiver(self, output: str) -> None:
        """Raise DoesNotApplyError if no element receives the output ``element.variable``."""
        if not any(str(link.source) == output for link in self._wiring.links):
            raise DoesNotApplyError(self._wiring.name, [f"Nothing receives {output}, by which the trouble comes."])

    def needs_free_tilt(self) -> None:
        """Raise DoesNotApplyError if roll and pitch of the vehicle are locked."""
        if self.value("rov_plant.lock_roll_pitch"):
            raise DoesNotApplyError(self._wiring.name, ["Roll and pitch are locked."])

    def value(self, end: str) -> float:
        """Return a start value.

        Raises
        ------
        DoesNotApplyError : the loop has no such variable.
        """
        value = self._wiring.value(end)
        if value is None:
            raise DoesNotApplyError(self._wiring.name, [f"There is no {end}, which the trouble is about." + _cure(end)])
        return float(value)

    def vector(self, group: str, labels: tuple[str, ...] = XYZ) -> NDArray[np.float64]:
        """Return the start values of ``group.label``, shape (len(labels),)."""
        return np.array([self.value(f"{group}.{label}") for label in labels])

    def declared(self, element: str, *prefixes: str) -> dict[str, Value]:
        """Return what an element's FMU declares as start of the parameters whose names begin so."""
        found = {
            f"{element}.{variable.name}": parse(str(variable.start), variable.type)
            for e in self._wiring.elements
            for variable in e.description.modelVariables
            if e.name == element and variable.causality == "parameter" and variable.start is not None
            if variable.name.startswith(prefixes)
        }
        if not found:
            problem = f"There is no {element} with parameters {' or '.join(f'{p}*' for p in prefixes)}."
            raise DoesNotApplyError(self._wiring.name, [problem])
        return found

    def force(self, *offset: float) -> NDArray[np.float64]:
        """Return the force in N, shape (3,), against which the paper's PD controller has this offset in m."""
        return self.stiffness() * offset

    def stiffness(self) -> NDArray[np.float64]:
        """Return K_P of x, y and z in N/m, shape (3,), of the paper's controller scaled to the vehicle.

        So the vehicle is under the same forces whatever controls it. Of a vehicle of another make, whose inertia is not
        known, it is K_P of its controller.
        """
        plant = {name: self._wiring.value(f"rov_plant.{name}") for name in ROV_PLANT.p.names}
        known = {name: value for name, value in plant.items() if value is not None}
        if len(known) < len(plant):
            return self.vector("controller.K_P")
        gains = scaled(ADAPTIVE_PD, known)
        return np.array([float(gains[f"K_P.{axis}"]) for axis in XYZ])

    def away(self) -> NDArray[np.float64]:
        """Return the direction, shape (3,), from the structure to the sensor's base of a vehicle at the origin."""
        gap = self.vector(f"{self.sensor}.r_A") - self.vector(f"{self.sensor}.attachment")
        unit: NDArray[np.float64] = gap / np.linalg.norm(gap)
        return unit

    def thrust_at_rest(self) -> float:
        """Return the largest thruster force in N that holding still takes, at zero roll, pitch and yaw."""
        forces = self.vector("rov_plant", FORCES)
        if self.sensor == WIRE:
            forces[4:7] -= self.value(f"{WIRE}.winch_tension") * self.away()
        W = disturbance_map(np.zeros(6), *(self.vector(f"rov_plant.{point}") for point in ("r_B", "r_C", "r_A")))
        thrusters = [f"controller.thruster[{i}]" for i in count(N_THRUSTERS)]
        r, d = (np.stack([self.vector(f"{thruster}.{group}") for thruster in thrusters]) for group in ("r", "d"))
        enabled = np.array([self.value(f"{thruster}.enabled") for thruster in thrusters])
        dof = degrees_of_freedom(self.value("controller.control_roll_pitch"))
        B = np.diag(dof) @ allocation_matrix(r, d, enabled)
        return float(np.abs(np.linalg.pinv(B) @ (dof * (W @ forces))).max())


def _cure(end: str) -> str:
    """Return which systems have what a system has not, or nothing."""
    has = "so have the other systems of the fleet"
    return f" The system {next(iter(VEHICLES))} has a scenario; {has}." if end.startswith("scenario.") else ""
