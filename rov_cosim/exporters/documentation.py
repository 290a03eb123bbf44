"""The pages inside an FMU: documentation/index.html from the component's page and interface, icon and licences."""

import re
from collections.abc import Callable, Iterable, Sequence
from html import escape
from importlib.metadata import distribution
from importlib.resources import files
from io import BytesIO
from itertools import count
from string import Template

import latex2mathml.converter
import numpy as np
from markdown_it import MarkdownIt
from mdit_py_plugins.dollarmath import dollarmath_plugin
from PIL import Image, ImageDraw, ImageFont

from ..components.interface import Component, Signal
from .model_description import literal

_HEADING = re.compile("<h2>(.*?)</h2>")
_RELATIVE_LINK = re.compile(r"\[([^]]+)]\((?!\w+:)[^)]*\)")


def names(signal: Signal) -> str:
    """Return the names of a signal's elements in short, for example ``u[1..8]``."""
    return (signal.pattern or signal.key).format(*_labels(signal))


def array(signal: Signal) -> str:
    """Return the name of a signal as an array and its elements in short, for example ``u (1..8)``."""
    return f"{signal.name} ({' by '.join(_labels(signal))})" if signal.axes else signal.name


def entries(component: Component, packages: Iterable[str], named: Callable[[Signal], str] = names) -> dict[str, bytes]:
    """Return documentation and icon of a component's FMU, and the licences of the packages in it, by name.

    `named` returns what the FMU calls a signal.
    """
    return around(page(component, named), component.symbol, packages)


def around(page: str, symbol: str, packages: Iterable[str]) -> dict[str, bytes]:
    """Return a page, an icon that bears a symbol, and the licences of packages, by their names in an FMU."""
    content = {"documentation/index.html": page.encode(), "model.png": icon(symbol)}
    for package in packages:
        for file in distribution(package).files or ():
            if file.name == "LICENSE":
                content[f"documentation/licenses/{package}.txt"] = file.read_text(encoding="utf-8").encode()
    return content


def page(component: Component, named: Callable[[Signal], str] = names) -> str:
    """Return the HTML page: the component's README with its maths, then the tables of its interface."""
    groups = [("Inputs", component.inputs), ("Outputs", component.outputs), ("Parameters", component.parameters)]
    tables = "".join(f"<h2>{title}</h2>\n{_table(title, signals, named)}" for title, signals in groups)
    return html(component.title, readme(component), tables)


def readme(component: Component) -> str:
    """Return the component's page in Markdown, for where it stands alone: links into the project become their text."""
    folder = files(f"{__package__.rsplit('.', 1)[0]}.components.{component.name}")
    return _RELATIVE_LINK.sub(r"\1", folder.joinpath("README.md").read_text(encoding="utf-8"))


def html(title: str, markdown: str, more: str = "") -> str:
    """Return a page from Markdown with a title and maths, and more HTML after it.

    Its headings of the second level are its contents.
    """
    body = _markdown().render(markdown) + more
    headings = _HEADING.findall(body)
    numbers = count()
    body = _HEADING.sub(lambda heading: f'<h2 id="s{next(numbers)}">{heading[1]}</h2>', body)
    for wide in ("<table>.*?</table>", '<math [^>]*display="block".*?</math>', "<img [^>]*>"):
        body = re.sub(wide, r'<div class="scrolls" tabindex="0">\g<0></div>', body, flags=re.DOTALL)
    contents = "\n".join(f'<li><a href="#s{i}">{text}</a></li>' for i, text in enumerate(headings))
    template = Template(files(__package__).joinpath("page.html.in").read_text(encoding="utf-8"))
    heading, end, rest = body.partition("</h1>\n")
    return template.substitute(title=escape(title), heading=heading + end, contents=contents, body=rest)


def table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of variables; columns are text, cells HTML. On a narrow screen each row is a list."""
    head = "".join(f"<th>{escape(column)}</th>" for column in columns)
    lines = [f'<table class="variables">\n<thead><tr>{head}</tr></thead>\n<tbody>']
    for row in rows:
        cells = [f'<td data-label="{escape(column)}">{cell}</td>' for column, cell in zip(columns, row, strict=True)]
        lines.append(f"<tr>{''.join(cells)}</tr>")
    return "\n".join([*lines, "</tbody>\n</table>\n"])


def icon(symbol: str) -> bytes:
    """Return a PNG of 128 x 128 pixels that bears the symbol."""
    size = 128
    image = Image.new("RGBA", (size, size), (0, 0, 0, 0))
    draw = ImageDraw.Draw(image)
    draw.rounded_rectangle((4, 4, size - 5, size - 5), radius=20, fill="#0b3c5d", outline="#328cc1", width=4)
    draw.text((size / 2, size / 2 - 4), symbol, fill="white", anchor="mm", font=ImageFont.load_default(44))
    wave = [(x, 100 + 5 * np.sin(x / 8)) for x in range(20, size - 20)]
    draw.line(wave, fill="#328cc1", width=4)
    png = BytesIO()
    image.save(png, "PNG")
    return png.getvalue()


def _markdown() -> MarkdownIt:
    def mathml(latex: str, options: dict[str, bool]) -> str:
        return latex2mathml.converter.convert(latex, display="block" if options["display_mode"] else "inline")

    return MarkdownIt().enable("table").use(dollarmath_plugin, renderer=mathml)


def _table(title: str, signals: tuple[Signal, ...], named: Callable[[Signal], str]) -> str:
    columns = ["Name", "Unit", "Range", "Description"]
    if title != "Outputs":
        columns.insert(2, "Start")
    if title == "Parameters":
        columns.insert(4, "During a run")
    rows = []
    for signal in signals:
        cells = {
            "Name": f"<code>{escape(named(signal))}</code>",
            "Unit": escape(", ".join(dict.fromkeys(signal.units))),
            "Start": _start(signal),
            "Range": "" if signal.type == "Boolean" else _range(signal),
            "During a run": "tunable" if signal.tunable else "fixed",
            "Description": escape(signal.description),
        }
        rows.append([cells[column] for column in columns])
    return table(columns, rows)


def _labels(signal: Signal) -> list[str]:
    """Return the labels along each axis in short."""
    return [f"1..{len(axis)}" if axis[0] == "1" else "/".join(axis) for axis in signal.axes]


def _start(signal: Signal) -> str:
    """Return the start values, a line for each row of a table."""
    values = [_short(value, signal) for value in signal.elements(signal.start)]
    if len(signal.axes) < 2:
        return _summary(values)
    width = signal.shape[-1]
    return "<br>".join(", ".join(values[i : i + width]) for i in range(0, len(values), width))


def _summary(values: list[str] | tuple[str, ...]) -> str:
    """Return the values, or the one that they all are."""
    return values[0] if len(set(values)) == 1 else ", ".join(values)


def _short(value: float, signal: Signal) -> str:
    return f"{value:.4g}" if signal.type == "Real" else literal(value, signal.type)


def _range(signal: Signal) -> str:
    low, high = signal.elements(signal.minimum), signal.elements(signal.maximum)
    parts = []
    for label, values, side in (("≥", low, -np.inf), ("≤", high, np.inf)):
        limited = values[values != side]
        if limited.size:
            which = f" ({', '.join(np.array(signal.names)[values != side])})" if limited.size < signal.size else ""
            parts.append(f"{label} {_summary([f'{value:.4g}' for value in limited])}{which}")
    return ", ".join(parts)
