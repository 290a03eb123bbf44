"""How values go from FMU to FMU: the links of a system as copies between arrays, and the two couplings."""

from collections.abc import Callable, Iterable
from math import floor
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..ssp.wiring import End, Link
from .memory import Watch
from .slave import Slave, SlaveError

PASSES = 100
"""Passes over the links, beyond one for each, in which initial values that follow each other must settle."""


class Copy(NamedTuple):
    """Outputs of one slave that become inputs of another: target[to] = factors * source[from_].

    Slaves are told by their place in the system's order, `type` is the FMI type of all of them.
    """

    sender: int
    receiver: int
    type: str
    from_: NDArray[np.intp]
    to: NDArray[np.intp]
    factors: NDArray[Any]


class Feed(NamedTuple):
    """An input that is fed from outside: its slave, its FMI type and its place among the inputs of that type."""

    receiver: int
    type: str
    to: int


def rows_after(steps: int, spacing: float) -> int:
    """Return how many rows there are after so many steps, but for the first row, with so many steps between two."""
    return floor(steps / spacing + 1e-9)


def differing(rows: NDArray[Any]) -> list[str]:
    """Return the fields in which two rows differ, bit by bit."""
    return [name for name in rows.dtype.names or () if rows[name][:1].tobytes() != rows[name][1:].tobytes()]


class Exchange:
    """The slaves of a system in order, the copies that carry outputs to inputs, and what is fed from outside."""

    def __init__(self, slaves: list[Slave], links: Iterable[Link], fed: Iterable[End] = ()) -> None:
        self.slaves = slaves
        self._number = {slave.element.name: i for i, slave in enumerate(slaves)}
        grouped: dict[tuple[int, int, str], list[tuple[int, int, float]]] = {}
        for source, target, factor in links:
            sender, type_, from_ = self._place(source, "outputs")
            receiver, _, to = self._place(target, "inputs")
            grouped.setdefault((sender, receiver, type_), []).append((from_, to, factor))
        self.n_links = sum(map(len, grouped.values()))
        self.copies: list[Copy] = []
        for group, places in grouped.items():
            froms, tos, factors = (np.array(column) for column in zip(*places, strict=True))
            dtype = slaves[group[1]].inputs[group[2]].values.dtype
            self.copies.append(Copy(*group, froms, tos, factors.astype(dtype)))
        self._into = [[copy for copy in self.copies if copy.receiver == i] for i in range(len(slaves))]
        self.feeds = [Feed(*self._place(end, "inputs")) for end in fed]
        self.dtype, self.whole = (
            np.dtype([("time", np.float64), *(field for slave in slaves for field in slave.fields(all_))])
            for all_ in (False, True)
        )

    def _place(self, end: End, direction: str) -> tuple[int, str, int]:
        number = self._number[end.element]
        for type_, block in getattr(self.slaves[number], direction).items():
            if end.variable in block.names:
                return number, type_, block.names.index(end.variable)
        raise KeyError(str(end))

    def feed(self, slave: Slave, given: NDArray[np.float64] | None, must_be_finite: bool) -> None:
        """Set the fed inputs of a slave from the outputs last read, and from a number for each of `feeds`."""
        for copy in self._into[slave.number]:
            source = self.slaves[copy.sender].outputs[copy.type].values
            slave.inputs[copy.type].values[copy.to] = copy.factors * source[copy.from_]
        if given is not None:
            for feed, value in zip(self.feeds, given, strict=True):
                if feed.receiver == slave.number:
                    slave.inputs[feed.type].values[feed.to] = value
        if must_be_finite:
            slave.check_finite(slave.inputs.get("Real"))
        slave.write()

    def read(self, slave: Slave, must_be_finite: bool) -> None:
        """Read the outputs of a slave."""
        slave.read()
        if must_be_finite:
            slave.check_finite(slave.outputs.get("Real"))

    def recorder(self, rows: NDArray[Any], all_: bool = False) -> Callable[[int, float], None]:
        """Return what writes the time and outputs last read to a row, by its number, of an array of `dtype`.

        Of all outputs the array is one of `whole`.
        """
        blocks = [block for slave in self.slaves for block in slave.outputs.values()]
        taken = [np.arange(len(block.names)) if all_ else block.recorded for block in blocks]
        columns = [(f"{i}", blocks[i].dtype, (len(places),)) for i, places in enumerate(taken)]
        grouped = rows.view([("time", np.float64), *columns])
        times, parts = grouped["time"], [(grouped[f"{i}"], blocks[i], places) for i, places in enumerate(taken)]

        def record(row: int, time: float) -> None:
            times[row] = time
            for column, block, places in parts:
                column[row] = block.recordable()[places]

        return record


