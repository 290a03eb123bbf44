"""Experiments: runs that figures and claims are read off, each with the command that repeats it."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..components.interface import POSE
from ..control.certificate import Certificate
from ..ssp.declaration import wire
from ..ssp.values import Value
from ..ssp.wiring import Wiring
from ..study.assessment import AXES, SETTLED, errors, in_hold, settling
from ..study.changes import Changes
from ..study.looped import loop_of
from ..study.runs import Run, simulated
from ..study.scores import Score
from ..study.settings import Settings
from ..systems.catalogue import SYSTEMS

Series = NDArray[np.float64]

SHOWN = [0, 1, 2, 5]
"""The paper's axes, x, y, z and yaw, among the six."""


class ExperimentError(RuntimeError):
    """An experiment did not run to its end."""


@cache
def _wired(system: str) -> Wiring:
    """Return a system, its FMUs built, as they were when it was first asked for."""
    return wire(SYSTEMS[system])


@dataclass(frozen=True)
class Experiment:
    """A system of this project, what differs from it, and what comes out; it runs once, when it is first asked.

    Parameters
    ----------
    system : its name.
    values : other start values, by ``element.variable``.
    stop_time : in s; the system's own if left out.
    coupling : "gauss-seidel", the paper's loop: measure at t_k, command at t_k; or "jacobi".
    """

    system: str
    values: Mapping[str, Value] = field(default_factory=dict)
    stop_time: float | None = None
    coupling: str = "gauss-seidel"

    def with_values(self, values: Mapping[str, Value]) -> "Experiment":
        """Return the experiment with further start values, by ``element.variable``."""
        return replace(self, values={**self.values, **values})

    def over(self, stop_time: float) -> "Experiment":
        """Return the experiment with another stop time in s."""
        return replace(self, stop_time=stop_time)

    @property
    def command(self) -> str:
        """What repeats the run in a shell."""
        words = ["rov-cosim", "run", self.system]
        for end, value in self.values.items():
            words += ["--set", f"{end}={str(value).lower() if isinstance(value, bool) else value}"]
        words += [] if self.stop_time is None else ["--stop-time", f"{self.stop_time:g}"]
        words += [] if self.coupling == Settings.coupling else ["--coupling", self.coupling]
        return shlex.join(words)

    @cached_property
    def run(self) -> Run:
        """The run.

        Raises
        ------
        BuildError : an FMU cannot be built.
        WiringError : a value is wrong.
        ExperimentError : it failed.
        """
        settings = Settings(self.coupling, stop_time=self.stop_time)
        done = simulated(self._wiring, settings, progress=lambda steps: steps)
        if done.failure:
            raise ExperimentError(f"{self.command}: {done.failure}")
        return done

    @cached_property
    def certificate(self) -> Certificate:
        """The loop, linearised, and the theorem's conditions of its gains."""
        return Certificate(self._wiring.name, loop_of(self._wiring))

    @property
    def _wiring(self) -> Wiring:
        return Changes(values=self.values).applied(_wired(self.system))

    @property
    def certify(self) -> str:
        """The command that shows `certificate`."""
        words = [f"--set {end}={value}" for end, value in self.values.items()]
        return " ".join(["rov-cosim", "certify", self.system, *words])

    @property
    def time(self) -> Series:
        """Times in s, shape (rows,)."""
        return self["time"]

    def __getitem__(self, name: str) -> Series:
        found: Series = self.run.results[name]
        return found

    def group(self, name: str, labels: tuple[str, ...]) -> Series:
        """Return the outputs ``name.label``, shape (rows, len(labels))."""
        return np.stack([self[f"{name}.{label}"] for label in labels], axis=1)

    def value(self, end: str) -> float:
        """Return a start value of the run."""
        value: Any = self.run.wiring.value(end)
        return float(value)

    @cached_property
    def errors(self) -> Series:
        """Pose less set-point, shape (rows, 6), in m and rad."""
        return errors(self.run.results, self.run.wiring)

    @property
    def held(self) -> Series:
        """The errors of the hold, the last fifth of the run."""
        return self.errors[in_hold(self.run.results)]

    @property
    def score(self) -> Score:
        """How well it held."""
        score = self.run.score
        assert score is not None
        return score

    def settles(self, axis: str, to: float = 0.0, within: float | None = None) -> float:
        """Return the time in s after which an axis stays within a limit of a value, inf if it does not.

        The limit is that of `assessment.SETTLED` if left out.
        """
        error = self.errors[:, POSE.index(axis)] - to
        found = settling(self.time, error, SETTLED[axis] if within is None else within)
        return np.inf if found is None else found

    def settles_at_its_end(self) -> float:
        """Return the time in s after which all axes stay within `assessment.SETTLED` of where they end."""
        return max(self.settles(axis, to=float(self.errors[-1, POSE.index(axis)])) for axis in AXES)


SIMULATION = Experiment("paper_simulation")
SIMULATION_PD = Experiment("paper_simulation_pd")
EXPERIMENT = Experiment("station_keeping")
EXPERIMENT_PD = Experiment("station_keeping_pd")
