"""What is read off a run of station keeping: settling, errors, and the estimated against the true disturbance."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..components.frames import pose_difference
from ..components.interface import POSE, WRENCH
from ..ssp.wiring import Wiring, inputs_of
from ..systems.loop import CONTROLLER

AXES = ("x", "y", "z", "psi")
SETTLED = {"x": 0.02, "y": 0.02, "z": 0.02, "psi": np.radians(2.0)}
"""Error in m or rad below which an axis counts as settled."""
HOLD = 0.2
"""Share of a run, at its end, in which holding is assessed."""
_PLANT_POSE = tuple(f"rov_plant.eta.{axis}" for axis in POSE)


@dataclass(frozen=True)
class Axis:
    """How one axis did: settling time in s (None: never); final, and in hold mean and worst error, in m or rad."""

    name: str
    settling: float | None
    final: float
    mean: float
    worst: float


@dataclass(frozen=True)
class Force:
    """One axis of the disturbance wrench at the end, body frame, in N or N m: as estimated and as it is."""

    name: str
    estimated: float
    true: float


def assessable(wiring: Wiring) -> bool:
    """Tell whether a system has the pose of a vehicle: what an arm's inputs ``eta`` receive, else ``rov_plant.eta``."""
    return _arm(wiring) is not None or wiring.outputs.issuperset(_PLANT_POSE)


def outputs_assessed(wiring: Wiring) -> set[str]:
    """Return the outputs that `pose`, `measured`, `errors` and `disturbances` read of the results of a system."""
    arm, controller = _arm(wiring), controller_of(wiring)
    groups = [f"{controller}.eta_d", *([f"{arm}.eta"] if arm else [])]
    inputs = [f"{controller}.eta_m_valid", *(f"{group}.{axis}" for group in groups for axis in POSE)]
    sources = {str(link.source) for end in inputs if (link := wiring.link_to(end))}
    true_pose = () if arm else _PLANT_POSE
    return sources.union(true_pose, *_disturbance_ends(wiring).values()) & wiring.outputs


def pose(results: NDArray[Any], wiring: Wiring) -> NDArray[np.float64]:
    """Return the vehicle's true pose, shape (6, rows), of results that are `assessable`.

    It is read from what the arm receives, in our axes and units, so that it is known of a vehicle of any make.
    """
    arm = _arm(wiring)
    if arm is None:
        return np.stack([results[output] for output in _PLANT_POSE])
    return received(results, wiring, f"{arm}.eta")


def measured(results: NDArray[Any], wiring: Wiring) -> NDArray[np.bool_]:
    """Tell at which times, shape (rows,), the controller has a valid measurement, by its input ``eta_m_valid``.

    A system without such an input does not tell: it counts as measured.
    """
    end = f"{controller_of(wiring)}.eta_m_valid"
    if wiring.link_to(end) is None and wiring.value(end) is None:
        return np.ones(len(results), dtype=bool)
    return np.broadcast_to(_input(results, wiring, end), len(results)) > 0


def errors(results: NDArray[Any], wiring: Wiring) -> NDArray[np.float64]:
    """Return the pose less the set-point, shape (rows, 6), the angles wrapped, of results that are `assessable`."""
    return errors_of(pose(results, wiring), results, wiring)


def errors_of(eta: NDArray[np.float64], results: NDArray[Any], wiring: Wiring) -> NDArray[np.float64]:
    """Return the `errors` of a `pose` that was read before."""
    set_point = received(results, wiring, f"{controller_of(wiring)}.eta_d")
    error: NDArray[np.float64] = pose_difference(eta, set_point).T
    return error


def hold_begin(results: NDArray[Any]) -> float:
    """Return the time in s after which holding is assessed."""
    time = results["time"]
    return float(time[-1] - HOLD * (time[-1] - time[0]))


def in_hold(results: NDArray[Any]) -> NDArray[np.bool_]:
    """Tell which rows, shape (rows,), are of the hold; the last one is in any case."""
    held: NDArray[np.bool_] = results["time"] > hold_begin(results)
    held[-1] = True
    return held


def axes(results: NDArray[Any], wiring: Wiring) -> list[Axis]:
    """Return how each of `AXES` did."""
    time, error = results["time"], errors(results, wiring)
    held = error[in_hold(results)]
    assessed = []
    for name in AXES:
        e = error[:, POSE.index(name)]
        h = held[:, POSE.index(name)]
        assessed.append(
            Axis(
                name=name,
                settling=settling(time, e, SETTLED[name]),
                final=float(e[-1]),
                mean=float(h.mean()),
                worst=float(np.abs(h).max()),
            )
        )
    return assessed


