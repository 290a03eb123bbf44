"""The notebook, from import to a swapped plant, as a user runs it."""

import re
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).parent.parent / "docs" / "notebook.ipynb"


def test_its_links_lead_somewhere():
    cells = nbformat.read(NOTEBOOK, as_version=4).cells
    links = [t for cell in cells if cell.cell_type == "markdown" for t in re.findall(r"\]\(([^)#:]+)", cell.source)]
    assert len(links) >= 3
    assert [link for link in links if not (NOTEBOOK.parent / link).exists()] == []


def printed(cell):
    return "".join(output.text for output in cell.outputs if output.output_type == "stream" and output.name == "stdout")


def test_no_output_is_committed():
    cells = nbformat.read(NOTEBOOK, as_version=4).cells
    assert all(cell.outputs == [] and cell.execution_count is None for cell in cells if cell.cell_type == "code")


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # those of the kernel's client
def test_the_notebook_runs_and_says_what_its_text_does(fmus, tmp_path):
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    NotebookClient(notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": tmp_path}}).execute()
    told = [line for cell in notebook.cells if cell.cell_type == "code" for line in printed(cell).splitlines()]
    drawn = sum("image/png" in out.get("data", {}) for c in notebook.cells for out in c.get("outputs", ()))
    assert drawn == 3
    assert told[0] == told[-1] == "held"
    assert told[1:4] == ["as it is: held", "slow in z: offset", "never: offset"]
    assert [line.split(",")[0] for line in told[4:6]] == ["current: held", "thruster_lost: held"]
