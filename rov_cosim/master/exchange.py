"""How values go from FMU to FMU: the links of a system as copies between arrays, and the two couplings."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..ssp.wiring import Link
from .slave import Slave, SlaveError

PASSES = 100
"""Passes over the links, beyond one for each, in which initial values that follow each other must settle."""


class Copy(NamedTuple):
    """Outputs of one slave that become inputs of another: target[to] = factors * source[from_].

    `receiver` is the place of the other in the system's order, `type` the FMI type of all of them.
    """

    receiver: int
    type: str
    source: NDArray[Any]
    target: NDArray[Any]
    from_: NDArray[np.intp]
    to: NDArray[np.intp]
    factors: NDArray[Any]


class Exchange:
    """The slaves of a system in order, and the copies that carry outputs to inputs."""

    def __init__(self, slaves: list[Slave], links: tuple[Link, ...]) -> None:
        self.slaves, self.n_links = slaves, len(links)
        by_name = {slave.element.name: slave for slave in slaves}
        grouped: dict[tuple[str, str, str], list[tuple[int, int, float]]] = {}
        for source, target, factor in links:
            type_ = by_name[source.element].element.variables[source.variable].type
            places = grouped.setdefault((source.element, target.element, type_), [])
            names = by_name[source.element].outputs[type_].names, by_name[target.element].inputs[type_].names
            places.append((names[0].index(source.variable), names[1].index(target.variable), factor))
        self.copies: list[Copy] = []
        for (source_name, target_name, type_), places in grouped.items():
            from_, to, factors = (np.array(column) for column in zip(*places, strict=True))
            outputs, inputs = by_name[source_name].outputs[type_].values, by_name[target_name].inputs[type_].values
            receiver = slaves.index(by_name[target_name])
            self.copies.append(Copy(receiver, type_, outputs, inputs, from_, to, factors.astype(inputs.dtype)))
        self._into = {slave: [c for c in self.copies if c.receiver == i] for i, slave in enumerate(slaves)}

    def feed(self, slave: Slave) -> None:
        """Set the connected inputs of a slave from the outputs last read."""
        for _, _, source, target, from_, to, factors in self._into[slave]:
            target[to] = factors * source[from_]
        slave.write()

    def propagate(self) -> bool:
        """Hand initial outputs on until no value changes any more; tell whether that came to pass."""
        before = None
        for _ in range(PASSES + self.n_links):
            for slave in self.slaves:
                slave.read()
            for slave in self.slaves:
                self.feed(slave)
            if before is not None and np.array_equal(before, self.values(), equal_nan=True):
                return True
            before = self.values()
        return False

    def values(self) -> NDArray[np.float64]:
        """Return all outputs last read, in the order of the results' columns."""
        blocks = [block.values for slave in self.slaves for block in slave.outputs.values()]
        return np.concatenate([np.zeros(0), *blocks])


Coupling = Callable[[Exchange, float, float], None]

Advance = Callable[[int, NDArray[np.float64]], None]
"""Takes a step for each row of an array, the first of the number given, and records the outputs after it in the row.

SlaveError if a call fails, with the number of the step; the rows before are filled.
"""


def in_python(exchange: Exchange, coupling: Coupling, start_time: float, step: float) -> Advance:
    """Return what advances the slaves by a coupling: the reference for `in_c`."""

    def advance(first: int, rows: NDArray[np.float64]) -> None:
        for n, row in enumerate(rows, first):
            try:
                coupling(exchange, start_time + n * step, step)
            except SlaveError as error:
                error.step = n
                raise
            row[:] = exchange.values()

    return advance


def jacobi(exchange: Exchange, time: float, step: float) -> None:
    """Hand all outputs on, then step all: what every other master does. A connection delays by a step."""
    for slave in exchange.slaves:
        exchange.feed(slave)
    for slave in exchange.slaves:
        slave.step(time, step)
    for slave in exchange.slaves:
        slave.read()


def gauss_seidel(exchange: Exchange, time: float, step: float) -> None:
    """Feed and step one after the other, in the system's order: each sees the results of those before it."""
    for slave in exchange.slaves:
        exchange.feed(slave)
        slave.step(time, step)
        slave.read()


COUPLINGS: dict[str, Coupling] = {"jacobi": jacobi, "gauss-seidel": gauss_seidel}
