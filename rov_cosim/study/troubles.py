"""What goes wrong at sea: each trouble is a set of start values for a loop, scaled to its vehicle.

Forces are given by the offset that the paper's PD controller, scaled to the vehicle, would have under them, thrusts by
what holding still takes.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ..components.interface import XYZ
from ..components.sensing import LONGEST_DELAY
from ..ssp.values import Value
from ..ssp.wiring import Wiring
from ..systems.loop import ARM, WIRE
from .nominal import DoesNotApplyError, Nominal

ONSET = 60.0
"""When a trouble that comes during a run comes, in s: every vehicle is at its place by then."""

Values = Mapping[str, Value]

_COMES_BY = {
    "scenario.current": "scenario.current.x",
    "scenario.pull": "scenario.F_umbilical.x",
    "scenario.thruster": "scenario.thrust_loss[1]",
    "passive_arm.stiffness": "passive_arm.F_arm.x",
}
"""The output by which a parameter's trouble comes to the vehicle, which another make of vehicle may not listen to."""


_NOISE = {
    ARM: ("noise_std",),
    WIRE: ("length_noise_std", "angle_noise_std", *(f"attitude_noise_std.{axis}" for axis in ("phi", "theta", "psi"))),
}
"""The parameters of each sensor's noise."""


@dataclass(frozen=True)
class Trouble:
    """A trouble: what it is, and the start values ``element.variable`` that bring it about in a loop."""

    name: str
    description: str
    values: Callable[[Nominal], Values]

    def applied(self, wiring: Wiring) -> Wiring:
        """Return the loop with the trouble in it; it raises what `values_in` does."""
        return wiring.with_values(self.values_in(wiring))

    def values_in(self, wiring: Wiring) -> Values:
        """Return the start values that bring it about in a loop.

        Raises
        ------
        DoesNotApplyError : the loop has no variable for it, or it would change nothing.
        """
        loop = Nominal(wiring)
        values = self.values(loop)
        for end in values:
            loop.value(end)
            for cause, output in _COMES_BY.items():
                if end.startswith(cause):
                    loop.needs_receiver(output)
        if values and all(loop.value(end) == value for end, value in values.items()):
            raise DoesNotApplyError(wiring.name, ["The trouble changes nothing here."])
        return values


def _fixed(**elements: Values) -> Callable[[Nominal], Values]:
    """Return values that are the same for every loop, by element; `sensor` is what measures."""

    def values(loop: Nominal) -> Values:
        named = {loop.sensor if element == "sensor" else element: group for element, group in elements.items()}
        return {f"{element}.{name}": value for element, group in named.items() for name, value in group.items()}

    return values


def _pull(
    loop: Nominal,
    number: int,
    offset: tuple[float, float, float],
    begin: float,
    duration: float = 0.0,
    rise: float = 0.0,
) -> Values:
    """Return a pull of the umbilical against which a PD controller has this offset in m."""
    force = {f"F.{axis}": f for axis, f in zip(XYZ, loop.force(*offset).tolist(), strict=True)}
    pull = {**force, "begin": begin, "duration": duration, **({"rise": rise} if rise else {})}
    return {f"scenario.pull[{number}].{name}": value for name, value in pull.items()}


def _dragged_away(loop: Nominal, duration: float) -> Values:
    """Return a pull away from the structure that lasts, and then one as long back to it."""
    x, y, z = (1.5 * loop.away()).tolist()
    back = ONSET + duration
    return {**_pull(loop, 1, (x, y, z), ONSET, duration), **_pull(loop, 2, (-x, -y, -z), back, duration)}


def _scaled(*ends: str, by: float) -> Callable[[Nominal], Values]:
    """Return start values multiplied by a factor."""
    return lambda loop: {end: by * loop.value(end) for end in ends}


def _noise(by: float) -> Callable[[Nominal], Values]:
    """Return the noise of what measures multiplied by a factor."""
    return lambda loop: _scaled(*(f"{loop.sensor}.{name}" for name in _NOISE[loop.sensor]), by=by)(loop)


def _heavier(by: float) -> Callable[[Nominal], Values]:
    """Return the vehicle's mass and inertia multiplied by a factor."""
    return _scaled("rov_plant.mass", "rov_plant.I.xx", "rov_plant.I.yy", "rov_plant.I.zz", by=by)


def _thrust_max(share: float) -> Callable[[Nominal], Values]:
    """Return the thrusters' limit as a share of what holding still takes."""
    ends = ("rov_plant.thrust_max", "controller.thrust_max")
    return lambda loop: dict.fromkeys(ends, share * loop.thrust_at_rest())


