"""The pages as HTML: one file each, that needs neither a network nor a server."""

import json
from collections.abc import Mapping, Sequence
from html import escape
from importlib.metadata import version
from importlib.resources import files
from string import Template
from typing import Any, NamedTuple

from ..study.assessment import AXES

LIBRARIES = (
    "Drawn with three.js (MIT, © three.js authors) and uPlot (MIT, © Leon Sorokin); their notices stand in the script."
)
_ERRORS = {axis: ("yaw error", "in degrees") if axis == "psi" else (f"{axis} error", "in m") for axis in AXES}
_LYAPUNOV = (
    '<figure class="curve wide"><figcaption>Lyapunov function V of the one chosen '
    "<span>in J, by its gains and the true state; dotted: without the estimate</span></figcaption>"
    '<div class="plot" id="plot-lyapunov"></div><p class="small" id="note-lyapunov"></p></figure>'
)
_DETAILS = {
    "unknown": (
        "disturbance of the one chosen",
        'in N, N m; solid: estimated, dotted: true</span> <span class="axes"><b>X</b><b>Y</b><b>Z</b><b>N</b>',
    ),
    "thrust": (
        "thrust commands of the one chosen",
        'in N; dotted: 5 to 8</span> <span class="axes"><b>1 5</b><b>2 6</b><b>3 7</b><b>4 8</b>',
    ),
    "joints": (
        "joint angles of the arm of the one chosen",
        'in degrees; dotted: the wrist</span> <span class="axes"><b>1 4</b><b>2 5</b><b>3 6</b>',
    ),
    "reach": ("reach of its arm", "in m; dotted: the length of its links"),
    "measured": (
        "error of what it measures",
        'in mm: noise, delay, encoders</span> <span class="axes"><b>x</b><b>y</b><b>z</b>',
    ),
    "measured-psi": ("error of the yaw that it measures", "in degrees"),
}


class About(NamedTuple):
    """What a page with the live loop says of itself: above its title, that, below it, and the command that makes it."""

    kicker: str
    title: str
    lead: str
    command: str


PAPER = About(
    "Hoang & Kreuzer 2007, as FMUs",
    "A vehicle held beside a structure against forces that its controller does not know",
    "The paper says that a PD controller, which knows no force, keeps an offset by the pull of umbilical, arm and "
    "buoyancy, and that an adaptive one learns them and comes back. It does: drag a slider and see.",
    "rov-cosim report",
)


class Section(NamedTuple):
    """A part of the page below the live loop: its anchor, its heading, and its HTML."""

    key: str
    title: str
    html: str


REPORT = ("main.js", "worker.js", "page.css")
VIEW = ("main.js", "page.css")
"""What each page is bundled of."""


def report(live: Mapping[str, Any], sections: Sequence[Section], bundled: Sequence[str], about: About = PAPER) -> str:
    """Return the page with the live loop.

    Parameters
    ----------
    live : `live.data`.
    sections : what comes below.
    bundled : the texts of `REPORT`, by `bundle.bundled`.
    about : what it says of itself.
    """
    script, worker, style = bundled
    contents = [("live-title", "The loop"), *((section.key, section.title) for section in sections)] if sections else []
    sizes = sorted({f"{module['size'] / 1e3:.0f}" for module in live["modules"]}, key=int)
    return _filled(
        "report",
        style=style,
        script=_in_script(script),
        worker=_in_script(worker),
        data=_in_script(json.dumps(live, separators=(",", ":"))),
        kicker=escape(about.kicker),
        title=escape(about.title),
        lead=escape(about.lead),
        contents=" ".join(f'<a href="#{key}">{escape(title)}</a>' for key, title in contents),
        sizes=f"{' to '.join(dict.fromkeys((sizes[0], sizes[-1])))} kB a controller, before it is packed",
        curves=_curves(_ERRORS) + _LYAPUNOV + _curves(_DETAILS),
        sections="\n".join(
            f'<section aria-labelledby="{key}"><h2 id="{key}">{escape(title)}</h2>\n{html}</section>'
            for key, title, html in sections
        ),
        footer=f"<p>Made by <code>{about.command}</code>, version {version('rov-cosim')}. {LIBRARIES}</p>",
    )


def view(title: str, data: Mapping[str, Any], bundled: Sequence[str]) -> str:
    """Return the page of a table of results, of `view.data` and the texts of `VIEW`."""
    script, style = bundled
    return _filled(
        "view",
        style=style,
        script=_in_script(script),
        data=_in_script(json.dumps(data, separators=(",", ":"))),
        title=escape(title),
        curves=_curves(_ERRORS),
        footer=f"<p>Made by <code>rov-cosim view</code>, version {version('rov-cosim')}. {LIBRARIES}</p>",
    )


def _curves(named: Mapping[str, tuple[str, str]]) -> str:
    """Return the frames of curves, of name and unit by key."""
    return "".join(
        f'<figure class="curve"><figcaption>{name} <span>{unit}</span></figcaption>'
        f'<div class="plot" id="plot-{key}"></div></figure>'
        for key, (name, unit) in named.items()
    )


def _filled(name: str, **parts: str) -> str:
    template = (files(__package__) / "web" / f"{name}.html.in").read_text(encoding="utf-8")
    return Template(template).substitute(parts)


def _in_script(text: str) -> str:
    """Return text that ends no script element, and begins no comment in one."""
    return text.replace("</script", "<\\/script").replace("<!--", "<\\!--")
