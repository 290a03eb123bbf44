"""The paper on one page of Markdown: figures, claims and gaps, all by runs; and the moving picture of the README."""

from collections.abc import Iterable, Iterator
from pathlib import Path

from .claim import Claim
from .claims import claims
from .experiment import EXPERIMENT, EXPERIMENT_PD
from .figures import Drawn, figures
from .inferred import Inferred, inferred
from .settling import settling

PAGE, PICTURES, MOVING = "PAPER.md", "paper", "settling.svg"
"""The page, the folder of its figures, and the moving picture."""

_HEAD = """\
# The paper, and what its systems do here

Written by `{command}`; every number is of a run. Hoang & Kreuzer, *Adaptive PD-controller for positioning of a
remotely operated vehicle close to an underwater structure: Theory and experiments*, Control Engineering Practice 15
(2007) 411-419.
"""
_FIGURES = """
## Figures

On the paper's axes where our curves fit.
"""
_CLAIMS = """
## What it says

A claim is confirmed if the numbers beside it say so; the command under it repeats them. Where the paper does not tell a
value and one was chosen to agree, the agreement is no evidence, and the verdict says so.
"""
_INFERRED = """
## What it leaves open

What was taken instead, and what other values give. Each command is one of these runs.
"""


def write(folder: Path, command: str) -> list[Path]:
    """Write page and pictures into a folder; return their paths.

    Raises
    ------
    ExperimentError : a run failed.
    OSError : the folder cannot be written.
    """
    drawn = figures()
    content = {PAGE: page(drawn, claims(), inferred(), command), MOVING: settling(EXPERIMENT, EXPERIMENT_PD)}
    content |= {f"{PICTURES}/{one.name}.svg": one.svg for one in drawn}
    (folder / PICTURES).mkdir(parents=True, exist_ok=True)
    for name, text in content.items():
        (folder / name).write_text(text, encoding="utf-8")
    return [folder / name for name in content]


def page(drawn: Iterable[Drawn], said: Iterable[Claim], open_: Iterable[Inferred], command: str) -> str:
    """Return the page in Markdown."""
    return "\n".join(
        [
            _HEAD.format(command=command),
            f"![The vehicle comes to its set-point; PD stays off]({MOVING})",
            _FIGURES,
            *_figures(drawn),
            _CLAIMS,
            *(line for claim in said for line in _claim(claim)),
            _INFERRED,
            *(line for one in open_ for line in _gap(one)),
        ]
    )


def _figures(drawn: Iterable[Drawn]) -> Iterator[str]:
    for one in drawn:
        yield f"![{one.caption}]({PICTURES}/{one.name}.svg)"
        yield ""
        yield f"{f'*{one.number}.* ' if one.number else ''}{one.caption}"
        yield ""


def _claim(claim: Claim) -> Iterator[str]:
    yield f"- **{claim.paper_says}** ({claim.where}): **{claim.verdict}**."
    yield f"  {claim.measured[0].upper()}{claim.measured[1:]}."
    yield ""
    yield f"  `{claim.command}`"
    yield ""


def _gap(one: Inferred) -> Iterator[str]:
    yield f"- **{one.what}**: {one.taken}; {one.why}."
    yield f"  {one.sensitivity[0].upper()}{one.sensitivity[1:]}."
    yield ""
    yield f"  `{one.command}`"
    yield ""
