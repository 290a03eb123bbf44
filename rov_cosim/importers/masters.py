"""Drivers of co-simulation masters with an interface in Python: Ecos, libcosim, sofirpy.

Each runs the controller through a reference run, or the loop of an archive, and returns the largest absolute difference
to this project's own numbers. Call it in a process of its own (`importers.measure`).
"""

import sys
from collections.abc import Mapping, Sequence
from importlib.metadata import files
from pathlib import Path
from typing import Any

import numpy as np

from ..components.interface import SAMPLE_TIME
from ..handover.reference import Reference
from .driving import Loop, by_name, deviation, parameters, signals, typed, types

Pairs = Sequence[tuple[tuple[str, str], tuple[str, str]]]


def ecos() -> Any:
    """Return ecospy; its wheel leaves libtbb to the system, and PyPI has it."""
    import ctypes

    for file in (files("tbb") or []) if sys.platform == "linux" else []:
        if file.name == "libtbb.so.12":
            ctypes.CDLL(str(Path(str(file.locate())).resolve()), mode=ctypes.RTLD_GLOBAL)
    import ecospy

    return ecospy


def ecos_controller(fmu: Path, reference: Reference, folder: Path) -> float:
    """`EcosSimulationStructure` with a parameter set; inputs by `set_real` and `set_bool`."""
    ecospy, component = ecos(), reference.component
    structure = ecospy.EcosSimulationStructure()
    structure.add_model("it", str(fmu))
    structure.add_parameter_set("case", {f"it::{name}": value for name, value in parameters(reference).items()})
    kinds = {name: "bool" if type_ == "Boolean" else "real" for name, type_ in types(component).items()}
    with ecospy.EcosSimulation(structure=structure, step_size=SAMPLE_TIME) as simulation:
        simulation.init(0, "case")
        rows = []
        for now in reference.inputs[:-1]:
            for name in component.u.names:
                getattr(simulation, f"set_{kinds[name]}")(f"it::{name}", now[name])
            simulation.step()
            rows.append([getattr(simulation, f"get_{kinds[name]}")(f"it::{name}") for name in component.y.names])
        simulation.terminate()
    return deviation(by_name(component.y.names, rows), reference.outputs)


def ecos_loop(loop: Loop, folder: Path) -> float:
    """`EcosSimulation` of the archive with its parameter set."""
    names = signals(loop.results)
    kinds = ["bool" if loop.results.dtype[name] == np.bool_ else "real" for name in names]
    with ecos().EcosSimulation(step_size=SAMPLE_TIME, ssp_path=str(loop.archive)) as simulation:
        places = [
            (getattr(simulation, f"get_{kind}"), name.replace(".", "::", 1))
            for kind, name in zip(kinds, names, strict=True)
        ]
        simulation.init(0, "nominal")
        rows = []  # its start is before the values have gone round: the feed-through in tau shows that
        for _ in range(len(loop.results) - 1):
            simulation.step()
            rows.append([get(name) for get, name in places])
        simulation.terminate()
    return deviation(by_name(names, rows), loop.results)


class Cosim:
    """An execution of libcosim, and its variables by name."""

    def __init__(self, execution: Any) -> None:
        from libcosimpy.CosimManipulator import CosimManipulator
        from libcosimpy.CosimObserver import CosimObserver

        self.execution = execution
        self.observer = CosimObserver.create_last_value()
        self.override = CosimManipulator.create_override()
        execution.add_observer(self.observer)
        execution.add_manipulator(self.override)

    def place(self, element: str, variable: str) -> tuple[int, int]:
        """Return slave and value reference of a variable."""
        slave = self.execution.slave_index_from_instance_name(element)
        found = [v.reference for v in self.execution.slave_variables(slave) if v.name == variable.encode()]
        return slave, found[0]

    def step(self, outputs: Sequence[tuple[str, int, int]]) -> list[float]:
        """Take a step and return the values of outputs, each a kind, a slave and a reference."""
        if not self.execution.step():
            raise RuntimeError("libcosim cannot take a step.")
        return [getattr(self.observer, f"last_{kind}_values")(slave, [vr])[0] for kind, slave, vr in outputs]


