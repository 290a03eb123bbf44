"""A process that loads what workers need while this one loads what it needs itself, and from which they are forked."""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import forkserver, get_all_start_methods, resource_tracker
from tempfile import gettempdir

_LONGEST = 100 - len("/pymp-12345678/listener-12345678")
"""Characters of the temporary folder that leave room for the socket by which the process is asked: 104 on macOS."""


def method() -> str:
    """Return how workers begin."""
    can = "forkserver" in get_all_start_methods() and len(os.fsencode(gettempdir())) <= _LONGEST
    return "forkserver" if can else "spawn"


def begin() -> None:
    """Begin to load; where processes are not forked, and where one has begun already, nothing happens."""
    if method() == "forkserver":
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
