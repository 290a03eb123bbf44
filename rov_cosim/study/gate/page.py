"""A gate in Markdown, short enough for a pull request: what is red first."""

from collections.abc import Mapping

from ..limits import shown
from .conduct import Outcome, Result


def markdown(outcome: Outcome) -> str:
    """Return a page: the verdict, a line for each thing that is wrong, a table of all cells."""
    lines = [f"## {outcome.verdict}", ""]
    lines += [f"- {line}" for line in outcome.lines]
    lines += [f"- warning: {line}" for line in outcome.warnings]
    lines += ["", "| system | trouble | | verdict | scores of their limits |", "|---" * 5 + "|"]
    for cell, result in outcome.results.items():
        status = {"green": "green", "red": "**red**", "left out": "left out"}[result.status]
        verdict = result.score.verdict if result.score else ""
        lines.append(f"| {cell.system} | {cell.trouble} | {status} | {verdict} | {kept(result)} |")
    lines += ["", "| system | its FMUs |", "|---|---|"]
    lines += [f"| {system} | {called(fmus)} |" for system, fmus in outcome.fmus.items()]
    return "\n".join([*lines, ""])


def kept(result: Result) -> str:
    """Return the scores of a run that have a limit, each with it."""
    if result.score is None:
        return ""
    found = {n: (getattr(result.score, n), limit) for n, limit in result.limits.items() if not isinstance(limit, str)}
    return ", ".join(
        f"{name} {'none' if value is None else shown(name, value)} of {shown(name, limit)}"
        for name, (value, limit) in found.items()
    )


def called(fmus: Mapping[str, str]) -> str:
    """Return elements with the FMUs that they are, where they are called otherwise."""
    return ", ".join(element if element == fmu else f"{element}: {fmu}" for element, fmu in fmus.items())
