"""A system as an engineer writes it down: elements, groups of connections, parameters."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from fmpy import read_model_description

from ..components.interface import SAMPLE_TIME
from .wiring import Element, End, Link, Value, Wiring, WiringError, suggestion

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
        last part of the name, for example `z_down.Z_DOWN`.
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


def wire(system: System, fmus: Mapping[str, Path]) -> Wiring:
    """Return the wiring of a system, given the path of each FMU by name.

    Raises
    ------
    WiringError : everything that is wrong with the declaration.
    """
    if unknown := [fmu for fmu in system.elements.values() if fmu not in fmus]:
        raise WiringError(system.name, [f"There is no FMU {fmu}." + suggestion(fmu, fmus) for fmu in unknown])
    elements = tuple(
        Element(name, fmus[fmu], read_model_description(str(fmus[fmu])), system.parameters.get(name, {}))
        for name, fmu in system.elements.items()
    )
    links: list[Link] = []
    problems = [f"There is no element {name}." for name in system.parameters if name not in system.elements]
    known = {element.name: element for element in elements}
    for source, target, *rest in system.connections:
        factors: Mapping[str, float] = rest[0] if rest else {}
        groups = []
        for ends in (source, target):
            name, _, group = ends.partition(".")
            groups.append(_members(known[name], group) if name in known else {})
        if not groups[0] or groups[0].keys() != groups[1].keys():
            problems.append(f"Connection {source} -> {target}: the variables do not pair up.")
            continue
        for suffix, start in groups[0].items():
            end = groups[1][suffix]
            links.append(Link(start, end, factors.get(end.variable.rsplit(".")[-1], 1.0)))
    wiring = Wiring(
        system.name, elements, tuple(links), system.stop_time, system.step_size, description=system.description
    )
    problems += wiring.problems()
    if problems:
        raise WiringError(system.name, problems)
    return wiring


def _members(element: Element, group: str) -> dict[str, End]:
    """Return the variables of a group by what follows the group's name."""
    return {
        name[len(group) :]: End(element.name, name)
        for name in element.variables
        if name == group or name.startswith((f"{group}.", f"{group}["))
    }
