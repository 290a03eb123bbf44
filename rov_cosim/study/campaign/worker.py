"""What a worker has and does: the systems of a campaign, their FMUs unpacked, and one run after the other."""

import gc
import tempfile
from collections.abc import Hashable, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from threading import Lock
from time import perf_counter
from typing import cast

from distributed import Worker, WorkerPlugin, get_worker

from ...master.instances import Instances
from ...ssp.wiring import Wiring
from ..scores import Score
from ..settings import Settings
from .case import Case, score_of


class Systems(WorkerPlugin):
    """The systems by key, sent to each worker once, with the content of their FMUs: a worker needs no file of ours."""

    def __init__(self, name: str, loops: Mapping[Hashable, Wiring], settings: Settings) -> None:
        self.name, self._settings = name, settings
        contents = {fmu: fmu.read_bytes() for loop in loops.values() for fmu in {e.fmu for e in loop.elements}}
        names = {fmu: f"{sha256(content).hexdigest()[:16]}.fmu" for fmu, content in contents.items()}
        self._fmus = {names[fmu]: content for fmu, content in contents.items()}
        self._loops = {key: _moved(loop, names) for key, loop in loops.items()}

    def setup(self, worker: Worker) -> None:
        """Unpack the FMUs in the worker's own folder."""
        self._stack, self._alone = ExitStack(), Lock()
        before, tempfile.tempdir = tempfile.tempdir, worker.local_directory
        try:
            folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="rov_cosim_")))
            for name, content in self._fmus.items():
                (folder / name).write_bytes(content)
            places = {Path(name): str(folder / name) for name in self._fmus}
            self._here = {key: _moved(loop, places) for key, loop in self._loops.items()}
            self._instances = self._stack.enter_context(Instances(*self._here.values()))
        finally:
            tempfile.tempdir = before
        gc.freeze()  # the descriptions of the FMUs are many objects, of which no run makes garbage

    def teardown(self, worker: Worker) -> None:
        """Remove what was unpacked."""
        self._stack.close()

    def scores(self, cases: Iterable[Case]) -> list[Score]:
        """Return the score of each run; one at a time, for the FMUs' libraries are shared by the worker's threads."""
        with self._alone:
            return [score_of(self._here[c.loop], c.changes, self._settings, self._instances) for c in cases]


def run_chunk(name: str, cases: list[Case]) -> tuple[list[Score], float]:
    """Return the scores of some runs of the `Systems` of a name, and the time in s that they took: a worker's task."""
    systems = cast(Systems, get_worker().plugins[name])
    begin = perf_counter()
    return systems.scores(cases), perf_counter() - begin


def _moved(loop: Wiring, places: Mapping[Path, str]) -> Wiring:
    return replace(loop, elements=tuple(replace(e, fmu=Path(places[e.fmu])) for e in loop.elements))