def _where_tilted(values: Callable[[Nominal], Values]) -> Callable[[Nominal], Values]:
    """Return values for vehicles that roll and pitch; for others they would be of no effect."""

    def checked(loop: Nominal) -> Values:
        loop.needs_free_tilt()
        return values(loop)

    return checked


def _turned(loop: Nominal, psi: float) -> Values:
    """Return a set-point turned about the arm's base, which stays where it is."""
    x, y, _ = loop.vector(f"{loop.sensor}.r_A")
    c, s = np.cos(psi), np.sin(psi)
    step = {"x": x - c * x + s * y, "y": y - s * x - c * y, "psi": psi}
    return {**{f"scenario.step.{axis}": float(value) for axis, value in step.items()}, "scenario.step_begin": ONSET}


def _delay(samples: int) -> Trouble:
    return Trouble(f"delay_{samples}", f"measurement {30 * samples} ms late", _fixed(sensor={"delay": samples}))


def _varying_current(seed: int) -> Trouble:
    current = {"current_mean.x": 0.1, "current_std.x": 0.1, "current_std.y": 0.1, "seed": 1000 + seed}
    return Trouble(
        f"varying_current_{seed}",
        "0.1 m/s and a Gauss-Markov part of 0.1 m/s, 60 s correlation",
        _fixed(scenario=current),
    )


