"""The packages of `rov_cosim`: its own folder, and `components` and `systems`, which lie beside it.

Declared here, not in pyproject.toml, because they are found: a new component needs no word. The links in `rov_cosim/`
to the two folders are for editors and type checkers; an installation does without them.
"""

from setuptools import find_packages, setup

BESIDE = ("components", "systems")

own = [name for name in find_packages("rov_cosim") if name.split(".")[0] not in BESIDE]
beside = find_packages(include=[*BESIDE, *(f"{name}.*" for name in BESIDE)])
setup(
    packages=["rov_cosim", *(f"rov_cosim.{name}" for name in own + beside)],
    package_dir={f"rov_cosim.{name}": name for name in BESIDE},
)
