"""Runs on Dask's workers, in chunks: what comes back is scored, and a worker that dies costs the run that killed it."""

import logging
from collections import deque
from collections.abc import Callable, Generator, Hashable, Iterable, Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import ExitStack, contextmanager, suppress
from tempfile import TemporaryDirectory
from typing import Any
from uuid import uuid4

import dask
from distributed import Client, Future, LocalCluster, as_completed
from distributed.scheduler import KilledWorker

from ...master.interrupts import deferred
from ...ssp.wiring import Wiring
from ..scores import Score
from ..settings import Settings
from . import servant
from .case import Case
from .errors import CampaignError
from .worker import Systems, run_chunk

DIED = "an FMU ended the process that ran it"
CHUNK = 1.0
"""Time in s that a chunk of runs takes, about: the way to a worker and back, and to the disk, takes some 10 ms."""
MOST = 200
"""Runs of a chunk."""
UNWATCHED = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "10s",
}
"""What Dask is told not to measure, which takes a tenth of the time, for a page that is not shown."""
HOPELESS = 8
"""Runs in a row that may end their process before any is scored."""


def run_all(
    loops: Mapping[Hashable, Wiring],
    case: Callable[[int], Case],
    todo: Iterable[int],
    jobs: int,
    scheduler: str = "",
    settings: Settings | None = None,
    any_done: bool = False,
) -> Generator[dict[int, Score], None, None]:
    """Yield the scores of runs by number, chunk by chunk as they come.

    Parameters
    ----------
    loops : the systems.
    case : what the run of a number is.
    todo : the numbers.
    jobs : processes on this machine, unless there is a scheduler.
    scheduler : the address of the scheduler of a Dask cluster.
    settings : how a run is taken; always in the worker's own process.
    any_done : whether others of them have been run before, without the death of a worker.

    Raises
    ------
    CampaignError : the cluster cannot be used, or no run leaves its process alive.
    """
    systems = Systems(f"rov-cosim-{uuid4().hex}", loops, settings or Settings())
    with _client(jobs, scheduler) as client:
        client.register_plugin(systems)
        try:
            yield from _Dispatch(client, systems.name, case, todo, any_done).scores()
        except (OSError, CancelledError) as error:
            raise CampaignError(f"The Dask scheduler is lost: {error}.") from None
        finally:
            if scheduler:
                with suppress(OSError, CancelledError):
                    client.unregister_worker_plugin(systems.name)


class _Dispatch:
    """Hands chunks out, and takes them in; the runs of a chunk whose worker died are tried again, each alone."""

    def __init__(
        self, client: Client, name: str, case: Callable[[int], Case], todo: Iterable[int], any_done: bool
    ) -> None:
        self._client, self._name, self._case = client, name, case
        self._waiting, self._suspects = deque(todo), deque[int]()
        self._flying: dict[Future[Any], list[int]] = {}
        self._pace = CHUNK  # time in s of a run, by the chunk that came last: the first run of a worker takes longer
        self._any_done, self._deaths = any_done, 0
        self._landed = as_completed(loop=client.loop)

    def scores(self) -> Iterator[dict[int, Score]]:
        while self._waiting or self._flying or self._suspects:
            places = sum(self._client.nthreads().values())
            while self._waiting and len(self._flying) < 2 * max(places, 1):
                share = -(-len(self._waiting) // (2 * max(places, 1)))  # so that all workers end at about one time
                size = min(max(int(CHUNK / self._pace), 1), MOST, share)
                self._submit([self._waiting.popleft() for _ in range(size)])
            if alone := not self._flying:
                self._submit([self._suspects.popleft()])
            future = next(self._landed)
            if found := self._taken(future, self._flying.pop(future), alone):
                yield found

    def _submit(self, runs: list[int]) -> None:
        future = self._client.submit(run_chunk, self._name, [self._case(run) for run in runs], pure=False)
        self._flying[future] = runs
        self._landed.add(future)

    def _taken(self, future: Future[Any], runs: list[int], alone: bool) -> dict[int, Score]:
        try:
            scores, seconds = future.result()
        except KilledWorker:
            if not alone:  # it may be another's fault: a task that waited at the worker is lost with it
                self._suspects.extend(runs)
                return {}
            self._deaths += 1
            if self._deaths == HOPELESS and not self._any_done:
                raise CampaignError(f"The first {HOPELESS} runs ended their process, each: an FMU crashes.") from None
            return {runs[0]: Score("lost", reason=DIED)}
        self._any_done, self._pace = True, seconds / len(runs)
        return dict(zip(runs, scores, strict=True))


@contextmanager
def _client(jobs: int, scheduler: str) -> Iterator[Client]:
    # What is lost is told in a line of ours. A cluster silences its own until it is closed, and some speaks later.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with ExitStack() as stack:
        if scheduler:
            try:
                client = stack.enter_context(Client(scheduler, timeout="10s", set_as_default=False))
            except (OSError, ValueError) as error:
                raise CampaignError(f"There is no Dask scheduler at {scheduler}: {error}") from None
            if not client.nthreads():
                raise CampaignError(f"The scheduler at {scheduler} has no workers: start some, as the README says.")
        else:
            folder = stack.enter_context(TemporaryDirectory(prefix="rov_cosim_", ignore_cleanup_errors=True))
            how = {"temporary-directory": folder, "distributed.worker.multiprocessing-method": servant.method()}
            stack.enter_context(dask.config.set({**how, **UNWATCHED}))  # nothing of it is taken from elsewhere
            servant.begin()
            with servant.interrupts_blocked(), deferred() as interrupted:  # half a cluster could not be closed
                cluster = stack.enter_context(_local(jobs))
                client = stack.enter_context(Client(cluster, set_as_default=False))
            if interrupted:
                raise KeyboardInterrupt
        yield client


def _local(jobs: int) -> LocalCluster:
    return LocalCluster(
        n_workers=jobs,
        threads_per_worker=1,
        memory_limit=0,  # a worker ended for its memory would look like one that an FMU ended
        silence_logs=logging.CRITICAL,
        scheduler_kwargs={"allowed_failures": 0, "dashboard": False, "dashboard_address": "localhost:0"},
    )
