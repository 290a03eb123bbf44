"""The benchmark's tables: what FMUs cost in both exports, the floor under each, other tools beside them, and ratios."""

import os
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from math import isnan
from pathlib import Path
from tempfile import TemporaryDirectory

from ..components.interface import SAMPLE_TIME
from ..exporters.build import components
from ..master.unpacked import unpacked
from ..ssp.declaration import System
from ..ssp.wiring import Wiring
from ..study.archives import ssp_path
from ..study.runs import opened
from . import costs, tools

STEPS = {"native": 3_000, "pythonfmu": 100}
"""Steps over which each export is measured: some hundredths of a second."""

TURNS = 20
"""Times that the native loop and what is under it are measured."""

Ways = dict[str, costs.Cost | None]

IN_C = (
    "C: traced functions, bare",
    "C: what follows from parameters done before",
    "C: the same, and the noise drawn",
    "C: native fmi2DoStep",
)
"""The labels of `costs.WAYS`."""
IN_NUMPY = "native FMUs, steps in NumPy"
DO_NOTHING = "FMUs that do nothing"

RUNS, DURATION = 1024, 60.0
"""Runs of the campaign that is measured, and the time in s that each simulates."""

EVERY = 100
IN_TURN = "all in turn"
SPARSE = f"the same, recorded every {EVERY} steps"


def report(system: System, folder: str) -> Iterator[str]:
    """Yield the lines of the tables, each as soon as it is measured; runs leave their results in the folder."""
    own = list(dict.fromkeys(system.elements.values()))
    with ExitStack() as stack:
        wirings = {export: stack.enter_context(opened(system, export=export)) for export in STEPS}
        c = costs.InC((components()[n] for n in own), Path(stack.enter_context(TemporaryDirectory())))
        in_c = {**{name: c.of(name) for name in own}, IN_TURN: c.of(*system.elements.values())}
        ours = stack.enter_context(_own_loops(wirings["native"]))
        theirs = stack.enter_context(_other_loops(wirings["native"], wirings["pythonfmu"], ssp_path(system.name)))
        best = costs.in_turns({**in_c, **ours}, TURNS) | costs.in_turns({n: way for n, way in theirs.items() if way})

        yield _row(f"a communication step of {1e3 * SAMPLE_TIME:g} ms, in us", [*own, IN_TURN])
        for place, label in enumerate(IN_C):
            yield _row(label, (f"{1e6 * best[name][place]:.2f}" for name in (*own, IN_TURN)))
        for export, steps in STEPS.items():
            for way, seconds in costs.from_python(wirings[export], steps).items():
                yield _row(f"{export}: {way}", (f"{1e6 * one:.1f}" for one in seconds))

    yield ""
    yield _row(f"{system.name}, Jacobi", ["us a step", "x real time"])
    loops = {name: cost for name, (cost, *_) in best.items()}
    for name in (*ours, *theirs):
        yield _row(name, _speed(loops.get(name), system.step_size))

    yield ""
    yield _row("command", ["wall time, s", "peak, MB"])
    simulate = ("fmpy", "simulate", str(ssp_path(system.name)), "--output-file", os.devnull)
    run = ("rov-cosim", "run", system.name, "--output", folder)
    commands = {
        f"fmpy simulate {system.name}.ssp": simulate,
        "the same for two steps: start-up": (*simulate, "--stop-time", str(2 * system.step_size)),
        **{f"rov-cosim run, {export}": (*run, "--export", export) for export in STEPS},
    }
    walls = []
    for label, words in commands.items():
        rounds = 1 if "pythonfmu" in words else costs.ROUNDS  # that takes tens of seconds: no start-up to be lucky with
        wall, memory = costs.command(*words, rounds=rounds)
        walls.append(wall)
        yield _row(label, [f"{wall:.2f}", f"{memory:.0f}"])

    yield ""
    yield _row("rov-cosim run, native: what is there after", ["wall time, s"])
    marks = {"the table": "^verdict", "the CSV": r"\.csv$", "the picture": r"\.png$"}
    for label, after in costs.milestones(marks, *run).items():
        yield _row(label, [f"{after:.2f}"])

    yield ""
    yield _row(f"rov-cosim campaign, {os.cpu_count()} workers", ["wall time, s", "ms a run"])
    each = None
    if find_spec("distributed"):
        start, whole = (_campaign(system, runs, Path(folder)) for runs in (2, RUNS))
        each = (whole - start) / (RUNS - 2)
        yield _row("2 runs: start-up, report and picture", [f"{start:.1f}"])
        yield _row(f"{RUNS} runs of {DURATION:g} s", [f"{whole:.1f}", f"{1e3 * each:.1f}"])
    else:
        yield _row(f"{RUNS} runs of {DURATION:g} s", ["not installed"])

    yield ""
    yield _row("ratio", [])
    native = loops[_of("native")]
    yield _row("pythonfmu loop : native loop", [f"{loops[_of('pythonfmu')] / native:.1f}"])
    yield _row("native loop : do-nothing loop", [f"{native / loops[DO_NOTHING]:.2f}"])
    yield _row("native loop in NumPy : in C", [f"{loops[IN_NUMPY] / native:.2f}"])
    for label, floor in zip(
        ("traced functions", "the same, prepared", "the same, and noise"), best[IN_TURN], strict=False
    ):
        yield _row(f"native loop : {label}, in turn", [f"{native / floor:.2f}"])
        yield _row(f"    recorded every {EVERY} steps", [f"{loops[SPARSE] / floor:.2f}"])
    for name in own:
        bare, *_, fmi = best[name]
        yield _row(f"fmi2DoStep of {name} : traced functions", [f"{fmi / bare:.2f}", f"+ {1e9 * (fmi - bare):.0f} ns"])
    yield _row("start-up : fmpy simulate", [f"{walls[1] / walls[0]:.2f}"])
    if each is not None:
        stepping = DURATION / system.step_size * native / (os.cpu_count() or 1)
        yield _row("a campaign's run : its steps, on all cores", [f"{each / stepping:.2f}"])


