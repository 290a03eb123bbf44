"""The benchmark's tables: what FMUs cost in both exports, the floor under each, and their ratios."""

import os
from collections.abc import Iterable, Iterator

from ..components.interface import SAMPLE_TIME
from ..exporters.build import components
from ..master.unpacked import unpacked
from ..ssp.declaration import System
from ..study.archives import ssp_path
from ..study.runs import opened
from . import costs

STEPS = {"native": 10_000, "pythonfmu": 100}
"""Steps over which each export is measured: some hundredths of a second at least."""

IN_NUMPY = "native FMUs, steps in NumPy"
DO_NOTHING = "FMUs that do nothing"


def report(system: System, folder: str) -> Iterator[str]:
    """Yield the lines of the tables, each as soon as it is measured; runs leave their results in the folder."""
    own = system.elements.values()
    yield _row(f"a communication step of {1e3 * SAMPLE_TIME:g} ms, in us", own)
    in_c = {name: costs.in_c(components()[name]) for name in own}
    yield _row("C: traced function, bare", (f"{1e6 * bare:.2f}" for bare, _ in in_c.values()))
    yield _row("C: native fmi2DoStep", (f"{1e6 * fmi:.2f}" for _, fmi in in_c.values()))
    loops: dict[str, float] = {}
    for export, steps in STEPS.items():
        with opened(system, export=export) as wiring:
            for way, seconds in costs.from_python(wiring, steps).items():
                yield _row(f"{export}: {way}", (f"{1e6 * one:.1f}" for one in seconds))
            with costs.idle(wiring) as idle, unpacked(wiring) as folders:
                compared = {export: (folders, False)}
                if export == "native":
                    compared |= {DO_NOTHING: (idle, False), IN_NUMPY: (folders, True)}
                loops |= costs.loops(wiring, compared, steps)

    yield ""
    yield _row(f"{system.name} in the Jacobi master", ["us a step", "x real time"])
    for label, seconds_a_step in loops.items():
        yield _row(
            f"{label} FMUs" if label in STEPS else label,
            [f"{1e6 * seconds_a_step:.1f}", f"{system.step_size / seconds_a_step:.0f}"],
        )

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
        wall, memory = costs.command(*words)
        walls.append(wall)
        yield _row(label, [f"{wall:.2f}", f"{memory:.0f}"])

    yield ""
    yield _row("rov-cosim run, native: what is there after", ["wall time, s"])
    marks = {"the table": "^verdict", "the CSV": r"\.csv$", "the picture": r"\.png$"}
    for label, after in costs.milestones(marks, *run).items():
        yield _row(label, [f"{after:.2f}"])

    yield ""
    yield _row("ratio", [])
    yield _row("pythonfmu loop : native loop", [f"{loops['pythonfmu'] / loops['native']:.1f}"])
    yield _row("native loop : do-nothing loop", [f"{loops['native'] / loops[DO_NOTHING]:.2f}"])
    yield _row("native loop in NumPy : in C", [f"{loops[IN_NUMPY] / loops['native']:.2f}"])
    bare_loop = sum(bare for bare, _ in in_c.values())
    yield _row("native loop : bare functions", [f"{loops['native'] / bare_loop:.2f}"])
    for name, (bare, fmi) in in_c.items():
        yield _row(f"fmi2DoStep of {name} : bare function", [f"{fmi / bare:.2f}", f"+ {1e9 * (fmi - bare):.0f} ns"])
    yield _row("start-up : fmpy simulate", [f"{walls[1] / walls[0]:.2f}"])


def _row(label: str, cells: Iterable[str]) -> str:
    return f"{label:44}" + "".join(f"{cell:>13}" for cell in cells)
