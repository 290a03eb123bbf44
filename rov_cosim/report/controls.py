"""What can be turned on the page: each control is a set of start values, so that a command can repeat it."""

from collections.abc import Mapping, Set
from dataclasses import dataclass, field
from typing import Any, Literal

from ..components.interface import XYZ, count
from ..components.vehicle import COUPLE, FORCES, N_THRUSTERS
from ..ssp.values import Value
from ..study.assessment import AXES
from ..systems.loop import CONTROLLER

Kind = Literal["factor", "value", "force", "choice"]


@dataclass(frozen=True)
class Control:
    """A slider, or a choice.

    Parameters
    ----------
    key : its name in a link.
    label : in words.
    ends : the start values ``element.variable`` that it sets, as far as a system has them.
    kind : of a slider: "factor" multiplies what each system has, "value" is the value, "force" the value over the
        vehicle's mass, relative to the paper's vehicle; or "choice".
    low, high, step : of a slider; a factor's scale is logarithmic unless it begins at 0.
    unit : of the value.
    options : of a choice: start values by label; the first leaves the system as it is.
    """

    key: str
    label: str
    ends: tuple[str, ...] = ()
    kind: Kind = "value"
    low: float = 0.0
    high: float = 1.0
    step: float = 0.01
    unit: str = ""
    options: Mapping[str, Mapping[str, Value]] = field(default_factory=dict)

    @property
    def sets(self) -> set[str]:
        """All start values that it may set."""
        return {*self.ends, *(end for values in self.options.values() for end in values)}


def _gains(symbol: str, name: str) -> list[Control]:
    labels = {**dict.fromkeys(AXES, ""), "psi": "yaw"}
    return [
        Control(
            f"{symbol}.{axis}", f"{name}, {labels[axis] or axis}", (f"{CONTROLLER}.{symbol}.{axis}",), "factor", 0.1, 10
        )
        for axis in AXES
    ]


def _force(key: str, label: str, most: float) -> Control:
    return Control(key, label, (f"rov_plant.{key}",), "force", -most, most, most / 50, "N")


def _to_the_end(ends: tuple[str, ...], key: str, label: str) -> Control:
    return Control(key, label, ends, "value", 0, 80, 1, "s")


CONTROLS: Mapping[str, tuple[Control, ...]] = {
    "Gains": (
        *_gains("K_P", "K_P"),
        *_gains("K_D", "K_D"),
        Control(
            "Gamma", "\u0393, all", tuple(f"{CONTROLLER}.Gamma.{load}" for load in (*FORCES, *COUPLE)), "factor", 0, 5
        ),
        Control("epsilon_0", "\u03b5\u2080", (f"{CONTROLLER}.epsilon_0",), "factor", 0, 3),
        Control("alpha", "\u03b1", (f"{CONTROLLER}.alpha",), "factor", 0, 5),
        Control("K_I", "K_I of the PID, all", tuple(f"{CONTROLLER}.K_I.{axis}" for axis in AXES), "factor", 0, 5),
        Control("T_f", "filter time constant", (f"{CONTROLLER}.filter_time_constant",), "factor", 0.1, 10),
        Control(
            "adaptation",
            "adaptation",
            kind="choice",
            options={"as it is": {}, "off": {f"{CONTROLLER}.adaptation": False}},
        ),
    ),
    "Measurement": (
        Control("noise", "noise of the position", ("passive_arm.noise_std",), "value", 0, 0.03, 0.0005, "m"),
        Control(
            "noise_angle", "noise of the angles", ("passive_arm.noise_std_angle",), "value", 0, 0.05, 0.0005, "rad"
        ),
        Control("delay", "delay", ("passive_arm.delay",), "value", 0, 10, 1, "samples"),
        Control("dropout", "share of lost samples", ("passive_arm.dropout",), "value", 0, 0.95, 0.01),
        Control("seed", "seed of the noise", ("passive_arm.seed",), "value", 1, 100, 1),
    ),
    "Sea and umbilical": (
        *(
            Control(
                f"current.{axis}",
                f"current, {axis}",
                (f"scenario.current_mean.{axis}",),
                "value",
                -0.4,
                0.4,
                0.01,
                "m/s",
            )
            for axis in XYZ[:2]
        ),
        Control(
            "current_std",
            "variation of the current",
            tuple(f"scenario.current_std.{axis}" for axis in XYZ),
            "value",
            0,
            0.2,
            0.005,
            "m/s",
        ),
        _force("dB", "excess buoyancy", 40),
        *(_force(f"F_C.{axis}", f"umbilical, {axis}", 30) for axis in XYZ),
        *(_force(f"F_A.{axis}", f"arm, {axis}", 30) for axis in XYZ),
        *(
            Control(f"pull.{axis}", f"a pull comes, {axis}", (f"scenario.pull[1].F.{axis}",), "force", -60, 60, 1, "N")
            for axis in XYZ
        ),
        _to_the_end(("scenario.pull[1].begin",), "pull_begin", "it begins"),
        _to_the_end(("scenario.pull[1].duration",), "pull_duration", "it lasts (0: to the end)"),
    ),
    "Thrusters": (
        Control(
            "lost",
            "lost thruster",
            kind="choice",
            options={"none": {}, **{i: {f"scenario.thruster[{i}].loss": 1.0} for i in count(N_THRUSTERS)}},
        ),
        _to_the_end(("scenario.thrust_loss_begin",), "lost_begin", "it is lost from"),
        Control("lag", "time constant", ("rov_plant.thruster_time_constant",), "value", 0, 1, 0.01, "s"),
        Control("dead_band", "dead band", ("rov_plant.thruster_dead_band",), "force", 0, 5, 0.1, "N"),
    ),
    "Start and set-point": (
        *(
            Control(f"eta_0.{axis}", f"start, {axis}", (f"rov_plant.eta_0.{axis}",), "value", -0.8, 0.8, 0.01, "m")
            for axis in XYZ
        ),
        Control("eta_0.psi", "start, yaw", ("rov_plant.eta_0.psi",), "value", -3, 3, 0.05, "rad"),
        *(
            Control(
                f"step.{axis}",
                f"step of the set-point, {axis}",
                (f"scenario.step.{axis}",),
                "value",
                -0.4,
                0.4,
                0.01,
                "m",
            )
            for axis in XYZ
        ),
        Control("step.psi", "step of the set-point, yaw", ("scenario.step.psi",), "value", -1, 1, 0.05, "rad"),
        _to_the_end(("scenario.step_begin",), "step_begin", "it comes"),
    ),
}
"""By group."""


def as_data(known: Set[str]) -> list[dict[str, Any]]:
    """Return those for a page whose systems have some variables."""
    there = {
        group: [vars(control) for control in controls if not known.isdisjoint(control.sets)]
        for group, controls in CONTROLS.items()
    }
    return [{"group": group, "controls": controls} for group, controls in there.items() if controls]