def settling(time: NDArray[np.float64], error: NDArray[np.float64], limit: float) -> float | None:
    """Return the time after which an error, shape (rows,), stays within a limit; None if it does not at the end."""
    outside = np.flatnonzero(~(np.abs(error) <= limit))
    settled = 0 if outside.size == 0 else outside[-1] + 1
    return float(time[settled]) if settled < len(time) else None


def disturbances(results: NDArray[Any], wiring: Wiring) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Return the estimated and the true disturbance wrench over time, by axis; none if the system does not tell both.

    Body frame, N or N m, each of shape (rows,). In the four-DOF form roll and pitch are not estimated.
    """
    ends = _disturbance_ends(wiring)
    if not {end for pair in ends.values() for end in pair} <= set(results.dtype.names or ()):
        return {}
    return {axis: (results[estimate], results[true]) for axis, (estimate, true) in ends.items()}


def _disturbance_ends(wiring: Wiring) -> dict[str, list[str]]:
    """Return the outputs that are the estimated and the true disturbance, by axis."""
    controller = controller_of(wiring)
    estimated = WRENCH if wiring.value(f"{controller}.control_roll_pitch") else ("X", "Y", "Z", "N")
    return {axis: [f"{element}.disturbance.{axis}" for element in (controller, "rov_plant")] for axis in estimated}


def forces(results: NDArray[Any], wiring: Wiring) -> list[Force]:
    """Return the `disturbances` at the end."""
    found = disturbances(results, wiring).items()
    return [Force(axis, float(estimated[-1]), float(true[-1])) for axis, (estimated, true) in found]


def report(results: NDArray[Any], wiring: Wiring) -> str:
    """Return a short table of `axes` and `forces`."""
    lines = [f"{'axis':6} {'settles [s]':>12} {'final':>11} {'mean in hold':>13} {'worst in hold':>14}"]
    for axis in axes(results, wiring):
        unit, scale = ("deg", 180 / np.pi) if axis.name == "psi" else ("mm", 1e3)
        settling = "never" if axis.settling is None else f"{axis.settling:.2f}"
        cells = [f"{v * scale:.2f} {unit}" for v in (axis.final, axis.mean, axis.worst)]
        lines.append(f"{axis.name:6} {settling:>12} {cells[0]:>11} {cells[1]:>13} {cells[2]:>14}")
    limits = f"{SETTLED['x'] * 1e3:g} mm, or {np.degrees(SETTLED['psi']):g} deg"
    tilt = np.abs(pose(results, wiring)[3:5]).max(axis=0)
    if tilt.any():
        held = tilt[in_hold(results)]
        cells = [f"{np.degrees(angle):.2f} deg" for angle in (tilt[-1], held.mean(), held.max())]
        lines.append(f"{'tilt':6} {'':>12} {cells[0]:>11} {cells[1]:>13} {cells[2]:>14}")
    duration = results["time"][-1] - hold_begin(results)
    lines.append(f"settles: after this time the error stays within {limits}. hold: the last {duration:.3g} s.")
    if _element_with(wiring, "eta_d") is None:
        lines.append("No element has inputs eta_d: the errors are those from a set-point of 0.")
    if found := forces(results, wiring):
        lines += [
            "",
            f"{'disturbance':12} {'estimated':>11} {'true':>11}   body frame, at the end",
        ]
        for force in found:
            unit = "N" if force.name in "XYZ" else "N m"
            lines.append(f"{force.name:12} {force.estimated:>11.3f} {force.true:>11.3f}   {unit}")
    return "\n".join(lines)


def received(results: NDArray[Any], wiring: Wiring, group: str) -> NDArray[np.float64]:
    """Return what the inputs of a pose, ``element.group``, had over time, shape (6, rows)."""
    values = np.empty((len(POSE), len(results)))
    for row, axis in zip(values, POSE, strict=True):
        row[:] = _input(results, wiring, f"{group}.{axis}")
    return values


def _element_with(wiring: Wiring, group: str) -> str | None:
    """Return the name of the first element that has all inputs of a pose."""
    wanted = {f"{group}.{axis}" for axis in POSE}
    return next((element.name for element in wiring.elements if inputs_of(element.description) >= wanted), None)


def _arm(wiring: Wiring) -> str | None:
    arm = _element_with(wiring, "eta")
    return arm if any(wiring.link_to(f"{arm}.eta.{axis}") for axis in POSE) else None


def controller_of(wiring: Wiring) -> str:
    """Return the name of the element that has the set-point as inputs ``eta_d``."""
    return _element_with(wiring, "eta_d") or CONTROLLER


def _input(results: NDArray[Any], wiring: Wiring, end: str) -> Any:
    """Return what an input had: what it was fed, what its source gave, its start value, or else 0."""
    if end in (results.dtype.names or ()):
        return results[end]
    link = wiring.link_to(end)
    return link.factor * results[str(link.source)] if link else wiring.value(end) or 0.0
