"""Measurements of what FMUs cost: in C, called from Python, in the master's loop, and as whole commands."""

import ctypes
import math
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from importlib.resources import files
from itertools import count, islice
from pathlib import Path
from time import perf_counter, process_time

from ..components.interface import SAMPLE_TIME, Component, Continuous
from ..exporters import native_export, zig
from ..master.exchange import InPython, Steps, jacobi
from ..master.instances import Instances
from ..master.memory import Watch
from ..master.simulation import initialize, simulate
from ..master.slave import Slave
from ..master.unpacked import Folders
from ..ssp.wiring import Wiring

ROUNDS = 3
"""Times that a measurement is repeated; the quickest counts, for other work on the machine only ever slows it down."""

WAYS = ("traced", "prepared", "drawn", "through_fmi")
"""Ways to step a component in C, as benchmark.c has them."""

_LAUNCH = """
import resource, subprocess, sys, time
begin = time.perf_counter()
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)
print(time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""

Cost = Callable[[], tuple[float, ...]]
"""Measures once what a communication step costs in s; several costs where one program tells them all."""


def in_turns(ways: Mapping[str, Cost], rounds: int = ROUNDS) -> dict[str, tuple[float, ...]]:
    """Return the least costs by way, the ways measured in turns, so that a busy moment falls on all of them."""
    best: dict[str, tuple[float, ...]] = {}
    for _ in range(rounds):
        for name, measured in ways.items():
            costs = measured()
            best[name] = tuple(map(min, costs, best.get(name, costs)))
    return best


class InC:
    """Measures components in C: their steps taken in turn, alone in a loop, by one of `WAYS`."""

    def __init__(self, own: Iterable[Component], folder: Path) -> None:
        self._folder = folder
        self._in_turn = self._loaded("in_turn", {"in_turn.c": _source("in_turn.c")}).in_turn
        self._in_turn.restype = ctypes.c_double
        self._in_turn.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_size_t)
        self._libraries = {c.name: self._loaded(c.name, _timed(c)) for c in own}

    def of(self, *names: str, steps: int = 5000) -> Cost:
        """Return what measures components: a number for each of `WAYS`. Few steps, for it is called many times."""
        libraries = [self._libraries[name] for name in names]

        def measured() -> tuple[float, ...]:
            taken = []
            for way in WAYS:
                for library in libraries:
                    library.begin()
                functions = [ctypes.cast(library[way], ctypes.c_void_p) for library in libraries]
                taken.append(self._in_turn((ctypes.c_void_p * len(names))(*functions), len(names), steps))
            assert min(taken) > 0
            return tuple(taken)

        return measured

    def _loaded(self, name: str, sources: Mapping[str, bytes]) -> ctypes.CDLL:
        platform = zig.host_platform()
        path = self._folder / f"{name}{zig.SUFFIXES[platform]}"
        path.write_bytes(zig.shared_library(name, sources, platform))
        return ctypes.CDLL(str(path))


def _timed(component: Component) -> dict[str, bytes]:
    source = _source("benchmark.c")
    if isinstance(component, Continuous):
        internal = component.p.start[component.p.names.index(component.max_step)]
        source = f"#define INTERNAL_STEPS {round(SAMPLE_TIME / internal)}\n".encode() + source
    return {**native_export.sources(component), "benchmark.c": source}


def in_loop(wiring: Wiring, folders: Folders, steps: int, every: int = 1, in_numpy: bool = False) -> Cost:
    """Return what measures the Jacobi master, its steps in C or in NumPy, with FMUs from some folders.

    It records all outputs after every so many steps.
    """

    def measured() -> tuple[float, ...]:
        taken = []

        def stopwatch(numbers: Iterable[int]) -> Iterator[int]:
            begin = process_time()
            yield from numbers
            taken.append(process_time() - begin)

        stop_time = wiring.start_time + steps * wiring.step_size
        with Instances(folders=folders) as instances:
            simulate(
                wiring,
                stop_time=stop_time,
                progress=stopwatch,
                instances=instances,
                output_interval=every * wiring.step_size,
                in_numpy=in_numpy,
            )
        return (taken[0] / steps,)

    return measured


def from_python(wiring: Wiring, steps: int) -> dict[str, list[float]]:
    """Return by way of calling what a communication step costs in s, a number for each FMU."""
    costs: dict[str, list[float]] = {}
    with Instances(wiring) as instances:
        exchange = instances.exchange(wiring, (), lambda message: None)
        loop = InPython(exchange, Steps(jacobi, wiring.start_time, wiring.step_size, True), Watch())
        initialize(exchange, loop, wiring.start_time)
        for slave in exchange.slaves:
            time = count(0)
            for way, step in _ways(slave).items():
                costs.setdefault(way, []).append(
                    min(_seconds(step, wiring, time, steps) for _ in range(ROUNDS)) / steps
                )
    return costs


@contextmanager
def idle(wiring: Wiring) -> Iterator[Folders]:
    """Yield folders of FMUs in place of the system's own that have the same variables and do nothing."""
    sources = {"idle.c": _source("idle.c")}
    platform = zig.host_platform()
    with ExitStack() as stack:
        folders = {}
        for element in wiring.elements:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
            name = element.description.coSimulation.modelIdentifier
            (folder / "binaries" / platform).mkdir(parents=True)
            library = folder / "binaries" / platform / f"{name}{zig.SUFFIXES[platform]}"
            library.write_bytes(zig.shared_library(name, sources, platform))
            folders[element.name, element.fmu] = folder
        yield folders


