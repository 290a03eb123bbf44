"""One run of a campaign, and its score."""

from collections.abc import Hashable
from typing import NamedTuple

from ...master.instances import Instances
from ...ssp.wiring import Wiring, WiringError
from ..changes import Changes
from ..runs import simulated
from ..scores import Score, outputs_scored
from ..settings import Settings


class Case(NamedTuple):
    """A run: which of the systems, and the changes in it."""

    loop: Hashable
    changes: Changes


def score_of(
    wiring: Wiring, changes: Changes, settings: Settings | None = None, instances: Instances | None = None
) -> Score:
    """Return the score of a system with changes in it; one that cannot run is lost. Arguments as in `simulated`."""
    try:
        changed = changes.applied(wiring)
        kept = outputs_scored(changed)
        done = simulated(changed, settings, progress=lambda steps: steps, instances=instances, recorded=kept)
    except WiringError as error:
        return Score("lost", reason=str(error))
    return done.score or Score("lost", reason="There is no vehicle with a pose eta in it.")
