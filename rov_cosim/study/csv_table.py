"""Results as CSV, in the form of FMPy's: a quoted head, the shortest digits that give the number back."""

from pathlib import Path
from typing import Any

from numpy.typing import NDArray


def write_csv(path: Path, results: NDArray[Any]) -> None:
    """Write a structured array, a column a field: the bytes that ``fmpy.util.write_csv`` writes, sooner."""
    names = results.dtype.names or ()
    columns = [results[name].tolist() for name in names]
    with path.open("w", encoding="utf-8") as file:
        file.write(",".join(f'"{name}"' for name in names) + "\n")
        file.writelines(",".join(map(repr, row)) + "\n" for row in zip(*columns, strict=True))
