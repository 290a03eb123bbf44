"""The wiring diagram of a component, as SVG: its ports, and what they are wired to in the loop of this project."""

from html import escape

from ..components.interface import Component, Signal
from ..systems.loop import ARM, SENSORS, connections, element_of

_ROW, _WIDTH, _BOX, _TOP = 34, 1080, (400, 680), 70
_STYLE = (
    "text { font: 14px system-ui, sans-serif; fill: #1b2733; } .far { fill: #5b7083; } .title { font-weight: bold; }"
    " .box { fill: #eaf1f6; stroke: #0b3c5d; } line { stroke: #0b3c5d; stroke-width: 2; }"
    " .free { stroke-dasharray: 5 4; } marker path { fill: #0b3c5d; }"
    " @media (prefers-color-scheme: dark) { text { fill: #d7e1ea; } .far { fill: #9db2c2; }"
    " .box { fill: #18232c; stroke: #58b4e5; } line { stroke: #58b4e5; } marker path { fill: #58b4e5; } }"
)


def wiring_diagram(component: Component) -> str:
    """Return the diagram: inputs on the left, outputs on the right; dashed what the loop does not use."""
    rows = max(len(component.inputs), len(component.outputs))
    height = _TOP + rows * _ROW + 20
    left, right = _BOX
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" width="{_WIDTH}" height="{height}">',
        f"<style>{_STYLE}</style>",
        '<defs><marker id="head" viewBox="0 0 10 10" refX="10" refY="5" markerWidth="8" markerHeight="8" orient="auto">'
        '<path d="M0 0 L10 5 L0 10 z"/></marker></defs>',
        f'<rect x="{left}" y="20" width="{right - left}" height="{height - 40}" rx="10" class="box"/>',
        f'<text x="{_WIDTH / 2}" y="46" text-anchor="middle" class="title">{component.name}</text>',
    ]
    for i, signal in enumerate(component.inputs):
        parts += _port(component, signal, _TOP + i * _ROW, is_input=True)
    for i, signal in enumerate(component.outputs):
        parts += _port(component, signal, _TOP + i * _ROW, is_input=False)
    return "\n".join([*parts, "</svg>", ""])


def _port(component: Component, signal: Signal, y: float, is_input: bool) -> list[str]:
    """Return arrow, name and far end of a port."""
    left, right = _BOX
    far = _far_ends(component.name, signal.key, is_input)
    begin, end = (left - 60, left) if is_input else (right, right + 60)
    name = signal.key + (f" ({signal.size})" if signal.axes else "")
    inside, outside = (left + 12, begin - 10) if is_input else (right - 12, end + 10)
    anchors = ("start", "end") if is_input else ("end", "start")
    style = "" if far else ' class="free"'
    return [
        f'<line x1="{begin}" y1="{y + 10}" x2="{end}" y2="{y + 10}" marker-end="url(#head)"{style}/>',
        f'<text x="{inside}" y="{y + 15}" text-anchor="{anchors[0]}">{escape(name)}</text>',
        f'<text x="{outside}" y="{y + 15}" text-anchor="{anchors[1]}" class="far">{escape(", ".join(far))}</text>',
    ]


def _far_ends(component: str, key: str, is_input: bool) -> list[str]:
    links, port = connections(component if component in SENSORS else ARM), f"{element_of(component)}.{key}"
    turned = [(target, source) if is_input else (source, target) for source, target in links]
    return list(dict.fromkeys(far for near, far in turned if near == port))