_LIST = (
    Trouble("still_water", "the loads of umbilical and arm, 5 mm of noise, nothing else", _fixed()),
    Trouble(
        "paper_gains",
        "the gains of the paper's vehicle, not scaled",
        lambda loop: loop.declared("controller", "K_", "Gamma", "epsilon_0"),
    ),
    Trouble(
        "six_dof",
        "roll and pitch are controlled too",
        _where_tilted(_fixed(controller={"control_roll_pitch": True})),
    ),
    Trouble(
        "six_dof_tilted",
        "roll and pitch are controlled too, and stepped by 10 and -8 deg",
        _where_tilted(
            _fixed(
                controller={"control_roll_pitch": True},
                scenario={"step.phi": 0.17, "step.theta": -0.14, "step_begin": ONSET},
            )
        ),
    ),
    Trouble("current", "0.22 m/s, constant", _fixed(scenario={"current_mean.x": 0.2, "current_mean.y": 0.1})),
    *(_varying_current(seed) for seed in (1, 2, 3)),
    Trouble(
        "arm_pull",
        "the arm pulls like a spring of 0.3 K_P towards the structure",
        lambda loop: {f"{loop.sensor}.stiffness": 0.3 * float(loop.stiffness()[0])},
    ),
    Trouble(
        "umbilical_steps",
        "pulls worth 0.1 m of PD offset from 60 s on, other ones from 90 s on",
        lambda loop: {**_pull(loop, 1, (0.1, -0.1, 0.1), ONSET), **_pull(loop, 2, (-0.2, 0.1, -0.1), ONSET + 30.0)},
    ),
    Trouble(
        "load_ramp",
        "a pull that grows to 0.15 m of PD offset in each axis from 60 s to the end",
        lambda loop: _pull(loop, 1, (0.15, -0.15, -0.15), ONSET, rise=240.0),
    ),
    Trouble(
        "picked_up",
        "a weight worth 0.3 m of PD offset, from 60 s on, mass and inertia 1.2 times what they were",
        lambda loop: {**_pull(loop, 1, (0.0, 0.0, -0.3), ONSET), **_heavier(1.2)(loop)},
    ),
    Trouble("thruster_lag", "time constant 0.3 s", _fixed(rov_plant={"thruster_time_constant": 0.3})),
    Trouble("thruster_lag_long", "time constant 1 s", _fixed(rov_plant={"thruster_time_constant": 1.0})),
    Trouble("saturation", "thrusters of 1.25 times what holding still takes", _thrust_max(1.25)),
    Trouble("overload", "thrusters of 0.8 times what holding still takes", _thrust_max(0.8)),
    Trouble(
        "dead_band",
        "no force below half the largest that holding still takes",
        lambda loop: {"rov_plant.thruster_dead_band": 0.5 * loop.thrust_at_rest()},
    ),
    Trouble("thruster_lost", "thruster 1 is dead, unknown", _fixed(rov_plant={"thruster[1].enabled": False})),
    Trouble(
        "thruster_lost_known",
        "thruster 1 is dead, and the controller knows",
        _fixed(rov_plant={"thruster[1].enabled": False}, controller={"thruster[1].enabled": False}),
    ),
    Trouble(
        "thruster_reversed",
        "thruster 1 pushes the other way, unknown",
        _scaled(*(f"rov_plant.thruster[1].d.{axis}" for axis in XYZ), by=-1.0),
    ),
    Trouble(
        "thruster_dies",
        "thruster 1 dies at 60 s, unknown",
        _fixed(scenario={"thruster[1].loss": 1.0, "thrust_loss_begin": ONSET}),
    ),
    Trouble(
        "thruster_turns",
        "thruster 1 pushes the other way from 60 s on, unknown",
        _fixed(scenario={"thruster[1].loss": 2.0, "thrust_loss_begin": ONSET}),
    ),
    Trouble(
        "wrong_mass",
        "mass and inertia 1.5 times what the gains are made for",
        _heavier(1.5),
    ),
    Trouble(
        "wrong_r_A",
        "the controller takes the arm to be at the stern",
        _scaled("controller.r_A.x", by=-1.0),
    ),
    Trouble(
        "short_r_A",
        "the controller takes the arm's lever to be a quarter",
        _scaled("controller.r_A.x", by=0.25),
    ),
    Trouble(
        "wrong_r_C",
        "the controller takes the umbilical to be at the bow",
        lambda loop: {"controller.r_C.x": loop.value("controller.r_A.x")},
    ),
    Trouble(
        "wrong_r_B",
        "the controller takes the buoyancy to be a tenth of r_A ahead of its place",
        _where_tilted(
            lambda loop: {"controller.r_B.x": loop.value("rov_plant.r_B.x") + 0.1 * loop.value("rov_plant.r_A.x")}
        ),
    ),
    Trouble("noise_2", "twice the noise: 10 mm of the arm", _noise(2.0)),
    Trouble("noise_4", "four times the noise: 20 mm of the arm", _noise(4.0)),
    Trouble("coloured_noise", "noise of 2 s correlation", _fixed(sensor={"noise_correlation_time": 2.0})),
    Trouble("bias", "the arm measures 20 mm too far in x", _fixed(sensor={"bias.x": 0.02})),
    Trouble("dropout", "one sample in ten lost", _fixed(sensor={"dropout": 0.1})),
    Trouble("dropout_half", "half the samples lost", _fixed(sensor={"dropout": 0.5})),
    Trouble(
        "slow_samples",
        "arm and controller sample every 60 ms",
        _fixed(sensor={"sample_time": 0.06}, controller={"sample_time": 0.06}),
    ),
    *(_delay(samples) for samples in range(1, LONGEST_DELAY + 1)),
    Trouble("out_of_reach", "dragged out of the arm's reach for 3 s, and back", lambda loop: _dragged_away(loop, 3.0)),
    Trouble("far_out_of_reach", "the same with pulls of 6 s", lambda loop: _dragged_away(loop, 6.0)),
    Trouble(
        "set_point_step",
        "0.3, -0.2, 0.2 m and 90 deg at once",
        _fixed(scenario={"step.x": 0.3, "step.y": -0.2, "step.z": 0.2, "step.psi": 1.5708, "step_begin": ONSET}),
    ),
    Trouble("turned_about", "turned by 195 deg about the arm's base at once", lambda loop: _turned(loop, 3.4)),
    Trouble(
        "set_point_motion",
        "sways by 0.1 m in x and z and 20 deg in yaw, 60 s",
        _fixed(scenario={"motion.x": 0.1, "motion.z": 0.1, "motion.psi": 0.35}),
    ),
)
_PAIRS = (
    ("current", "delay_5"),
    ("current", "thruster_lost"),
    ("dropout_half", "delay_3"),
    ("wrong_mass", "thruster_lag"),
    ("wrong_r_A", "umbilical_steps"),
)


def _both(first: Trouble, second: Trouble) -> Trouble:
    return Trouble(
        f"{first.name}+{second.name}", "both at once", lambda loop: {**first.values(loop), **second.values(loop)}
    )


_BY_NAME = {trouble.name: trouble for trouble in _LIST}
TROUBLES: Mapping[str, Trouble] = {
    **_BY_NAME,
    **{both.name: both for a, b in _PAIRS for both in [_both(_BY_NAME[a], _BY_NAME[b])]},
}
"""All troubles by name, in the order of the table."""
