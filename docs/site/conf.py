"""The Markdown of the repository as a site: `sphinx-build -W -c docs/site . build/site`.

Pages lie where they are read on a file system, and have no word for Sphinx. The navigation is the index docs/README.md;
pages of components get the reference of their functions, docs/API.md that of its names.
"""

import re
from importlib import import_module
from inspect import isfunction
from pathlib import Path

import latex2mathml.converter
from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.util.osutil import relative_uri

import rov_cosim

ROOT = Path(__file__).parents[2]
INDEX, API = "docs/README", "docs/API"
SHARED = ("frames", "vehicle", "measurement", "feedback", "noise")

project = "rov-cosim"
version = release = rov_cosim.__version__
html_show_copyright = False
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]
source_suffix = {".md": "markdown"}
root_doc = "README"
# rov_cosim/components and rov_cosim/systems are links to the folders at the top.
exclude_patterns = ["build", "**/.*", ".*", "*.egg-info", "rov_cosim/components", "rov_cosim/systems"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_default_options = {"members": True}
default_role = "code"
html_theme = "furo"
html_title = project
html_additional_pages = {"index": "index.html"}
html_math_renderer = "mathml"
html_copy_source = False
templates_path = ["."]


def setup(app: Sphinx) -> None:
    """Register what the site has beyond Sphinx."""
    app.connect("source-read", complete)
    app.connect("doctree-resolved", lead_to_code)
    app.connect("autodoc-process-docstring", plain)
    app.add_html_math_renderer("mathml", (mathml("inline"), None), (mathml("block"), None))


def complete(app: Sphinx, page: str, source: list[str]) -> None:
    """Give a page its navigation or its reference."""
    if page == app.config.root_doc:
        source[0] += navigation((ROOT / f"{INDEX}.md").read_text(encoding="utf-8"))
    elif page == API:
        names = (getattr(rov_cosim, name) for name in rov_cosim.__all__ if name != "SYSTEMS")
        of_names = [directive("class", one) for one in names]
        shared = [directive("module", import_module(f"rov_cosim.components.{name}")) for name in SHARED]
        source[0] += "\n".join(["\n## Reference\n", *of_names, "\n## Equations that components share\n", *shared])
    elif found := re.fullmatch(r"components/(\w+)/README", page):
        equations = import_module(f"rov_cosim.components.{found[1]}.equations")
        source[0] += f"\n## Its functions\n{directive('module', equations)}"


def navigation(index: str) -> str:
    """Return the pages of the index by its headings, as trees of contents."""
    trees = [f"\n```{{toctree}}\n:hidden:\n\nAll pages </{INDEX}>\n```\n"]
    for section in index.split("\n## ")[1:]:
        caption = section.splitlines()[0]
        targets = dict.fromkeys(re.findall(r"]\(([^)#:]+)\.md\)", section))
        pages = [str((ROOT / INDEX).parent.joinpath(target).resolve().relative_to(ROOT)) for target in targets]
        entries = "\n".join(f"/{page}" for page in pages if page not in {"README", INDEX})
        trees.append(f"\n```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{entries}\n```\n")
    return "".join(trees)


def directive(kind: str, documented: object) -> str:
    """Return what documents a module, a class or a function."""
    name = documented.__name__ if kind == "module" else f"{documented.__module__}.{documented.__qualname__}"
    kind = "function" if isfunction(documented) else kind
    return f"```{{eval-rst}}\n.. auto{kind}:: {name}\n```\n"


def plain(app: Sphinx, what: str, name: str, documented: object, options: object, lines: list[str]) -> None:
    """Keep the bars and asterisks of a docstring, which mean sizes and groups of names there."""
    lines[:] = [re.sub(r"[|*]", r"\\\g<0>", line) for line in lines]


def lead_to_code(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Lead links to the equations' files to their code on the site."""
    for link in list(doctree.findall(addnodes.download_reference)):
        target = (Path(page).parent / link["reftarget"]) if "reftarget" in link else Path()
        path = (ROOT / target).resolve()
        module = "rov_cosim." + ".".join(path.relative_to(ROOT).with_suffix("").parts) if path.suffix == ".py" else ""
        entry = app.env._viewcode_modules.get(module)  # code, tags, what of it is documented, ...
        if not entry:
            continue
        uri = relative_uri(app.builder.get_target_uri(page), f"_modules/{module.replace('.', '/')}.html")
        function = re.match(r"\w+(?= in )", link.astext())
        where = f"#{function[0]}" if function and function[0] in entry[2] else ""
        link.replace_self(nodes.reference("", "", *link.children, internal=True, refuri=uri + where))


def mathml(display: str):
    """Return the visitor that writes an equation as MathML, which browsers draw by themselves."""

    def visit(translator, node) -> None:
        equation = latex2mathml.converter.convert(node.astext(), display=display)
        wide = f'<div style="margin: 1em 0; overflow-x: auto">{equation}</div>'
        translator.body.append(wide if display == "block" else equation)
        raise nodes.SkipNode

    return visit