GivenRows = NDArray[np.float64] | None
"""What is fed from outside: a row a step, of a number for each feed; None if nothing is."""


class Steps(NamedTuple):
    """How a run steps: its coupling, start time and step in s, and whether a value that is not finite ends it."""

    coupling: "Coupling"
    start_time: float
    step: float
    must_be_finite: bool


Coupling = Callable[[Exchange, int, "NDArray[np.float64] | None", Steps], None]


class InPython:
    """Advances the slaves of an exchange in Python: the reference for `in_c.InC`."""

    def __init__(self, exchange: Exchange, steps: Steps, watch: Watch) -> None:
        self.exchange, self.steps, self.watch = exchange, steps, watch

    @np.errstate(over="ignore")  # of a product on a link; what becomes infinite is told
    def settle(self, given: GivenRows) -> list[str]:
        """Hand initial outputs on until no value changes any more; return those that still do, none if it came to pass.

        `given` is as in `run`, of the first step alone.
        """
        exchange, rows = self.exchange, np.zeros(2, self.exchange.whole)
        record, fed = exchange.recorder(rows, True), None if given is None else given[0]
        for n in range(PASSES + exchange.n_links):
            for slave in exchange.slaves:
                exchange.read(slave, False)
            record(n % 2, 0.0)  # first, for a String lasts until the next call of its FMU
            for slave in exchange.slaves:
                exchange.feed(slave, fed, False)
            if n and rows[0].tobytes() == rows[1].tobytes():
                return []
        return differing(rows)

    def begin(self, row: NDArray[Any]) -> None:
        """Read all outputs, and record those to record in an array of one row; SlaveError if that fails."""
        for slave in self.exchange.slaves:
            self.exchange.read(slave, self.steps.must_be_finite)
        self.exchange.recorder(row)(0, self.steps.start_time)
        self.watch.recorded = 1

    @np.errstate(over="ignore")
    def run(self, first: int, count: int, given: GivenRows, spacing: float, rows: NDArray[Any]) -> None:
        """Take `count` steps from the step `first` on; SlaveError if one fails, with its number.

        The outputs are recorded, a row each, after the first step at or beyond each multiple of `spacing` steps.
        """
        record = self.exchange.recorder(rows)
        for n in range(first, first + count):
            self.watch.step = n
            try:
                self.steps.coupling(self.exchange, n, None if given is None else given[n - first], self.steps)
            except SlaveError as error:
                error.step = n
                raise
            row = rows_after(n, spacing) - rows_after(first, spacing)
            if rows_after(n + 1, spacing) > rows_after(n, spacing):
                record(row, self.steps.start_time + (n + 1) * self.steps.step)
                self.watch.recorded += 1


def _advance(slave: Slave, n: int, steps: Steps) -> None:
    parts, every = slave.rate
    step = steps.step * every / parts
    if (n + 1) % every == 0:
        for part in range(parts):
            slave.step(steps.start_time + (n + 1 - every) * steps.step + part * step, step)


def jacobi(exchange: Exchange, n: int, given: NDArray[np.float64] | None, steps: Steps) -> None:
    """Hand all outputs on, then step all: what every other master does. A connection delays by a step."""
    for slave in exchange.slaves:
        exchange.feed(slave, given, steps.must_be_finite)
    for slave in exchange.slaves:
        _advance(slave, n, steps)
    for slave in exchange.slaves:
        exchange.read(slave, steps.must_be_finite)


def gauss_seidel(exchange: Exchange, n: int, given: NDArray[np.float64] | None, steps: Steps) -> None:
    """Feed and step one after the other, in the system's order: each sees the results of those before it."""
    for slave in exchange.slaves:
        exchange.feed(slave, given, steps.must_be_finite)
        _advance(slave, n, steps)
        exchange.read(slave, steps.must_be_finite)


COUPLINGS: dict[str, Coupling] = {"jacobi": jacobi, "gauss-seidel": gauss_seidel}
