"""What the FMU of a system shows, in the order of its value references, and how its elements exchange values."""

from collections.abc import Iterable
from copy import copy
from dataclasses import dataclass
from itertools import groupby
from typing import NamedTuple

from fmpy.model_description import ModelVariable

from ..errors import UserError
from ..exporters.model_description import literal
from ..ssp.values import function_type
from ..ssp.wiring import Element, End, Link, Wiring

TYPES = ("Real", "Integer", "Boolean")
"""Of the variables shown; an Enumeration is an Integer, and Strings are not."""

COUPLING = "coupling"
"""The parameter that selects the coupling; every other variable has a dot in its name."""


class LayoutError(UserError):
    """A system has what its FMU cannot show; the message tells what."""


class Shown(NamedTuple):
    """A variable of the system: as it is described, and which element it is of, by what value reference there."""

    variable: ModelVariable
    element: int
    reference: int


class Copies(NamedTuple):
    """Links from one element to another, of one type: places in their outputs and in their connected inputs."""

    sender: int
    receiver: int
    type: str
    from_: list[int]
    to: list[int]
    factors: list[float]


@dataclass(frozen=True)
class Layout:
    """The variables of a system's FMU: inputs, outputs, parameters, the last of them the coupling.

    The outputs are in the order of the elements, those of one by type; so is `fed`, the connected inputs of each.
    """

    wiring: Wiring
    inputs: list[Shown]
    outputs: list[Shown]
    parameters: list[Shown]
    fed: list[dict[str, list[ModelVariable]]]
    copies: list[Copies]

    @property
    def variables(self) -> list[Shown]:
        """All, in the order of their value references."""
        return [*self.inputs, *self.outputs, *self.parameters]

    def outputs_of(self, element: int) -> dict[str, list[Shown]]:
        """Return the outputs of an element by type."""
        own = [shown for shown in self.outputs if shown.element == element]
        return {type_: [shown for shown in own if shown.variable.type == type_] for type_ in TYPES}


def laid_out(wiring: Wiring) -> Layout:
    """Return the layout of a system: all outputs, all parameters and the unconnected inputs as ``element.variable``.

    Raises
    ------
    LayoutError : the system sets or connects what is not shown.
    """
    targets = {link.target for link in wiring.links}
    fed = [{type_: list(_fed(e, type_, targets)) for type_ in TYPES} for e in wiring.elements]
    inputs, outputs, parameters = [], [], []
    for i, element in enumerate(wiring.elements):
        for type_ in TYPES:
            outputs += [_shown(i, element, v) for v in element.description.modelVariables if _is(v, "output", type_)]
        for variable in element.description.modelVariables:
            if function_type(variable) not in TYPES or not element.has_value(variable.name):
                continue
            if variable.causality == "parameter":
                parameters.append(_shown(i, element, variable))
            elif variable.causality == "input" and End(element.name, variable.name) not in targets:
                inputs.append(_shown(i, element, variable))
    _check(wiring, {shown.variable.name for shown in (*inputs, *parameters)})
    parameters.append(Shown(_coupling(), len(wiring.elements), 0))
    layout = Layout(wiring, inputs, outputs, parameters, fed, [])
    for reference, shown in enumerate(layout.variables):
        shown.variable.valueReference = reference
    layout.copies.extend(_copies(layout))
    return layout


def _check(wiring: Wiring, settable: set[str]) -> None:
    targets = {str(link.target) for link in wiring.links}
    ends = [f"{element.name}.{name}" for element in wiring.elements for name in element.start_values]
    if lost := [end for end in ends if end not in settable and end not in targets]:
        raise LayoutError(
            f"{wiring.name}: {', '.join(lost)} cannot be set in one FMU: no parameters, inputs, or Strings."
        )
    if any(link_type(link, wiring) == "String" for link in wiring.links):
        raise LayoutError(f"{wiring.name}: it connects Strings, which one FMU does not.")


def link_type(link: Link, wiring: Wiring) -> str:
    """Return the type of the values that a link carries."""
    element = next(element for element in wiring.elements if element.name == link.source.element)
    return function_type(element.variables[link.source.variable])


def _is(variable: ModelVariable, causality: str, type_: str) -> bool:
    return bool(variable.causality == causality and function_type(variable) == type_)


def _fed(element: Element, type_: str, targets: set[End]) -> Iterable[ModelVariable]:
    for variable in element.description.modelVariables:
        if function_type(variable) == type_ and End(element.name, variable.name) in targets:
            yield variable


def _shown(index: int, element: Element, declared: ModelVariable) -> Shown:
    variable = copy(declared)
    variable.name = f"{element.name}.{declared.name}"
    variable.type = function_type(declared)
    variable.canHandleMultipleSetPerTimeInstant = False
    variable.start = None
    if declared.causality != "output":
        variable.start = literal(element.value(declared.name), variable.type)
    # What the standard takes where nothing is said: an FMU's own word may not fit, or names what is not here.
    variable.initial = variable.declaredType = variable.derivative = None
    variable.reinit = False
    return Shown(variable, index, declared.valueReference)


def _coupling() -> ModelVariable:
    return ModelVariable(
        name=COUPLING,
        valueReference=0,
        type="Integer",
        description="0: Jacobi, all elements step with what the others gave a step before; 1: Gauss-Seidel, in turn",
        causality="parameter",
        variability="fixed",
        canHandleMultipleSetPerTimeInstant=False,
        min="0",
        max="1",
        start="0",
    )


def _copies(layout: Layout) -> Iterable[Copies]:
    elements = layout.wiring.elements
    index = {element.name: i for i, element in enumerate(elements)}
    outputs = [
        {type_: [shown.variable.name for shown in of_type] for type_, of_type in layout.outputs_of(i).items()}
        for i in range(len(elements))
    ]
    inputs = [{type_: [v.name for v in of_type] for type_, of_type in by_type.items()} for by_type in layout.fed]

    def bundle(link: Link) -> tuple[int, int, str]:
        return index[link.source.element], index[link.target.element], link_type(link, layout.wiring)

    for (sender, receiver, type_), group in groupby(sorted(layout.wiring.links, key=bundle), key=bundle):
        links = list(group)
        yield Copies(
            sender,
            receiver,
            type_,
            [outputs[sender][type_].index(str(link.source)) for link in links],
            [inputs[receiver][type_].index(link.target.variable) for link in links],
            [link.factor for link in links],
        )
