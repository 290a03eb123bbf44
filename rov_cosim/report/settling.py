"""The vehicle settling, as an SVG that moves by itself: PD beside adaptive PD, the arm, and the error over time.

Where the reader wants no motion it shows the end.
"""

from collections.abc import Iterable

import numpy as np

from ..components.frames import rotation
from ..components.interface import POSE, XYZ, count
from .drawing import DARK, FAINT, INK, LINES
from .experiment import Experiment, Series

SECONDS, SPEED = 40.0, 4.0
"""How much of the run is shown, and how many times as fast."""

_EVERY = 0.5
_WIDTH, _HEIGHT, _SCALE, _CENTRE = 720, 470, 235.0, (330.0, 195.0)
_AZIMUTH, _ELEVATION = np.radians(-55.0), np.radians(22.0)
_HALF = np.array([0.4, 0.25, 0.275])
"""Half the vehicle's length, width and height in m (Hoang & Kreuzer 2007, section 4.2)."""

_UMBILICAL = np.array([[0, 0, 0], [-0.2, -0.1, 0.5], [-0.4, 0.3, 1.2]])
"""Points of the umbilical in m, from where it is fastened."""

_PLOT = (60.0, 380.0, 630.0, 60.0)
"""Left, top, width and height of the error over time."""

_COLOURS = {"ink": INK, "faint": FAINT, "adaptive": LINES[0], "pd": LINES[1]}
_SHAPES = """\
svg { font: 13px system-ui, 'DejaVu Sans', sans-serif; }
path { fill: none; stroke-width: 1.6; stroke-linejoin: round; stroke-linecap: round; }
.pd { stroke-dasharray: 6 4; }
.thin { stroke-width: 1; }
.dotted { stroke-dasharray: 1 4; }
.thick { stroke-width: 5; opacity: .8; }
.bow { fill-opacity: .3; }
.still { display: none; }
@media (prefers-reduced-motion: reduce) { .moving { display: none; } .still { display: inline; } }
"""


def settling(adaptive: Experiment, pd: Experiment) -> str:
    """Return the SVG of two runs of the loop with arm, the same but for the adaptation.

    Raises
    ------
    ExperimentError : a run failed.
    """
    rows = [int(np.searchsorted(adaptive.time, t - 1e-9)) for t in np.arange(0, SECONDS + _EVERY / 2, _EVERY)]
    poses, offsets = (run.group("rov_plant.eta", POSE)[rows] for run in (adaptive, pd))
    arm = _arm(adaptive, rows)
    umbilical = [
        _line(base + _UMBILICAL, "Q")
        for base in (_placed(eta, [_vector(adaptive, "rov_plant.r_C")])[0] for eta in poses)
    ]
    bow = [np.array([[1, y, z] for y, z in ((1, 1), (1, -1), (-1, -1), (-1, 1))]) * _HALF]
    parts = [
        _path([_pile(_vector(adaptive, "passive_arm.attachment"))], "faint fill"),
        _path([_frame(np.zeros(6))], "ink thin dotted"),
        _path([_frame(eta) for eta in offsets], "pd"),
        _path(umbilical, "ink thin"),
        _path([_line(_placed(eta, bow[0])) + "Z" for eta in poses], "adaptive bow"),
        _path([_frame(eta) for eta in poses], "adaptive"),
        _path([_line(points) for points in arm], "ink thick"),
        *_error(adaptive, pd),
    ]
    words = "An underwater vehicle comes to its set-point: adaptive PD reaches it, PD stays off."
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img">',
            f"<title>{words}</title>",
            f"<style>\n{_SHAPES}{_coloured(_COLOURS)}@media (prefers-color-scheme: dark) {{\n"
            f"{_coloured({name: DARK[colour] for name, colour in _COLOURS.items()})}}}\n</style>",
            *parts,
            "</svg>\n",
        ]
    )


def _arm(run: Experiment, rows: list[int]) -> list[Series]:
    """Return shoulder, elbow and wrist, shape (3, 3) for each row, in m in the earth frame."""
    q = run.group("passive_arm", tuple(f"q[{i}]" for i in count(6)))[rows]
    shoulder, wrist = _vector(run, "passive_arm.r_A"), _vector(run, "passive_arm.attachment")
    forearm = run.value("passive_arm.L[1]") * np.stack(
        [np.cos(q[:, 1]) * np.cos(q[:, 0]), np.cos(q[:, 1]) * np.sin(q[:, 0]), -np.sin(q[:, 1])], axis=1
    )
    poses = run.group("rov_plant.eta", POSE)[rows]
    return [
        np.vstack([_placed(eta, [shoulder, shoulder + link]), wrist]) for eta, link in zip(poses, forearm, strict=True)
    ]


