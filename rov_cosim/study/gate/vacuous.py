"""What tells a test of station keeping that tests nothing: the same run with the controller's outputs led nowhere."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...components.interface import POSE
from ...errors import UserError
from ...ssp.wiring import Wiring
from ..assessment import AXES, SETTLED, controller_of, pose
from ..runs import simulated
from ..scores import Score
from ..settings import Settings

UNHELD = "vacuous: it passes without the controller too."
NO_LOAD = "vacuous: no load acts, in no trouble: without the controller the vehicle stays where it begins."


class Free(NamedTuple):
    """How a vehicle did that nobody holds, and whether it stays where it begins, within `assessment.SETTLED`."""

    score: Score
    stays: bool


def uncontrolled(wiring: Wiring, settings: Settings) -> Free:
    """Run a system whose controller is there, but has no say."""
    try:
        done = simulated(released(wiring), settings, progress=lambda steps: steps)
    except UserError as error:
        return Free(Score("lost", reason=str(error)), stays=False)
    score = done.score
    if done.failure or score is None:
        return Free(score or Score("lost"), stays=False)
    way = pose(done.results, wiring)
    moved = np.abs(way - way[:, :1]).max(axis=1)
    return Free(score, all(moved[POSE.index(axis)] <= SETTLED[axis] for axis in AXES))


def released(wiring: Wiring) -> Wiring:
    """Return a system in which what the controller puts out goes nowhere: its receivers have their start values."""
    controller = controller_of(wiring)
    return replace(wiring, links=tuple(link for link in wiring.links if link.source.element != controller))
