"""What stands below the live loop, as HTML: figures, claims, what was inferred, the certificate."""

import re
from collections import Counter
from collections.abc import Callable, Iterable
from html import escape

from ..study import certificate_page
from .claim import CONFIRMED, NOT, Claim
from .claims import claims
from .experiment import EXPERIMENT, Experiment
from .figures import Drawn, figures
from .inferred import Inferred, inferred
from .page import Section

_MARKS = {CONFIRMED: "held", NOT: "lost"}
"""The page's colours and signs of verdicts on claims; what is in part is as an offset."""

_PROLOGUE = re.compile(r"^.*?(?=<svg)", re.DOTALL)


def all_of(progress: Callable[[str], object] = lambda line: None) -> list[Section]:
    """Return all sections; every number in them is computed here.

    Raises
    ------
    ExperimentError : a run failed.
    """
    progress("running the paper's experiments")
    stated = claims()
    progress("drawing its figures")
    drawn = figures()
    progress("varying what was inferred")
    return [_figures(drawn), _claims(stated), _inferred(inferred()), _certificate(EXPERIMENT)]


def _figures(drawn: Iterable[Drawn]) -> Section:
    shown = "\n".join(
        f"<figure>{_PROLOGUE.sub('', one.svg)}<figcaption>{f'<b>{escape(one.number)}</b> ' if one.number else ''}"
        f"{escape(one.caption)}</figcaption></figure>"
        for one in drawn
    )
    text = "<p>Numbered as in the paper and on its axes, and some that it has not.</p>"
    return Section("figures", "The paper's figures", f'{text}\n<div class="figures">{shown}</div>')


def _claims(stated: Iterable[Claim]) -> Section:
    stated = list(stated)
    found = Counter(one.verdict for one in stated)
    counted = "; ".join(f"{n} {verdict}" for verdict, n in found.items())
    text = f"<p>{counted}. Each command repeats what stands beside it. Where the paper does not tell a "
    text += "value and one was chosen to agree, the agreement is no evidence.</p>"
    rows = (
        (
            escape(one.paper_says),
            escape(one.where),
            f"{escape(one.measured)}{_command(one.command)}",
            f'<span class="verdict {_MARKS.get(one.verdict, "offset")}">{escape(one.verdict)}</span>',
        )
        for one in stated
    )
    return Section(
        "claims",
        "What the paper says, and what is measured",
        text + _table(("The paper", "where", "here", "verdict"), rows),
    )


def _inferred(found: Iterable[Inferred]) -> Section:
    text = "<p>The paper leaves these open; here is what was taken for each, and what it matters.</p>"
    rows = (
        (
            escape(one.what),
            f"{escape(one.taken)}: {escape(one.why)}",
            f"{escape(one.sensitivity)}{_command(one.command)}",
        )
        for one in found
    )
    return Section(
        "inferred", "What was inferred", text + _table(("what", "taken, and why", "what other values give"), rows)
    )


def _certificate(experiment: Experiment) -> Section:
    lines = certificate_page.page(experiment.certificate)
    text = f"<p>Why it holds, before it is run.</p>{_command(f'{experiment.certify} --states 0')}"
    return Section(
        "certificate", "Certificate of the gains in use", f"{text}\n<pre>{escape(chr(10).join(lines))}</pre>"
    )


def _command(command: str) -> str:
    return f"<details><summary>command</summary><code>{escape(command)}</code></details>" if command else ""


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a table of cells that are HTML; on a narrow screen each cell stands below its head."""
    names = list(head)
    heads = "".join(f'<th scope="col">{name}</th>' for name in names)
    lines = (
        "".join(f'<td data-head="{name}">{cell}</td>' for name, cell in zip(names, row, strict=True)) for row in rows
    )
    body = "\n".join(f"<tr>{line}</tr>" for line in lines)
    return f'<table class="prose"><thead><tr>{heads}</tr></thead><tbody>\n{body}\n</tbody></table>'
