"""Replays this kit's reference runs through an FMU: python examples/check.py THE.fmu; status 1 if it departs.

For an FMU of FMI 2.0 of the same names. `rov-cosim handover check` tells more, and takes FMI 3.0 too, and by a
map other names, units and axes.
"""

import csv
import sys
from pathlib import Path

from fmu import Fmu

KIT, TOLERANCE, LEAST = Path(__file__).parent.parent, 1e-6, 1e-3


def number(text):
    """Return a cell of a table as a number."""
    return {"true": 1.0, "false": 0.0}.get(text.lower()) if text[0].isalpha() else float(text)


def table(path):
    """Return the rows of a CSV but the column `time`, a dictionary each."""
    with path.open(encoding="utf-8") as file:
        return [{name: number(text) for name, text in row.items() if name != "time"} for row in csv.DictReader(file)]


def departures(fmu, run):
    """Yield a sentence for each output that departs from a reference run by more than 1e-6 of its largest value."""
    inputs, expected = (table(next(run.glob(f"*_{part}.csv"))) for part in ("in", "ref"))
    with Fmu(fmu, next(run.glob("*.ssv"), None)) as it:
        rows = []
        for n, row in enumerate(inputs):
            for name, value in row.items():
                it[name] = value
            it.start()
            rows.append({name: float(it[name]) for name in expected[0]})
            if n < len(inputs) - 1:
                it.step()
    for name in expected[0]:
        allowed = TOLERANCE * max(LEAST, *(abs(row[name]) for row in expected))
        wrong = (n for n, row in enumerate(rows) if not abs(row[name] - expected[n][name]) <= allowed)
        if (n := next(wrong, None)) is not None:
            time = n * it.step_size
            yield f"{name} departs in {run.name} at {time:g} s: {rows[n][name]:.6g} instead of {expected[n][name]:.6g}"


def main():
    """Check the FMU of the first argument, or the kit's own."""
    fmu = sys.argv[1] if len(sys.argv) > 1 else next(KIT.glob("*.fmu"))
    runs = sorted((KIT / "reference").iterdir())
    if not Path(fmu).is_file():
        sys.exit(f"There is no file {fmu}.")
    try:
        found = [line for run in runs for line in departures(fmu, run)]
    except Exception as error:  # FMPy raises plain ones, of a library that does not load for one
        why = (error.args or [type(error).__name__])[-1]
        sys.exit(f"{fmu} cannot be checked here: {why}; `rov-cosim handover check` may take it.")
    print("\n".join([*found, f"{len(runs)} reference runs, {len(found)} departures"]))
    return 1 if found or not runs else 0


if __name__ == "__main__":
    sys.exit(main())
