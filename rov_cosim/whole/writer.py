"""Writing a system as a file: as one FMU, and as an SSP archive that is an FMU too."""

from collections.abc import Callable
from pathlib import Path

from ..exporters import archive, stamp
from ..ssp import writer
from ..ssp.wiring import Wiring
from .layout import LayoutError

_CODE = [Path(__file__).parent.with_name(name) for name in ("master", "ssp", "whole")]


def write_fmu(wiring: Wiring, path: Path, progress: Callable[[str], object] = lambda line: None, fmi: int = 2) -> bool:
    """Write the FMU of a system, of FMI 2 or 3, unless it is current; tell whether it was written.

    Raises
    ------
    FaceError : as in `face.entries`.
    BuildError : it cannot be compiled.
    OSError : it cannot be written.
    """
    from . import face  # loads what builds, which takes longer than most runs

    made_of = stamp.of(writer.entries(wiring), _CODE)
    if stamp.holds(path, made_of, face.platforms(wiring, fmi)):
        return False
    written = archive.write(path, face.entries(wiring, archive.present(path), progress, fmi))
    stamp.put(path, made_of, _CODE)
    return written


def write(
    wiring: Wiring,
    path: Path,
    plain: bool = False,
    fmu: Path | None = None,
    warn: Callable[[str], None] = lambda message: None,
    progress: Callable[[str], object] = lambda line: None,
) -> bool:
    """Write the SSP archive of a system unless it is current; tell whether it was written.

    Unless `plain`, the archive is the FMU of the system too, which holds files at its root that SSP reserves. Where
    that cannot be, for want of a compiler or of a platform that all elements share, `warn` is told. `fmu` is where
    `write_fmu` has written the system, if it has.

    Raises
    ------
    WiringError : it would be an archive that cannot run.
    BuildError : the compiler fails.
    OSError : it cannot be written.
    """
    content = writer.entries(wiring)
    if not plain:
        from . import face

        try:
            present = {name: data for name, data in archive.present(path).items() if name not in content}
            content |= archive.read(fmu) if fmu else face.entries(wiring, present, progress)
        except (face.FaceError, LayoutError) as error:
            warn(f"{error} The archive has SSP content alone, which `fmpy simulate` cannot run.")
    return archive.write(path, content)
