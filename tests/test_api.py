"""The public names, and the examples of their page."""

import doctest
import tomllib
from pathlib import Path

import rov_cosim

PAGE = Path(__file__).parent.parent / "docs" / "API.md"


def test_the_examples_of_the_page_run(fmus, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    failed, attempted = doctest.testfile(str(PAGE), module_relative=False, optionflags=doctest.ELLIPSIS)
    assert attempted > 20
    assert failed == 0


def test_every_public_name_is_there_and_on_the_page():
    page = PAGE.read_text(encoding="utf-8")
    for name in rov_cosim.__all__:
        assert getattr(rov_cosim, name) is not None
        assert f"`{name}" in page
    assert set(rov_cosim.__all__) == set(rov_cosim._HOMES)
    project = tomllib.loads((PAGE.parent.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert rov_cosim.__version__ == project["version"]
