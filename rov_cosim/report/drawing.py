"""Drawings of one panel as SVG with text as text, for any page, on a light screen or a dark one.

They have no ground, and a style sheet of their own that changes ink and lines on a dark screen.
"""

import io
import re
from collections.abc import Callable

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

DARK = {
    "#1b2733": "#d7e1ea",
    "#c5d3de": "#34434f",
    "#0b5c8e": "#58b4e5",
    "#b3470b": "#f2955a",
    "#3c7a2b": "#8acb6f",
    "#8a3d87": "#d99ad6",
}
"""What each colour becomes on a dark screen. No two lines of a figure differ in colour alone."""

INK, FAINT, *LINES = DARK
"""Of text and axes, of the grid, and of lines."""

STYLES = ("-", "--", "-.", ":")

_STYLE = "".join(
    f"[style*='{kind}: {light}'] {{ {kind}: {dark} !important }}\n"
    for light, dark in DARK.items()
    for kind in ("fill", "stroke")
)
_SIZE, _DPI = (4.4, 3.0), 72
_FONTS = re.compile(r"'DejaVu Sans'[^;\"]*")
_PLAIN_ID = re.compile(r' id="[a-zA-Z]+\w*_\d+"')


def drawn(draw: Callable[[Axes], None]) -> str:
    """Return a figure of one panel over time as SVG."""
    figure = Figure(figsize=_SIZE, layout="constrained")
    axes = figure.add_subplot()
    with matplotlib.rc_context({"lines.linewidth": 1.4, "legend.fontsize": 9, "legend.frameon": False}):
        draw(axes)
    look(axes)
    axes.set_xlabel("time [s]", color=INK)
    for legend in figure.findobj(matplotlib.legend.Legend):
        for text in legend.get_texts():
            text.set_color(INK)
    return _svg(figure)


def look(axes: Axes) -> None:
    """Give axes grid and ink."""
    axes.grid(color=FAINT, linewidth=0.6)
    axes.set_facecolor("none")
    axes.tick_params(colors=INK, which="both", labelsize=9)
    axes.yaxis.label.set_color(INK)
    for spine in axes.spines.values():
        spine.set_color(INK)


def _svg(figure: Figure) -> str:
    """Return a figure as SVG without head and identifiers, so that many fit into one page."""
    file = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "rov-cosim", "svg.fonttype": "none", "path.simplify_threshold": 0.3}):
        figure.savefig(file, format="svg", dpi=_DPI, transparent=True, metadata={"Date": None})
    text = file.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r" *<metadata>.*?</metadata>\n", "", text, flags=re.DOTALL)
    text = _FONTS.sub("system-ui, 'DejaVu Sans', sans-serif", text)
    text = text.replace("</style>", f"\n@media (prefers-color-scheme: dark) {{\n{_STYLE}}}</style>", 1)
    return _PLAIN_ID.sub("", text)