def libcosim_controller(fmu: Path, reference: Reference, folder: Path) -> float:
    """`CosimExecution` with a `CosimLocalSlave`; initial values, and inputs by the override manipulator."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(round(SAMPLE_TIME * 1e9))
    execution.add_local_slave(CosimLocalSlave(str(fmu), "it"))
    cosim = Cosim(execution)
    kinds = {name: type_.lower() for name, type_ in types(reference.component).items()}
    for name, value in parameters(reference).items():
        getattr(execution, f"{kinds[name]}_initial_value")(*cosim.place("it", name), value)
    inputs = [(name, kinds[name], *cosim.place("it", name)) for name in reference.component.u.names]
    outputs = [(kinds[name], *cosim.place("it", name)) for name in reference.component.y.names]
    rows = []
    for now in reference.inputs[:-1]:
        for name, kind, slave, vr in inputs:
            getattr(cosim.override, f"slave_{kind}_values")(slave, [vr], [now[name]])
        rows.append(cosim.step(outputs))
    return deviation(by_name(reference.component.y.names, rows), reference.outputs)


def libcosim_loop(loop: Loop, folder: Path) -> float:
    """`CosimExecution` of the archive; the step size is that of its annotation."""
    from libcosimpy.CosimExecution import CosimExecution

    cosim = Cosim(CosimExecution.from_ssp_file(ssp_path=str(loop.archive)))
    names = signals(loop.results)
    kinds = ["boolean" if loop.results.dtype[name] == np.bool_ else "real" for name in names]
    outputs = [(kind, *cosim.place(*end)) for kind, end in zip(kinds, loop.outputs(), strict=True)]
    rows = [cosim.step(outputs) for _ in loop.results[1:]]
    return deviation(by_name(names, rows), loop.results)


def _sofirpy(
    steps: int, fmus: Mapping[str, Path], outputs: Sequence[tuple[str, str]], pairs: Pairs, **options: Any
) -> Any:
    """Return a data frame of outputs; pairs are an output and an input, each an element and a variable."""
    from sofirpy import simulate

    logged: dict[str, list[str]] = {}
    for element, variable in outputs:
        logged.setdefault(element, []).append(variable)
    connections: dict[str, list[dict[str, str]]] = {}
    keys = ("parameter_name", "connect_to_system", "connect_to_external_parameter")
    for source, (element, variable) in pairs:
        connections.setdefault(element, []).append(dict(zip(keys, (variable, *source), strict=True)))
    stop = (
        steps + 0.5
    ) * SAMPLE_TIME  # it takes whole steps, and half of one more keeps rounding from dropping the last
    how: dict[str, Any] = {"fmu_paths": dict(fmus), "parameters_to_log": logged, "connections_config": connections}
    return simulate(stop, SAMPLE_TIME, **how, **options)


def sofirpy_controller(fmu: Path, reference: Reference, folder: Path) -> float:
    """`sofirpy.simulate` with a model in Python that plays the inputs."""
    from sofirpy import SimulationEntity

    component, kinds = reference.component, types(reference.component)
    rows = [{name: typed(row[name], kinds[name]) for name in component.u.names} for row in reference.inputs]

    class Player(SimulationEntity):
        def initialize(self, start_values: Any) -> None:
            self.row = 0

        def do_step(self, time: float) -> None:
            self.row += 1

        def get_parameter_value(self, output_name: str) -> Any:
            return rows[self.row][output_name]

        def set_parameter(self, input_name: str, input_value: Any) -> None:
            raise AssertionError("the player has no inputs")

    outputs = [("it", name) for name in component.y.names]
    pairs = [(("player", name), ("it", name)) for name in component.u.names]
    start = {"it": {**parameters(reference), **rows[0]}}
    models = {"player": Player}
    found = _sofirpy(reference.case.steps, {"it": fmu}, outputs, pairs, model_classes=models, start_values=start)
    return deviation({name: found[f"it.{name}"] for name in component.y.names}, reference.outputs)


def sofirpy_loop(loop: Loop, folder: Path) -> float:
    """`sofirpy.simulate` of the FMUs; it hands nothing on before the first step, so inputs start as ours."""
    start = loop.start_values(connected=True)
    pairs = [(link.source, link.target) for link in loop.wiring.links]
    found = _sofirpy(len(loop.results) - 1, loop.fmus(), loop.outputs(), pairs, start_values=start)
    return deviation({name: found[name] for name in signals(loop.results)}, loop.results)
