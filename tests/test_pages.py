"""The pages inside FMUs and kits, on a phone, in a real browser."""

import html
import json
import re
import shutil
import subprocess

import pytest

from rov_cosim.components.cases import cases_of
from rov_cosim.exporters import archive, documentation
from rov_cosim.exporters.build import components
from rov_cosim.handover.guide import guide

CHROMIUM = shutil.which("chromium")
PHONE = 390
WIDTHS = """
<body>{frames}<script>
onload = () => {{
  const frames = [...document.querySelectorAll("iframe")].map(frame => frame.contentDocument.documentElement);
  document.body.dataset.widths = JSON.stringify(frames.map(page => [page.scrollWidth, page.clientWidth]));
}};
</script>
"""


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium")
def test_no_page_is_wider_than_a_phone(systems, tmp_path):
    pages = {"system": archive.read(systems["station_keeping"])["documentation/index.html"].decode()}
    for name, component in components().items():
        pages[name] = documentation.page(component)
        pages[f"guide_{name}"] = documentation.html(component.title, guide(component, cases_of(component), ["linux64"]))
    for name, text in pages.items():
        (tmp_path / f"{name}.html").write_text(text, encoding="utf-8")
    frames = "".join(f'<iframe src="{name}.html" style="width: {PHONE}px"></iframe>' for name in pages)
    (tmp_path / "frames.html").write_text(WIDTHS.format(frames=frames), encoding="utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files", "--dump-dom"]
    address = (tmp_path / "frames.html").as_uri()
    dom = subprocess.run([CHROMIUM, *options, address], capture_output=True, encoding="utf-8", check=True).stdout
    widths = json.loads(html.unescape(re.search('data-widths="(.*?)"', dom)[1]))
    assert len(widths) == len(pages)
    assert {name: found for name, found in zip(pages, widths, strict=True) if found[0] > found[1]} == {}