def command(*words: str, rounds: int = ROUNDS) -> tuple[float, float]:
    """Return the wall time in s and the peak memory in MB of a command of this environment."""
    program = Path(sys.executable).with_name(words[0])
    # By a small process between, for a child's peak begins with the memory of what started it.
    launched = [sys.executable, "-c", _LAUNCH, str(program), *words[1:]]
    costs = []
    for _ in range(rounds):
        printed = subprocess.run(launched, capture_output=True, encoding="utf-8", check=True).stdout.split()
        costs.append((float(printed[0]), float(printed[1]) / (1024**2 if sys.platform == "darwin" else 1024)))
    return min(costs)


def milestones(marks: Mapping[str, str], *words: str) -> dict[str, float]:
    """Return after how many seconds a command of this environment has printed a line, for patterns by name."""
    found = dict.fromkeys(marks, math.inf)
    for _ in range(ROUNDS):
        begin = perf_counter()
        program = str(Path(sys.executable).with_name(words[0]))
        with subprocess.Popen([program, *words[1:]], stdout=subprocess.PIPE, encoding="utf-8") as running:
            assert running.stdout
            for line in running.stdout:
                for name, pattern in marks.items():
                    if re.search(pattern, line):
                        found[name] = min(found[name], perf_counter() - begin)
    return found


def _source(name: str) -> bytes:
    return (files(__package__) / name).read_bytes()


def _ways(slave: Slave) -> dict[str, Callable[[float, float], None]]:
    """Return the ways to take a step of an FMU from Python."""
    references = {name: variable.valueReference for name, variable in slave.element.variables.items()}
    inputs = [(t, [references[n] for n in block.names], block.values.tolist()) for t, block in slave.inputs.items()]
    outputs = [(t, [references[n] for n in block.names]) for t, block in slave.outputs.items()]

    def arrays(time: float, step: float) -> None:
        slave.write()
        slave.step(time, step)
        slave.read()

    def lists(time: float, step: float) -> None:
        for type_, read, values in inputs:
            getattr(slave.fmu, f"set{type_}")(read, values)
        slave.fmu.doStep(time, step)
        for type_, read in outputs:
            getattr(slave.fmu, f"get{type_}")(read)

    return {"doStep": slave.step, "set, doStep, get by own arrays": arrays, "set, doStep, get by FMPy's lists": lists}


def _seconds(step: Callable[[float, float], None], wiring: Wiring, numbers: Iterator[int], steps: int) -> float:
    begin = process_time()
    for n in islice(numbers, steps):
        step(wiring.start_time + n * wiring.step_size, wiring.step_size)
    return process_time() - begin
