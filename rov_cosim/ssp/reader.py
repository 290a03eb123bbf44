"""Strict reading of SSP 1.0 archives: everything that is wrong with one is told at once."""

import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from math import floor, log10
from pathlib import Path

from fmpy.model_description import ModelDescription

from ..components.interface import SAMPLE_TIME
from . import ssd, zipped
from .checks import faults_of
from .flattening import Flattening, components
from .fmu_file import DESCRIPTION, FmuError, described
from .parameter_set import Bound, checked_values
from .rates import named_step
from .ssd import Component, Structure
from .units import Base, is_defined, same_unit, units_of
from .values import are_alike
from .wiring import Element, Wiring, WiringError, suggestion

SSD = "SystemStructure.ssd"
FEWEST_STEPS = 10
"""Steps of a run below which that of this project is too long for an archive that names none."""

Warn = Callable[[str], None]


@contextmanager
def opened(path: Path, warn: Warn = lambda message: None) -> Iterator[Wiring]:
    """Read an archive and yield its system; its FMUs lie in a temporary folder until the context ends.

    The elements of a system in the system are named ``system.element``. `warn` is told what is not quite as it should
    be and yet can be run.

    Raises
    ------
    WiringError : every problem found: a broken archive, XML that the standard or this reader does not know, a missing
        FMU, connectors that do not match, units or types that differ, unknown parameters.
    """
    with tempfile.TemporaryDirectory(prefix="rov_cosim_", ignore_cleanup_errors=True) as folder:
        try:
            zipped.unpack(path, Path(folder))
        except zipped.ZipError as error:
            problem = f"This is not a readable SSP archive: it {error}"
            if not path.exists():
                problem = "There is no such archive; `rov-cosim build` makes those of this project."
            raise WiringError(str(path), [problem]) from None
        yield _Reader(_root(Path(folder), str(path), warn), str(path), warn).read()


def _root(folder: Path, where: str, warn: Warn) -> Path:
    """Return the folder of an unpacked archive that its SSD is in."""
    if (folder / SSD).is_file():
        return folder
    found = sorted((p for p in folder.rglob(SSD) if "__MACOSX" not in p.parts), key=lambda p: len(p.parts))
    if found:
        inside = found[0].parent
        warn(f"{where}: {SSD} lies in the folder {inside.relative_to(folder)}, not at the root, where SSP wants it.")
        return inside
    others = sorted(p.name for p in folder.rglob("*.ssd"))
    if (folder / DESCRIPTION).is_file():
        what = "This is an FMU, which takes a place in a system by --swap ELEMENT=FMU."
    elif others:
        what = f"There are {', '.join(others)}: give the one to run this name."
    elif (folder / "OspSystemStructure.xml").is_file():
        what = "OspSystemStructure.xml is a form of Open Simulation Platform's own."
    else:
        what = "Zip what the folder with it holds."
    raise WiringError(where, [f"{SSD}: There is no such file. {what}"])


class _Reader:
    """One pass over an extracted archive that collects problems."""

    def __init__(self, root: Path, where: str, warn: Warn) -> None:
        self.root, self.where = root, where
        self.warn: Warn = lambda message: warn(f"{where}: {message}")
        self.problems: list[str] = []
        self._described: dict[Path, ModelDescription] = {}

    def read(self) -> Wiring:
        structure = ssd.read(self.root / SSD, self.problems, self.warn)
        if structure is None:
            raise WiringError(self.where, self.problems)
        listed = list(components(structure.root))
        if not listed:
            self.problems.append(f"{SSD}: the system has no component.")
        elements = [(path, self._element(path, component, structure.units)) for path, component in listed]
        flat = Flattening(structure, dict(elements), self.warn)
        self.problems += flat.problems
        step, note = _step_size(structure, [e for _, e in elements if e])
        wiring = Wiring(
            name=structure.name,
            elements=tuple(self._started(e, flat.bound[path]) for path, e in elements if e),
            links=tuple(flat.links),
            start_time=structure.start_time,
            stop_time=structure.stop_time,
            step_size=step,
            description=structure.description,
        )
        self.problems += faults_of(wiring)
        if self.problems:
            raise WiringError(self.where, list(dict.fromkeys(self.problems)))
        if note:
            self.warn(note)
        return wiring

    def _element(self, path: tuple[str, ...], component: Component, units: Mapping[str, Base]) -> Element | None:
        name, source = ".".join(path), component.source
        fmu = ssd.located(self.root, source)
        if fmu is None:
            there = [str(p.relative_to(self.root)) for p in self.root.rglob("*.fmu")]
            hint = suggestion(source, there) or " Only what lies in it is run." * (".." in source or "://" in source)
            self.problems.append(f"{name}: the archive has no FMU {source:.100}.{hint}")
            return None
        try:
            if fmu not in self._described:
                self._described[fmu] = described(fmu, source, self.warn)
        except FmuError as error:
            self.problems.append(f"{name}: {error}")
            return None
        element = Element(name, fmu, self._described[fmu])
        self._check_connectors(component, element, units)
        return element

    def _started(self, element: Element, bound: list[Bound]) -> Element:
        values = checked_values(bound, element.name, element.description, self.problems, self.warn)
        return replace(element, start_values=values)

    def _check_connectors(self, component: Component, element: Element, units: Mapping[str, Base]) -> None:
        variables, known = element.variables, units_of(element.description)
        for name, (kind, type_, unit) in component.connectors.items():
            where, variable = f"Connector {element.name}.{name}", variables.get(name)
            if variable is None:
                self.problems.append(f"{where}: the FMU has no such variable." + suggestion(name, variables))
                continue
            if kind != variable.causality:
                self.problems.append(f"{where}: kind {kind} does not match causality {variable.causality}.")
            if type_ and not are_alike(type_, variable.type):
                self.problems.append(f"{where}: type {type_} does not match {variable.type}.")
            elif not same_unit(unit, units, variable.unit, known):
                if is_defined(unit, units) and is_defined(variable.unit, known):
                    self.problems.append(f"{where}: unit {unit} does not match {variable.unit}.")
                else:
                    self.warn(f"{where}: unit {unit} stands for {variable.unit}, and not both are defined.")


def _step_size(structure: Structure, elements: list[Element]) -> tuple[float, str]:
    """Return the step that the archive names, else the shortest of its FMUs, else a round one with a word on it."""
    if structure.step_size is not None:
        return structure.step_size, ""
    named = [step for step in map(named_step, elements) if step]
    duration = structure.stop_time - structure.start_time
    if named:
        step, of = min(named), "the shortest that an FMU of it names"
    elif 0 < duration < FEWEST_STEPS * SAMPLE_TIME * (1 - 1e-9):
        step, of = float(f"1e{floor(log10(duration / 100))}"), "a hundred in a run or more"
    else:
        step, of = SAMPLE_TIME, "this project's own"
    return step, f"The archive names no step: without --step it is {step:g} s, {of}."
