"""What a run costs: wall time by FMU and in all, and how much faster than real time it is."""

from collections.abc import Callable
from time import perf_counter
from typing import Any

from . import master
from .wiring import Wiring


def measure(wiring: Wiring, stop_time: float) -> str:
    """Simulate the system by the Jacobi master and return a table of times."""
    spent: dict[str, float] = {element.name: 0.0 for element in wiring.elements}
    n_steps = 0

    def timed(loop: master.Loop, time: float, step: float) -> None:
        nonlocal n_steps
        n_steps += 1
        for slave in loop.slaves:
            loop.feed(slave)
        for slave in loop.slaves:
            spent[slave.element.name] += _duration(slave.step, time, step)
        for slave in loop.slaves:
            slave.read()

    total = _duration(master.simulate, wiring, timed, stop_time)
    lines = [f"{wiring.name}: {n_steps} steps of {wiring.step_size:g} s"]
    lines += [f"  doStep of {name:12} {1e6 * time / n_steps:9.1f} us a step" for name, time in spent.items()]
    rest = total - sum(spent.values())
    lines.append(f"  all else            {1e6 * rest / n_steps:9.1f} us a step, start-up included")
    lines.append(
        f"  wall time           {total:9.2f} s, {n_steps * wiring.step_size / total:.1f} times faster than real time"
    )
    return "\n".join(lines)


def _duration(function: Callable[..., Any], *arguments: Any) -> float:
    begin = perf_counter()
    function(*arguments)
    return perf_counter() - begin
