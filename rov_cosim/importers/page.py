"""The page docs/IMPORTERS.md: which tools import the FMUs, and how far their results are from ours."""

import re
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from importlib.resources import files
from pathlib import Path

from ..exporters.build import fmu_path, project_root
from ..handover.kit import importing_page
from ..study import archives
from ..systems.catalogue import SYSTEMS
from .measuring import CONTROLLER, SYSTEM, ImporterError, measure
from .tools import IMPORTERS

Rows = dict[str, tuple[str, ...]]

_COLUMNS = (
    *("tool", "version", "measured", "controller: largest deviation", "system: largest deviation"),
    *("stated tolerance", "note"),
)
_NOTHING = ("not installed when this was written", "", "", "")


def write_page(page: Path, progress: Callable[[Iterable[str], str], Iterable[str]]) -> list[str]:
    """Write IMPORTERS.md with the tools that are installed measured anew, and return what keeps others from it.

    A tool that is not installed, fails, or departs by more than its tolerance keeps the row that the page has.

    Parameters
    ----------
    page : the page, which may be there.
    progress : hands the names of the tools on and shows them.

    Raises
    ------
    BuildError : the FMUs cannot be built.
    """
    rows = measured(page.read_text(encoding="utf-8")) if page.is_file() else {}
    archives.build(SYSTEMS[SYSTEM])
    failures = []
    installed = [name for name, importer in IMPORTERS.items() if importer.version()]
    for name in progress(installed, "tool"):
        try:
            rows[IMPORTERS[name].title] = _measured_anew(name)
        except ImporterError as error:
            failures.append(str(error))
    page.parent.mkdir(exist_ok=True)
    text = (files(__package__) / "importers.md.in").read_text(encoding="utf-8")
    page.write_text(text.format(table=table(rows), importing=importing_page()), encoding="utf-8")
    return failures


def table(rows: Rows) -> str:
    """Return the table of all tools in Markdown."""
    lines = [_COLUMNS, ("---",) * len(_COLUMNS)]
    for tool in IMPORTERS.values():
        lines.append((tool.title, *rows.get(tool.title, _NOTHING), f"{tool.tolerance:g}", tool.note))
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def measured(page: str) -> Rows:
    """Return what the table of a page holds."""
    lines = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| ")]
    dated = (cells for cells in lines if len(cells) == len(_COLUMNS) and re.fullmatch(r"\d{4}-\d\d-\d\d", cells[2]))
    return {cells[0]: tuple(cells[1:5]) for cells in dated}


def _measured_anew(name: str) -> tuple[str, ...]:
    importer = IMPORTERS[name]
    fmu, archive = fmu_path(project_root(), CONTROLLER), archives.ssp_path(SYSTEM)
    found = [measure(name, "controller", fmu), measure(name, "loop", archive)]
    if not max(found) <= importer.tolerance:
        raise ImporterError(f"{importer.title} departs by {max(found):g}, more than {importer.tolerance:g}.")
    deviations = (f"{value:.1e}" if value else "0" for value in found)
    return (str(importer.version()), f"{datetime.now(UTC):%Y-%m-%d}", *deviations)
