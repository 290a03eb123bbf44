"""Ctrl-C and the order to terminate, held back while an FMU steps."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from threading import current_thread, main_thread

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def terminate_as_interrupted() -> None:
    """Let an order to terminate be answered as Ctrl-C is, so that what was begun is kept and cleared up."""
    if current_thread() is main_thread() and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, signal.default_int_handler)


@contextmanager
def deferred() -> Iterator[list[int]]:
    """Yield a list that these signals fill: raised within a step, they would break an FMU that runs Python.

    A second one is not held back, for the user whose step does not end. Those that the process ignores, or leaves to
    the system, stay as they are.
    """
    received: list[int] = []
    # Signals go to the main thread.
    before = {s: signal.getsignal(s) for s in _SIGNALS if current_thread() is main_thread()}
    before = {s: handler for s, handler in before.items() if handler not in (signal.SIG_IGN, signal.SIG_DFL, None)}

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    def receive(number: int, frame: object) -> None:
        received.append(number)
        restore()

    for number in before:
        signal.signal(number, receive)
    try:
        yield received
    finally:
        restore()
