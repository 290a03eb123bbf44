"""How a run is taken: its times, its coupling, what is fed and recorded, and in which process."""

import csv
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import UserError
from ..exporters.model_description import GENERATION_TOOL
from ..ssp.values import parse
from ..ssp.wiring import Wiring
from .changes import plain


@dataclass(frozen=True)
class Settings:
    """How a run is taken; the system's own times where they are left out.

    Parameters
    ----------
    coupling : "jacobi" or "gauss-seidel".
    start_time, stop_time, step : in s.
    output_interval : time in s between two rows of the results; each step has one if left out.
    input : CSV of unconnected inputs over time: a column ``time`` in s, then columns ``element.variable``.
    allow_not_finite : go on when an output is not finite.
    isolate : run in a process of its own; if left out, where an FMU is not of this project.
    timeout : time in s that a call of an FMU may take; asks for a process of its own.
    """

    coupling: str = "jacobi"
    start_time: float | None = None
    stop_time: float | None = None
    step: float | None = None
    output_interval: float | None = None
    input: Path | None = None
    allow_not_finite: bool = False
    isolate: bool | None = None
    timeout: float | None = None

    def timed(self, wiring: Wiring) -> Wiring:
        """Return a system with these times."""
        times = {"start_time": self.start_time, "stop_time": self.stop_time, "step_size": self.step}
        return replace(wiring, **{name: time for name, time in times.items() if time is not None})  # type: ignore[arg-type]

    def table(self) -> NDArray[Any] | None:
        """Return the table of inputs.

        Raises
        ------
        UserError : there is no such file, or it is no such table.
        """
        return None if self.input is None else _read(self.input)

    def isolates(self, wiring: Wiring) -> bool:
        """Tell whether a system runs in a process of its own."""
        if self.isolate is not None:
            return self.isolate
        made_by = {element.description.generationTool for element in wiring.elements}
        return self.timeout is not None or made_by != {GENERATION_TOOL}

    def words(self) -> list[str]:
        """Return a word for each setting on which results depend."""
        words = [] if self.coupling == "jacobi" else [self.coupling]
        if self.start_time is not None:
            words.append(f"from={plain(self.start_time)}s")
        if self.stop_time is not None:
            words.append(f"{plain(self.stop_time)}s")
        if self.step is not None:
            words.append(f"step={plain(self.step)}s")
        if self.output_interval is not None:
            words.append(f"every={plain(self.output_interval)}s")
        if self.input is not None:
            content = self.input.read_bytes() if self.input.is_file() else b""
            words.append(f"input={self.input.stem}-{sha256(content).hexdigest()[:6]}")
        return words


def _read(path: Path) -> NDArray[Any]:
    """Return a CSV in the form of FMPy's, all numbers, as a structured array."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:  # with the mark that spreadsheets write first
            reader = csv.reader(file)
            lines = [(reader.line_num, row) for row in reader if row]
        if not lines:
            raise ValueError("it is empty")
        (_, names), *rows = lines
        values = [_numbers(row, names, line) for line, row in rows]
        return np.array(values, [(name.strip(), np.float64) for name in names])
    except (OSError, ValueError, TypeError, csv.Error) as error:
        message = f"{path} is no table of inputs ({error}): expected a head `time,ELEMENT.VARIABLE,...` and numbers."
        raise UserError(message) from None


def _numbers(row: list[str], names: list[str], line: int) -> tuple[float, ...]:
    """Return the cells of a row as numbers; ValueError if it has others than the head has names."""
    if len(row) != len(names):
        raise ValueError(f"line {line} has {len(row)} cells, the head {len(names)}, parted by commas")
    try:
        return tuple(float(parse(_BOOLEANS.get(text.strip().lower(), text), "Real")) for text in row)
    except ValueError as error:
        raise ValueError(f"line {line}, parted by commas: {error}") from None


_BOOLEANS = {"true": "1", "false": "0"}
