"""The page inside the FMU of a system: what it is made of, how it steps, all its variables."""

from collections.abc import Iterable
from html import escape

from fmpy.model_description import ModelVariable

from ..exporters import documentation
from ..ssp.wiring import Link
from .layout import COUPLING, Layout

_TEXT = """\
# {name}

{description}

This FMU is a whole system: its elements and the master that steps them are inside.

| element | component | |
|---|---|---|
{elements}

| connection | factor |
|---|---|
{links}

## Steps

The inner step is {step} s. A communication step has to be a multiple of it, within a millionth; another is refused with
an error and changes nothing. Unconnected inputs are read at the begin of a communication step.

The parameter `{coupling}` selects how values are handed on within an inner step. 0, Jacobi: all outputs are handed on,
then all elements step, so that a connection delays by a step. 1, Gauss-Seidel: the elements step in turn, in the order
above, each with the results of those before it.

Before the run the initial outputs are handed on until they no longer change.

A message in the log has the name of its element before it. If an element refuses an inner step, others may have taken
it: the system has failed, and goes on after a reset{saved} alone.
"""


def page(layout: Layout, variables: Iterable[ModelVariable], linked: bool) -> str:
    """Return the HTML page of variables; `linked` tells whether elements are in the binary: the state can be saved."""
    wiring = layout.wiring
    elements = [
        f"| `{e.name}` | {e.description.modelName} | {_cell(e.description.description or '')} |"
        for e in wiring.elements
    ]
    markdown = _TEXT.format(
        name=wiring.name,
        description=wiring.description,
        elements="\n".join(elements),
        links="\n".join(map(_link, wiring.links)) or "| none | |",
        step=f"{wiring.step_size:.9g}",
        coupling=COUPLING,
        saved=", or with a state restored," if linked else "",
    )
    by_causality: dict[str, list[ModelVariable]] = {"input": [], "output": [], "parameter": []}
    for variable in variables:
        by_causality[variable.causality].append(variable)
    tables = "".join(_table(f"{causality.capitalize()}s", those) for causality, those in by_causality.items())
    return documentation.html(wiring.name, markdown, tables)


def _link(link: Link) -> str:
    return f"| `{link.source}` to `{link.target}` | {'' if link.factor == 1 else f'{link.factor:.9g}'} |"


def _table(title: str, variables: Iterable[ModelVariable]) -> str:
    columns = ["Name", "Unit", "Start", "Range", "During a run", "Description"]
    rows = []
    for variable in variables:
        limits = [limit for limit in (variable.min, variable.max) if limit is not None]
        cells = [
            f"<code>{escape(variable.name)}</code>",
            escape(variable.unit or ""),
            escape(variable.start or ""),
            escape(" to ".join(limits) if len(limits) == 2 else "".join(limits)),
            variable.variability if variable.causality == "parameter" else "",
            escape(variable.description or ""),
        ]
        rows.append(cells)
    return f"<h2>{title}</h2>\n{documentation.table(columns, rows)}"


def _cell(text: str) -> str:
    return text.replace("|", r"\|")
