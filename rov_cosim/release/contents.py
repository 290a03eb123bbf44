"""The contents of a release: wheel, FMUs, archives and kits, all made anew."""

import shutil
from collections.abc import Callable, Collection, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from ..exporters import archive
from ..exporters.build import FMI3, build_fmus, components, fmu_path
from ..exporters.zig import JOBS, platforms_of
from ..handover import kit, live
from ..ssp.declaration import wire
from ..systems.catalogue import SYSTEMS
from ..whole.writer import write, write_fmu
from . import bill, source


def make(
    root: Path,
    folder: Path,
    names: Collection[str],
    platforms: Collection[str],
    commit: str,
    progress: Callable[[str], object] = lambda line: None,
) -> None:
    """Write a release into a folder that is not there yet, or is empty; it is there as a whole or not at all.

    Parameters
    ----------
    root : the clone that it is of.
    names : components, each with its kit, and systems, each with its archive.
    platforms : those that the FMUs are for.
    commit : what `root` is at.
    progress : is told in a line what begins.

    Raises
    ------
    ReleaseError : the wheel cannot be built or is not as it should be.
    BuildError : an FMU cannot be built.
    OSError : the folder cannot be written.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}.") as temporary:
        made = Path(temporary, "made")
        made.mkdir()
        progress("building the wheel")
        source.wheel(root, made)
        _models(Path(temporary), made, names, platforms, progress)
        bill.write(made, commit)
        if folder.exists():
            folder.rmdir()
        made.rename(folder)


def _models(
    work: Path,
    made: Path,
    names: Collection[str],
    platforms: Collection[str],
    progress: Callable[[str], object],
) -> None:
    known = components()
    systems = [SYSTEMS[name] for name in names if name in SYSTEMS]
    named = [name for name in known if name in names]
    shown = [system for name in named for system in live.systems(known[name]).values()]
    elements = {component for system in (*systems, *shown) for component in system.elements.values()}
    build_fmus(work, platforms=platforms, names=sorted({*named, *elements}), progress=progress)
    build_fmus(work, FMI3, platforms_of(3, platforms), named, progress)
    fmus = {name: fmu_path(work, name) for name in known}
    published = {2: made / "fmus", 3: made / "fmus" / FMI3}
    published[3].mkdir(parents=True)

    def archived(name: str) -> None:
        wiring = wire(SYSTEMS[name], fmus)
        for fmi, place in published.items():
            whole = work / str(fmi) / f"{name}.fmu"  # beside its stamp
            write_fmu(wiring, whole, progress, fmi)
            shutil.copyfile(whole, place / whole.name)
        write(wiring, made / "systems" / f"{name}.ssp", fmu=published[2] / f"{name}.fmu")

    with ThreadPoolExecutor(JOBS) as pool:  # the compiler is a process of its own
        list(pool.map(archived, [system.name for system in systems]))
    for name in named:
        own = {2: fmus[name], 3: fmu_path(work, name, FMI3)}
        for fmi, place in published.items():
            shutil.copyfile(own[fmi], place / f"{name}.fmu")
        page = live.written(known[name], fmus, progress)
        content = kit.entries(known[name], own, platforms, partial(_told, name, progress), page)
        archive.write(made / "kits" / f"{kit.called(known[name])}.zip", kit.zipped_entries(known[name], content))


def _told(name: str, progress: Callable[[str], object], steps: Iterable[str], what: str) -> Iterable[str]:
    for step in steps:
        progress(f"{what} {step} of {name}")
        yield step
