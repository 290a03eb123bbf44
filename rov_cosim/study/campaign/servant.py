"""A process that loads what workers need while this one loads what it needs itself, and from which they are forked."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import forkserver, get_all_start_methods, resource_tracker

METHOD = "forkserver" if "forkserver" in get_all_start_methods() else "spawn"
"""How workers begin."""


def begin() -> None:
    """Begin to load; where processes are not forked, and where one has begun already, nothing happens."""
    if METHOD == "forkserver":
        with interrupts_blocked():
            forkserver.set_forkserver_preload(["distributed", f"{__package__}.worker"])
            forkserver.ensure_running()


@contextmanager
def interrupts_blocked() -> Iterator[None]:
    """Hold Ctrl-C back; threads and processes that begin meanwhile are never told of it: it is this one's to answer."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    resource_tracker.ensure_running()  # else it starts with the first process, and lets the interrupts in again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
