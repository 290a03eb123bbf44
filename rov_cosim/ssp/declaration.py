"""A system as an engineer writes it down: elements, groups of connections, parameters."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

from fmpy import read_model_description
from fmpy.model_description import ModelDescription

from ..components.interface import SAMPLE_TIME
from ..exporters.build import built
from .checks import problems_of, unit_problems
from .values import Value
from .wiring import Element, End, Link, Wiring, WiringError, converted, suggestion

Connection = tuple[str, str] | tuple[str, str, Mapping[str, float]]


@dataclass(frozen=True)
class System:
    """A system of FMUs.

    Parameters
    ----------
    name : name of the system and its archive.
    description : one sentence.
    elements : FMU of each element, by the element's name, in the order in which a sequential master steps them.
    connections : pairs ``("element.group", "element.group")`` from outputs to inputs. A group is a variable, or all
        those that are named ``group.*`` or ``group[*]``, matched by what follows. A third item gives factors by the
        last part of the name, for example `z_down.Z_DOWN`. Units are converted besides.
    parameters : start values that differ from the FMU's, by element and variable.
    stop_time, step_size : duration of a run and communication step, in s.
    """

    name: str
    description: str
    elements: Mapping[str, str]
    connections: tuple[Connection, ...]
    stop_time: float
    parameters: Mapping[str, Mapping[str, Value]] = field(default_factory=dict)
    step_size: float = SAMPLE_TIME


def wire(
    system: System,
    fmus: Mapping[str, Path] | None = None,
    export: str = "native",
    progress: Callable[[str], object] = lambda line: None,
) -> Wiring:
    """Return the wiring of a system.

    Parameters
    ----------
    fmus : the path of each FMU by name; those of this project's components, built if they are not current, if left out.
    export : "native" or "pythonfmu": which of these.
    progress : is told in a line what a build begins.

    Raises
    ------
    BuildError : an FMU cannot be built.
    WiringError : everything that is wrong with the declaration.
    """
    fmus = built(system.elements.values(), export, progress) if fmus is None else fmus
    if unknown := [fmu for fmu in system.elements.values() if fmu not in fmus]:
        raise WiringError(system.name, [f"There is no FMU {fmu}." + suggestion(fmu, fmus) for fmu in unknown])
    elements = tuple(
        Element(name, fmus[fmu], _description(fmus[fmu]), system.parameters.get(name, {}))
        for name, fmu in system.elements.items()
    )
    links: list[Link] = []
    problems = [
        f"There is no element {name}." + suggestion(name, system.elements)
        for name in system.parameters
        if name not in system.elements
    ]
    known = {element.name: element for element in elements}
    for source, target, *rest in system.connections:
        factors: Mapping[str, float] = rest[0] if rest else {}
        (from_, _, outputs), (to, _, inputs) = source.partition("."), target.partition(".")
        groups = [known[name].group(group) if name in known else {} for name, group in ((from_, outputs), (to, inputs))]
        if not groups[0] or groups[0].keys() != groups[1].keys():
            problems.append(f"Connection {source} -> {target}: the variables do not pair up.")
            continue
        for suffix, output in groups[0].items():
            factor = factors.get(groups[1][suffix].rsplit(".")[-1], 1.0)
            links.append(converted(Link(End(from_, output), End(to, groups[1][suffix]), factor), known))
    wiring = Wiring(
        system.name, elements, tuple(links), system.stop_time, system.step_size, description=system.description
    )
    problems += [*problems_of(wiring), *unit_problems(wiring.links, known)]
    if problems:
        raise WiringError(system.name, problems)
    return wiring


def _description(fmu: Path) -> ModelDescription:
    """Return the description of an FMU as it is now, the same object while it is; it must not change."""
    status = fmu.stat()
    return _read(str(fmu), status.st_mtime_ns, status.st_ctime_ns, status.st_size)


@lru_cache(maxsize=64)  # a fleet has few components
def _read(fmu: str, *made: int) -> ModelDescription:
    return read_model_description(fmu)