def _error(adaptive: Experiment, pd: Experiment) -> Iterable[str]:
    """Yield the distance from the set-point over time, and what moves over it."""
    left, top, width, height = _PLOT
    bottom = top + height
    every = slice(None, None, 10)
    distances = [np.linalg.norm(run.errors[every, :3], axis=1)[run.time[every] <= SECONDS] for run in (pd, adaptive)]
    most = max(float(distance.max()) for distance in distances)
    for distance, name in zip(distances, ("pd", "adaptive"), strict=True):
        along = left + width * np.linspace(0, 1, len(distance))
        yield _path([_through(along, bottom - height * distance / most)], name)
    yield _path([f"M{left:g},{top:g}V{bottom:g}H{left + width:g}"], "ink thin")
    times = np.linspace(left, left + width, round(SECONDS / _EVERY) + 1)
    yield _path([f"M{x:.1f},{top:g}V{bottom:g}" for x in times], "ink thin")
    for x, y, anchor, text in (
        (left, bottom + 18, "start", "0"),
        (left + width, bottom + 18, "end", f"{SECONDS:g} s, shown {SPEED:g} times as fast"),
        (left - 6, top + 10, "end", f"{most:.1f} m"),
        (left + width / 2, bottom + 18, "middle", "distance from the set-point"),
    ):
        yield f'<text class="ink fill" x="{x:g}" y="{y:g}" text-anchor="{anchor}">{text}</text>'
    for y, name, text in ((24, "adaptive", "adaptive PD"), (44, "pd", "PD"), (64, "ink thin dotted", "set-point")):
        yield _path([f"M20,{y}h34"], name)
        yield f'<text class="ink fill" x="62" y="{y + 4}">{text}</text>'


def _through(x: Series, y: Series) -> str:
    """Return a path through points in pixels."""
    return "M" + " ".join(f"{a:.0f},{b:.1f}" for a, b in zip(x, y, strict=True))


def _pile(at: Series) -> str:
    """Return the structure: a pile through a point."""
    x, y = _seen(np.array([at[:3]]))[0]
    return f"M{x - 4:.0f},0H{x + 44:.0f}V{y + 240:.0f}H{x - 4:.0f}Z"


def _frame(eta: Series) -> str:
    """Return the edges of the vehicle."""
    square = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]])
    top, bottom = (_placed(eta, np.column_stack([square, np.full(4, z)]) * _HALF) for z in (1, -1))
    edges = [_line(np.array(pair)) for pair in zip(top, bottom, strict=True)]
    return "".join([_line(top), "Z", _line(bottom), "Z", *edges])


def _placed(eta: Series, points: Iterable[Series] | Series) -> Series:
    """Return body points, shape (n, 3), in the earth frame."""
    R = np.asarray(rotation(eta[3:6]))
    placed: Series = np.asarray(points) @ R.T + eta[:3]
    return placed


def _seen(points: Series) -> Series:
    """Return points, shape (n, 3) in m, as they are seen, shape (n, 2) in pixels."""
    c, s = np.cos(_AZIMUTH), np.sin(_AZIMUTH)
    right, away = c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1]
    up = np.cos(_ELEVATION) * points[:, 2] + np.sin(_ELEVATION) * away
    return np.column_stack([_CENTRE[0] + _SCALE * right, _CENTRE[1] - _SCALE * up])


def _line(points: Series | list[Series], to: str = "L") -> str:
    """Return a path through points, or a curve."""
    first, *rest = (f"{x:.0f},{y:.0f}" for x, y in _seen(np.asarray(points)))
    return f"M{first}{to}{' '.join(rest)}"


def _path(shapes: list[str], name: str) -> str:
    """Return a path that goes through shapes in turn, and where nothing is to move, its last."""
    if len(shapes) == 1:
        return f'<path class="{name}" d="{shapes[0]}"/>'
    duration = f'dur="{SECONDS / SPEED + 1:g}s" repeatCount="indefinite"'
    share = SECONDS / SPEED / (SECONDS / SPEED + 1)  # it rests for a second at its end
    times = ";".join(f"{share * i / (len(shapes) - 1):.4f}".rstrip("0") for i in range(len(shapes)))
    values = ";".join([*shapes, shapes[-1]])
    moving = f'<animate attributeName="d" {duration} keyTimes="{times};1" values="{values}"/>'
    return (
        f'<path class="{name} moving" d="{shapes[-1]}">{moving}</path>\n<path class="{name} still" d="{shapes[-1]}"/>'
    )


def _vector(run: Experiment, name: str) -> Series:
    return np.array([run.value(f"{name}.{axis}") for axis in XYZ])


def _coloured(colours: dict[str, str]) -> str:
    return "".join(
        f".{name} {{ stroke: {colour}; }} .{name}.fill, .{name}.bow {{ fill: {colour}; }}\n"
        for name, colour in colours.items()
    ) + ("text { stroke: none !important; }\n")