def _campaign(system: System, runs: int, folder: Path) -> float:
    """Return the wall time in s of a campaign of so many runs, of gains drawn at random."""
    file = folder / f"gains_{runs}.toml"
    gains = "".join(
        f'"controller.K_P.{axis}" = {{ distribution = "uniform", loc = 60.0, scale = 40.0 }}\n' for axis in "xyz"
    )
    file.write_text(
        f'system = "{system.name}"\nruns = {runs}\nseed = 1\nstop_time = {DURATION}\n[vary]\n{gains}', encoding="utf-8"
    )
    return costs.command("rov-cosim", "campaign", str(file), "--fresh", "--output", str(folder), rounds=1)[0]


@contextmanager
def _own_loops(wiring: Wiring) -> Iterator[dict[str, costs.Cost]]:
    """Yield what measures the native loop and its floor in this master, by the label of its row."""
    with unpacked(wiring) as folders, costs.idle(wiring) as idle:
        yield {
            _of("native"): costs.in_loop(wiring, folders, STEPS["native"]),
            SPARSE: costs.in_loop(wiring, folders, STEPS["native"], every=EVERY),
            DO_NOTHING: costs.in_loop(wiring, idle, STEPS["native"]),
            IN_NUMPY: costs.in_loop(wiring, folders, STEPS["native"], in_numpy=True),
        }


@contextmanager
def _other_loops(wiring: Wiring, python: Wiring, archive: Path) -> Iterator[Ways]:
    """Yield the same for the loop in other exports, as one FMU, and in other tools; None where one is not installed."""
    with ExitStack() as stack:

        def in_this(one: Wiring, steps: int) -> costs.Cost:
            return costs.in_loop(one, stack.enter_context(unpacked(one)), steps)

        ways: Ways = {_of("pythonfmu"): in_this(python, STEPS["pythonfmu"])}
        for name, one in stack.enter_context(tools.as_one_fmu(wiring, archive)).items():
            ways[f"{name} in this master"] = in_this(one, STEPS["native"]) if one else None
        yield ways | tools.costs_of(archive, STEPS["native"])


def _of(export: str) -> str:
    return f"{export} FMUs in this master"


def _speed(seconds: float | None, step_size: float) -> list[str]:
    if seconds is None:
        return ["not installed"]
    return ["failed"] if isnan(seconds) else [f"{1e6 * seconds:.1f}", f"{step_size / seconds:.0f}"]


def _row(label: str, cells: Iterable[str]) -> str:
    return f"{label:46}" + "".join(f"{cell:>13}" for cell in cells)
