"""The wiring of a system as a picture: its elements in a row, arrows for what one hands to another."""

from pathlib import Path

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from ..ssp.swap_map import stem
from ..ssp.wiring import Wiring
from .plots import save

_WIDTH, _HEIGHT, _GAP, _MARGIN = 1.9, 0.8, 1.6, 0.15
_INCHES = 0.95
"""Size of a unit of length of the drawing."""
_BEND = 0.32
"""Height of an arc that passes over elements, as a share of its length."""


@rc_context({"text.parse_math": False})  # a name with dollars is no formula
def draw_wiring(wiring: Wiring, path: Path) -> None:
    """Draw the elements with their FMUs, and the groups of variables that the links carry, as PNG or SVG.

    What goes on is drawn above, what goes back below.
    """
    places = {element.name: i * (_WIDTH + _GAP) for i, element in enumerate(wiring.elements)}
    figure = Figure()
    panel = figure.add_axes((0, 0, 1, 1))
    for element in wiring.elements:
        x, fmu = places[element.name], element.description.modelName
        box = FancyBboxPatch(
            (x, 0), _WIDTH, _HEIGHT, boxstyle="round,pad=0.05", facecolor="#eaf1f6", edgecolor="#0b3c5d", linewidth=1.5
        )
        panel.add_patch(box)
        name = element.name if fmu == element.name else f"{element.name}\n{fmu}.fmu"
        panel.text(x + _WIDTH / 2, _HEIGHT / 2, name, ha="center", va="center", fontsize=11, color="#0b3c5d")
    reaches = [0.0]
    for (source, target), groups in _bundles(wiring).items():
        reaches.append(_draw_arrow(panel, places[source], places[target], ", ".join(groups)))
    left, right = -_MARGIN, max(places.values()) + _WIDTH + _MARGIN
    bottom, top = min(reaches) - _MARGIN, _HEIGHT + max(reaches) + _MARGIN
    panel.set_xlim(left, right)
    panel.set_ylim(bottom, top)
    panel.set_axis_off()
    figure.set_size_inches(_INCHES * (right - left), _INCHES * (top - bottom))
    save(figure, path)


def _bundles(wiring: Wiring) -> dict[tuple[str, str], list[str]]:
    """Return by source and target the groups of outputs that are handed on."""
    found: dict[tuple[str, str], dict[str, None]] = {}
    for source, target, _ in wiring.links:
        found.setdefault((source.element, target.element), {})[stem(source.variable)] = None
    return {pair: list(groups) for pair, groups in found.items()}


def _draw_arrow(panel: Axes, source: float, target: float, label: str) -> float:
    """Draw an arrow between elements at these places; return how far it goes above the boxes, or below, negative."""
    style = {"arrowstyle": "-|>", "color": "#328cc1", "linewidth": 1.4, "shrinkA": 2, "shrinkB": 2}
    if 0 < target - source <= _WIDTH + _GAP:
        begin, end, y = source + _WIDTH + 0.05, target - 0.05, _HEIGHT / 2
        panel.annotate("", (end, y), (begin, y), arrowprops=style)
        panel.text((begin + end) / 2, y + 0.08, label, ha="center", va="bottom", fontsize=9)
        return 0.0
    forwards = target > source
    # The shorter of two arcs ends nearer to the side that it comes from.
    inset = min(0.12 * round(abs(target - source) / (_WIDTH + _GAP)), 0.5) * _WIDTH
    y = _HEIGHT + 0.05 if forwards else -0.05
    begin, end = (source + _WIDTH - inset, target + inset) if forwards else (source + inset, target + _WIDTH - inset)
    reach = _BEND * abs(end - begin) / 2
    panel.annotate("", (end, y), (begin, y), arrowprops={**style, "connectionstyle": f"arc3,rad={-_BEND}"})
    height = y + reach + 0.06 if forwards else y - reach - 0.06
    panel.text((begin + end) / 2, height, label, ha="center", va="bottom" if forwards else "top", fontsize=9)
    return reach + 0.3 if forwards else -(reach + 0.3)
