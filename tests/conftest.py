"""What the tests share: the built FMUs and archives, and a plain FMU that this project did not make."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from pythonfmu.builder import FmuBuilder

from fmu import Fmu
from rov_cosim.exporters import archive, zig
from rov_cosim.exporters.build import FMI3, build_fmus, components, fmu_path, project_root
from rov_cosim.handover import reference
from rov_cosim.ssp.declaration import wire
from rov_cosim.study import archives as building
from rov_cosim.study.looped import loop_of
from rov_cosim.study.matrix import wired
from rov_cosim.systems.catalogue import SYSTEMS

LONGEST = (
    "fuzz",
    "binaries",
    "handover_check",
    "stamp",
    "native",
    "handover",
    "runs",
    "handover_importers",
    "ssp_writer",
    "quality",
)
"""The files that take longest, the slow tests first; the third and fourth build nothing of the same at a time."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with what takes longest, so that at the end no worker has a long file alone."""
    places = {f"test_{name}.py": place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: places.get(item.path.name, len(places)))


class Archives(dict[str, Path]):
    """SSP archives by system name, each built when it is asked for."""

    def __init__(self, export: str, plain: bool = False) -> None:
        self._export, self._plain = export, plain

    def __missing__(self, name: str) -> Path:
        building.build(SYSTEMS[name], export=self._export, plain=self._plain)
        return self.setdefault(name, building.ssp_path(name, self._export))


class Systems(dict[str, Path]):
    """FMUs of whole systems by name, each built with its archive when it is asked for."""

    def __init__(self, archives: dict[str, Path]) -> None:
        self._archives = archives

    def __missing__(self, name: str) -> Path:
        assert self._archives[name]
        return self.setdefault(name, fmu_path(project_root(), name))


@pytest.fixture(scope="session")
def archives(fmus) -> dict[str, Path]:
    """Return the SSP archives by system name."""
    return Archives("native")


@pytest.fixture(scope="session")
def systems(archives) -> dict[str, Path]:
    """Return the FMUs of systems by system name."""
    return Systems(archives)


@pytest.fixture(scope="session")
def python_archives(python_fmus) -> dict[str, Path]:
    """Return the SSP archives with pythonfmu FMUs by system name, none an FMU: that takes each of their platforms."""
    return Archives("pythonfmu", plain=True)


@pytest.fixture(scope="session")
def fmus() -> dict[str, Path]:
    """Build the native FMUs of all components; return them by component name."""
    build_fmus(project_root())
    return {name: fmu_path(project_root(), name) for name in components()}


@pytest.fixture(scope="session")
def fmi3_fmus() -> dict[str, Path]:
    """Build the native FMUs of FMI 3.0 of all components; return them by component name."""
    build_fmus(project_root(), FMI3)
    return {name: fmu_path(project_root(), name, FMI3) for name in components()}


@pytest.fixture(scope="session")
def python_fmus() -> dict[str, Path]:
    """Build the pythonfmu FMUs of all components; return them by component name."""
    build_fmus(project_root(), "pythonfmu")
    return {name: fmu_path(project_root(), name, "pythonfmu") for name in components()}


@pytest.fixture(scope="session")
def exported(fmus, python_fmus) -> dict[str, dict[str, Path]]:
    """Return the FMUs by export and component name."""
    return {"native": fmus, "pythonfmu": python_fmus}


@pytest.fixture(scope="session")
def plain_gain(tmp_path_factory) -> Path:
    """Return a plain pythonfmu FMU, with the binary for this machine alone, so that its systems are compiled once."""
    path = FmuBuilder.build_FMU(Path(__file__).parent / "fmus" / "plain_gain.py", tmp_path_factory.mktemp("plain"))
    content, here = archive.read(path), f"binaries/{zig.host_platform()}/"
    archive.write(path, {n: data for n, data in content.items() if not n.startswith("binaries/") or n.startswith(here)})
    return path


@pytest.fixture(scope="session")
def references() -> Iterator[None]:
    """Work each reference run out once, not for each verdict: steps in NumPy take most of its time."""
    known = {}

    def run(component, case):
        key = id(component), id(case)
        if key not in known:
            known[key] = (work_out(component, case), component, case)  # which keeps what the ids are of
        return known[key][0]

    work_out = reference.run
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reference, "run", run)
        yield


@pytest.fixture
def native(fmus, tmp_path):
    """Return what opens a native FMU by its component's name."""
    opened = []

    def open_(name):
        opened.append(Fmu(fmus[name], tmp_path / f"{name}{len(opened)}"))
        return opened[-1]

    yield open_
    for one in opened:
        one.fmu.freeInstance()


@pytest.fixture(scope="session")
def loops(fmus):
    """Return the loops of one vehicle, by vehicle and controller, with four that differ."""
    return wired(["bluerov2"], ("adaptive_pd", "extended", "pid", "pd"))


@pytest.fixture(scope="session")
def loop(loops):
    """Return the loop of this vehicle with the adaptive controller."""
    return loops["bluerov2", "adaptive_pd"]


@pytest.fixture(scope="session")
def paper_loop(fmus):
    """Return the loop of the paper's simulation, to linearise it."""
    return loop_of(wire(SYSTEMS["paper_simulation"]))
