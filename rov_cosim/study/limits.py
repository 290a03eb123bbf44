"""What a run must keep to pass: a limit for each score that is named."""

from collections.abc import Mapping
from dataclasses import fields
from math import degrees, isfinite
from typing import Any, NamedTuple

from ..ssp.wiring import suggestion
from .scores import CAPSIZED, LOST, VERDICTS, Score

Limits = Mapping[str, float | str]
"""By score: at most this number, in SI units, or no worse a verdict."""
MEASURES = tuple(f.name for f in fields(Score) if f.name not in ("verdict", "reason", "lost_at"))
"""The scores that are numbers; the less, the better."""
UNITS = {
    "settling": "s",
    "effort": "N",
    "chattering": "N/s",
    "saturated": "1",
    "wrong_force": "N",
    "wrong_moment": "N m",
    "tilt": "rad",
}
UNITS |= {
    name: "rad" if name.endswith("yaw") else "m" for base in ("mean", "rms", "worst") for name in (base, f"{base}_yaw")
}
OF_POSE = ("verdict", *(name for name, unit in UNITS.items() if unit in ("m", "rad", "s")))
"""The scores that tell where the vehicle is, and not what the controller does."""
_LOSS = "beyond it the vehicle is lost"
_SAYS_NOTHING = {
    **{n: (LOST["psi" if unit == "rad" else "x"], _LOSS) for n, unit in UNITS.items() if unit in ("m", "rad")},
    "tilt": (CAPSIZED, _LOSS),
    "saturated": (1.0, "it is a share"),
}
"""By score the limit from which on it says nothing more, and why."""


class Broken(NamedTuple):
    """A limit that a run does not keep."""

    name: str
    limit: float | str
    score: Score

    def __str__(self) -> str:
        if isinstance(self.limit, str):
            return f"verdict {self.score}".rstrip(".") + f"{self._size()}; at worst {self.limit}"
        value = getattr(self.score, self.name)
        if value is None:
            told = "not before the hold" if self.name == "settling" else "not told"
            return f"{self.name} {told}; at most {shown(self.name, self.limit)}"
        return f"{self.name} {shown(self.name, value)}; at most {shown(self.name, self.limit)}"

    def _size(self) -> str:
        """Return what makes the verdict, of a vehicle that is not lost."""
        size = {"offset": "mean", "oscillates": "rms"}.get(self.score.verdict, "")
        values = {name: getattr(self.score, name) for name in (size, f"{size}_yaw")} if size else {}
        return f" with {', '.join(f'{name} {shown(name, value)}' for name, value in values.items())}" if values else ""


def broken(score: Score, limits: Limits) -> list[Broken]:
    """Return the limits that a run does not keep; a score that it has not is beyond any."""
    return [Broken(name, limit, score) for name, limit in limits.items() if not _kept(getattr(score, name), limit)]


def problem_of(name: str, limit: Any) -> str:
    """Return what is wrong with a limit, one that nothing could break or keep included; nothing if it is one."""
    if name == "verdict":
        passing = VERDICTS[:-1]
        return "" if limit in passing else f"verdict: expected the worst that passes, {' or '.join(passing)}."
    if name not in MEASURES:
        known = ["verdict", *MEASURES]
        return f"there is no score {name}; expected {', '.join(known)}.{suggestion(name, known)}"
    if type(limit) not in (int, float) or not isfinite(limit):
        return f"{name}: expected the largest number that passes, got {limit!r:.60}."
    if limit < 0:
        return f"{name} is never below 0, so that none would pass at most {limit:g}."
    most, why = _SAYS_NOTHING.get(name, (float("inf"), ""))
    if limit >= most:
        return f"{name}: at most {shown(name, limit)} says nothing; take less than {shown(name, most)}, for {why}."
    return ""


def shown(name: str, value: float) -> str:
    """Return a score with its unit, lengths below 1 m in mm and angles in degrees."""
    unit = UNITS[name]
    if unit == "m" and value < 1:
        return f"{1e3 * value:.4g} mm"
    return f"{degrees(value):.4g} deg" if unit == "rad" else f"{value:.4g} {unit}".removesuffix(" 1")


def _kept(value: Any, limit: float | str) -> bool:
    if isinstance(limit, str):
        return VERDICTS.index(value) <= [*VERDICTS].index(limit)  # type: ignore[arg-type]
    return value is not None and bool(value <= limit)
