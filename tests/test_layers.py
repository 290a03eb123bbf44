"""The folders import downwards only, and a command pays for the imports of no other."""

import ast
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
LAYERS = [
    "cli",
    "release",
    "benchmark",
    "importers",
    "handover",
    "report",
    "study",
    "systems",
    "whole",
    "master",
    "ssp",
    "exporters",
    "control",
    "components",
    "errors",
    "loaded",
]
"""Each folder, or module, of `rov_cosim` may import from itself and from those after it."""
APART = {"importers", "benchmark", "release"}
"""What writes pages, times things or makes what is handed over: only commands load it."""


def imported(file, package):
    """Yield the parts below rov_cosim that a module imports from, but for what a script's own run needs."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    scripts = [n for n in tree.body if isinstance(n, ast.If) and "__main__" in ast.unparse(n.test)]
    ignored = {id(node) for script in scripts for node in ast.walk(script)}
    for node in ast.walk(tree):
        if id(node) in ignored:
            continue
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package.split(".")[: len(package.split(".")) + 1 - node.level] if node.level else []
            module = ".".join([*base, node.module] if node.module else base)
            names = [f"{module}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in names:
            parts = name.split(".")
            if parts[0] == "rov_cosim" and len(parts) > 1:
                yield parts[1]


def modules():
    for top in ("components", "systems", "rov_cosim"):
        for file in sorted((ROOT / top).rglob("*.py")):
            place = file.relative_to(ROOT)
            parts = place.parts if top == "rov_cosim" else ("rov_cosim", *place.parts)
            if parts[1] != "__init__.py":
                yield place, parts


def test_imports_run_downwards():
    wrong = []
    for place, parts in modules():
        own = parts[1].removesuffix(".py")
        assert own in LAYERS, f"{own} has no place in the layers"
        for name in imported(ROOT / place, ".".join(parts[:-1])):
            upwards = LAYERS.index(name) < LAYERS.index(own)
            if upwards or (name in APART and own not in {"cli", *APART}):
                wrong.append(f"{place} imports {name}")
    assert wrong == []
    assert "study" in imported(ROOT / "rov_cosim" / "cli" / "commands" / "run.py", "rov_cosim.cli.commands")


def test_components_know_numpy_alone():
    for file in (ROOT / "components").rglob("*.py"):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        roots = {alias.name.split(".")[0] for n in ast.walk(tree) if isinstance(n, ast.Import) for alias in n.names}
        roots |= {n.module.split(".")[0] for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and not n.level}
        assert roots <= {"numpy", *sys.stdlib_module_names}, file


def test_a_run_up_to_its_table_loads_neither_matplotlib_nor_what_builds(fmus):
    script = (
        "import sys; from rov_cosim.study.runs import opened, simulated; from rov_cosim import SYSTEMS, Settings\n"
        "with opened(SYSTEMS['station_keeping']) as wiring: simulated(wiring, Settings(stop_time=0.3))\n"
        "print(*sorted({name.split('.')[0] for name in sys.modules}))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, encoding="utf-8", check=True)
    loaded = set(done.stdout.split())
    assert {"fmpy", "numpy"} <= loaded
    assert not loaded & {"matplotlib", "casadi", "ziglang", "PIL", "markdown_it", "scipy"}
