"""The pages as a site: it builds without a warning, reads from disk, and no link in it leads nowhere."""

import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from lxml import html

from rov_cosim.exporters.build import components

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-W", "-q", "-E", "-c", "docs/site", "-d", folder / "kept", "."]
    done = subprocess.run([*command, folder / "html"], cwd=ROOT, capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stderr
    return folder / "html"


@pytest.fixture(scope="module")
def pages(site):
    return {path: html.parse(path).getroot() for path in site.rglob("*.html") if path.parent.name != "_static"}


@pytest.mark.slow
def test_no_link_leads_nowhere_and_nothing_is_loaded_from_a_network(pages):
    identified = {path: {*page.xpath("//@id"), *page.xpath("//a/@name")} for path, page in pages.items()}
    wrong = []
    for path, page in pages.items():
        assert [url for url in page.xpath("//script/@src | //img/@src | //link/@href") if urlsplit(url).netloc] == []
        for url in page.xpath("//a/@href | //img/@src | //script/@src | //link/@href"):
            parts = urlsplit(url)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            fragment = unquote(parts.fragment)
            if not target.exists() or (fragment and target in identified and fragment not in identified[target]):
                wrong.append(f"{path.name}: {url}")
    assert wrong == []


@pytest.mark.slow
def test_equations_lead_to_their_code_and_have_a_reference(site, pages):
    for name in components():
        page = pages[site / "components" / name / "README.html"]
        # Those beside it and those that components share.
        code = [url for url in page.xpath("//a/@href") if "_modules/rov_cosim/components/" in url]
        assert any(f"/{name}/equations.html#" in url for url in code), name
        assert page.xpath(f"//*[starts-with(@id, 'rov_cosim.components.{name}.equations.')]"), name
        assert page.xpath("//*[local-name() = 'math']"), name


@pytest.mark.slow
def test_the_navigation_has_every_page_of_the_index(site, pages):
    sidebar = pages[site / "README.html"].xpath("//div[contains(@class, 'sidebar-tree')]//a/@href")
    index = pages[site / "docs" / "README.html"].xpath("//article//li//a/@href")
    wanted = {(site / "docs" / url.partition("#")[0]).resolve() for url in index if ".html" in url}
    assert wanted <= {(site / url).resolve() for url in sidebar} | {site / "README.html"}
    assert "adaptation" in (site / "searchindex.js").read_text(encoding="utf-8")
