"""Where a sign of the loop is wrong: the vehicle is pushed, and vehicle, measurement and controller have to answer.

Each axis is pushed both ways, the controller having no say; half the difference of the two runs is free of the loads.
What is pushed has to move along, the measurement has to follow it, and the controller to push against it.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...components.frames import pose_difference, rotation
from ...components.interface import POSE, WRENCH, XYZ, count
from ...components.vehicle import FOUR_DOF, N_THRUSTERS, allocation_matrix
from ...ssp.swap_map import stem
from ...ssp.wiring import Wiring, WiringError
from ..assessment import AXES, controller_of, pose, received
from ..nominal import Nominal
from ..runs import simulated
from ..scores import commands_of
from ..settings import Settings
from .vacuous import released

OFFSET = 0.1
"""Of a PD controller, in m and rad, under the push."""
DURATION = 2.0
"""Of the push, in s; the second half of it is looked at."""
LEAST = 1e-3
"""Way in m and rad that is taken for none."""


class Faults(NamedTuple):
    """A sentence for each place at which the loop answers the wrong way, with the axes; the controller's apart."""

    before: tuple[str, ...] = ()
    controller: tuple[str, ...] = ()

    def told(self, is_plant_wrong: bool) -> tuple[str, ...]:
        """Return the sentences that stand: a controller answers what comes before it, and is judged if that is right.

        A plant that turns the wrong way, say, makes one push the wrong way along x too.
        """
        return self.before or (() if is_plant_wrong else self.controller)


def faults(wiring: Wiring, settings: Settings) -> Faults:
    """Return where the loop answers the wrong way.

    Nothing is said of a controller whose gains or thrusters are not known by the names of ours.
    """
    try:
        probe = _Probe(wiring, settings)
        found = {axis: probe.fault(axis) for axis in AXES}
    except WiringError:  # one of them a DoesNotApplyError
        return Faults()
    kinds = filter(None, dict.fromkeys(found.values()))
    said = {kind: kind.format(", ".join(axis for axis in AXES if found[axis] == kind)) for kind in kinds}
    own = said.pop(probe.pushes_on, None)
    return Faults(tuple(said.values()), (own,) if own else ())


class _Answer(NamedTuple):
    """A pushed run: the yaw at its start; of its second half true and measured pose, and thruster commands if told."""

    yaw: float
    pose: NDArray[np.float64]
    measured: NDArray[np.float64]
    commands: NDArray[np.float64] | None


class _Probe:
    """The vehicle of a system, pushed.

    Raises
    ------
    DoesNotApplyError : the controller has not the parameters by which it is known how to push.
    """

    def __init__(self, wiring: Wiring, settings: Settings) -> None:
        self._wiring, self._controller = wiring, controller_of(wiring)
        self._settings = replace(settings, stop_time=wiring.start_time + DURATION)
        nominal, thrusters = Nominal(wiring), [f"{self._controller}.thruster[{i}]" for i in count(N_THRUSTERS)]
        self._stiffness = nominal.vector(f"{self._controller}.K_P", AXES)
        r, d = (np.stack([nominal.vector(f"{one}.{group}", XYZ) for one in thrusters]) for group in "rd")
        enabled = np.array([nominal.value(f"{one}.enabled") for one in thrusters])
        self._allocation = np.diag(FOUR_DOF) @ allocation_matrix(r, d, enabled)

    def fault(self, axis: str) -> str:
        """Return what answers a push along an axis the wrong way, with a place for the axis; nothing if all is well."""
        wrench = np.zeros(len(POSE))
        wrench[POSE.index(axis)] = OFFSET * abs(self._stiffness[AXES.index(axis)])
        forth, back = self._answer(wrench), self._answer(-wrench)
        if forth is None or back is None:
            return ""
        way = _along(axis, forth.yaw, forth.pose, back.pose)
        told = _along(axis, forth.yaw, forth.measured, back.measured)
        if abs(way) < LEAST:
            return f"{self._vehicle} does not move when it is pushed along {{}}."
        if way < 0:
            between = f"a sign is wrong between {self._pushing} and {self._vehicle}, or in {self._vehicle}"
            return f"{self._vehicle} goes the other way when it is pushed along {{}}: {between}."
        if told < LEAST:
            how = "the other way" if told < -LEAST else "no way"
            between = (
                f"a sign or a connection is wrong between {self._arm} and {self._controller}.eta_m, or in {self._arm}"
            )
            return f"{self._controller} is told {how} when the vehicle moves along {{}}: {between}."
        if forth.commands is None or back.commands is None:
            return ""
        push = self._allocation @ (forth.commands - back.commands).mean(axis=1)
        if push[POSE.index(axis)] > 0:
            return self.pushes_on
        return ""

    @property
    def pushes_on(self) -> str:
        """What is said of the controller, with a place for the axis."""
        return f"{self._controller} pushes on when the vehicle moves along {{}}: a sign is wrong in it."

    def _answer(self, wrench: NDArray[np.float64]) -> _Answer | None:
        """Return how the loop answers a wrench, shape (6,), in the body frame; None if the run failed."""
        thrusts = np.linalg.pinv(self._allocation) @ wrench
        commanded = {f"u[{i}]": thrust for i, thrust in zip(count(N_THRUSTERS), thrusts.tolist(), strict=True)}
        commanded |= {f"tau.{name}": value for name, value in zip(WRENCH, wrench.tolist(), strict=True)}
        values = {
            str(link.target): link.factor * commanded[link.source.variable]
            for link in self._wiring.links
            if link.source.element == self._controller and link.source.variable in commanded
        }
        pushed = released(self._wiring).with_values(values)
        done = simulated(pushed, self._settings, progress=lambda steps: steps)
        if done.failure:
            return None
        results = done.results
        way = pose(results, pushed)
        measured = received(results, pushed, f"{self._controller}.eta_m")
        commands = commands_of(results, self._controller)
        late = slice(len(results) // 2, None)
        return _Answer(
            float(way[5, 0]), way[:, late], measured[:, late], commands if commands is None else commands[:, late]
        )

    @property
    def _pushing(self) -> str:
        """By which outputs the controller commands."""
        sources = [link.source for link in self._wiring.links if link.source.element == self._controller]
        return " and ".join(dict.fromkeys(f"{self._controller}.{stem(source.variable)}" for source in sources))

    @property
    def _vehicle(self) -> str:
        """What the controller commands."""
        fed = {link.target.element: None for link in self._wiring.links if link.source.element == self._controller}
        return " and ".join(fed) or "the vehicle"

    @property
    def _arm(self) -> str:
        """What measures for the controller."""
        link = self._wiring.link_to(f"{self._controller}.eta_m.x")
        return link.source.element if link else f"what feeds {self._controller}.eta_m"


def _along(axis: str, yaw: float, pose: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Return half the mean difference of two poses, shape (6, rows), along an axis of a level body."""
    difference = pose_difference(pose, other).mean(axis=1) / 2
    difference[:3] = rotation(np.array([0.0, 0.0, yaw])).T @ difference[:3]
    return float(difference[POSE.index(axis)])
