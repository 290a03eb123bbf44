"""What the paper leaves open, what is taken here instead, and how much it matters: each varied, by runs."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ..components.vehicle import FORCES
from ..ssp.values import Value
from ..study.assessment import AXES
from .experiment import EXPERIMENT, EXPERIMENT_PD, SIMULATION, Experiment


@dataclass(frozen=True)
class Inferred:
    """Something left open: what, what is taken, why, what other values give, and a command that gives one of these."""

    what: str
    taken: str
    why: str
    sensitivity: str
    command: str


def inferred() -> list[Inferred]:
    """Return all of it.

    Raises
    ------
    ExperimentError : a run failed.
    """
    return [*_of_the_simulation(), *_of_the_experiment()]


def _of_the_simulation() -> Iterator[Inferred]:
    runs = {
        f"{gamma:g} I": SIMULATION.with_values({f"controller.Gamma.{force}": gamma for force in FORCES})
        for gamma in (20.0, 40.0, 50.0)
    }
    yield Inferred(
        "Gamma of the simulation",
        "40 I",
        "x, y and z then enter 20 mm after the paper's 30 s",
        _listed(runs, _settling),
        _last(runs).command,
    )
    runs = {
        f"{lever:g} m": SIMULATION.with_values(
            {f"{element}.r_A.x": lever for element in ("rov_plant", "controller", "passive_arm")}
        )
        for lever in (0.3, 0.4, 0.5)
    }
    yield Inferred(
        "Lever arm r_A of the arm's force",
        "0.4 m ahead",
        "half the vehicle's length",
        f"yaw left at 60 s: {_listed(runs, lambda run: f'{np.degrees(run.errors[-1, 5]):.2f} deg')}",
        _last(runs).command,
    )


def _of_the_experiment() -> Iterator[Inferred]:
    runs = {f"{dB:g} N": EXPERIMENT.with_values({"rov_plant.dB": dB}) for dB in (7.0, 17.0, 27.0)}
    yield Inferred(
        "Excess buoyancy of the experiment",
        "17 N",
        "z rises, as in fig. 11; a rise to its 0.3 m would take longer to end than 25 s",
        _listed(runs, lambda run: f"rise {run.errors[:, 2].max():.2f} m, z within 50 mm {_until(run, 'z', 0.05)}"),
        _last(runs).command,
    )
    turned = {"rov_plant.F_C.x": -EXPERIMENT.value("rov_plant.F_C.x")}
    runs = {"PD": EXPERIMENT_PD.with_values(turned), "adaptive PD": EXPERIMENT.with_values(turned)}
    yield Inferred(
        "Sign of the force along x",
        "+2.5 N",
        "fig. 9 goes from -0.04 to 0.02 m: adaptive PD stays in it so, PD would with the other sign",
        "with -2.5 N x ranges " + _listed(runs, _range_of_x),
        runs["PD"].command,
    )
    runs = {
        f"{T_f:g} s": EXPERIMENT.with_values({"controller.filter_time_constant": T_f}) for T_f in (0.05, 0.1, 0.2, 0.4)
    }
    yield Inferred(
        "Time constant T_f of the lead filter",
        "0.1 s",
        "a few samples; noise and lag are both small",
        _listed(
            runs,
            lambda run: (
                f"{run.score.verdict}, rms {1e3 * (run.score.rms or 0):.1f} mm, "
                f"thrust moves by {run.score.chattering or 0:.0f} N/s"
            ),
        ),
        _last(runs).command,
    )
    runs = {f"{1e3 * std:g} mm": EXPERIMENT.with_values({"passive_arm.noise_std": std}) for std in (0.0, 0.005, 0.01)}
    yield Inferred(
        "Nature of the arm's error of 5 mm",
        "white noise, 5 mm an axis",
        "the paper names the order alone",
        f"worst error in hold: {_listed(runs, lambda run: f'{1e3 * (run.score.worst or 0):.1f} mm')}",
        _last(runs).command,
    )
    seeds = {str(seed): EXPERIMENT.with_values({"passive_arm.seed": seed}) for seed in (1, 2, 3)}
    yield Inferred(
        "Noise",
        "seed 1",
        "any will do",
        f"z within 20 mm: {_listed(seeds, lambda run: _until(run, 'z', 0.02))}",
        _last(seeds).command,
    )
    place: dict[str, Value] = {"passive_arm.attachment.x": 0.9, "passive_arm.attachment.z": 0.2}
    moved = EXPERIMENT.with_values(place)
    change = np.abs(moved.errors - EXPERIMENT.errors)[:, :3].max()
    yield Inferred(
        "Where the arm is fixed",
        "(0.7, 0.5, 0.4) m",
        "in reach from the start",
        f"at (0.9, 0.5, 0.2) m the pose differs by {1e3 * change:.2g} mm at most: the encoders round otherwise",
        moved.command,
    )
    late = Experiment(EXPERIMENT.system, coupling="jacobi")
    change = np.abs(late.errors - EXPERIMENT.errors)[:, :3]
    yield Inferred(
        "Delays between arm, controller and thrusters",
        "none: measure and command at t_k",
        "the paper's loop",
        f"with a step of delay each the pose differs by {1e3 * change.max():.0f} mm at most, "
        f"{1e3 * change[late.time > 60].max():.1f} mm after 60 s",
        late.command,
    )


def _settling(run: Experiment) -> str:
    return f"{max(run.settles(axis) for axis in AXES if axis != 'psi'):.0f} s"


def _until(run: Experiment, axis: str, within: float) -> str:
    """Return after which time an axis stays within a limit."""
    time = run.settles(axis, within=within)
    return f"after {time:.0f} s" if np.isfinite(time) else "not in this run"


def _range_of_x(run: Experiment) -> str:
    x = run.errors[:, 0]
    return f"{x.min():.3f} to {x.max():.3f} m"


def _listed(runs: dict[str, Experiment], told: Callable[[Experiment], str]) -> str:
    return "; ".join(f"{label}: {told(run)}" for label, run in runs.items())


def _last(runs: dict[str, Experiment]) -> Experiment:
    return next(reversed(runs.values()))
