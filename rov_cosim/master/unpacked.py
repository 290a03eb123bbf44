"""FMUs unpacked where their libraries can be loaded."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from ..ssp import zipped
from ..ssp.wiring import Element, Wiring, WiringError

Folders = Mapping[tuple[str, Path], Path]
"""Where an FMU lies unpacked, by the element's name and the archive: two elements share no library's memory."""

_NOT_RUN = ("sources", "documentation")
"""What of an FMU no run needs, for it is told of its resources alone (FMI 2.0, 2.1.5). It is most of its files."""


@contextmanager
def unpacked(*wirings: Wiring) -> Iterator[Folders]:
    """Yield the folders of all FMUs of some systems; they last until the context ends.

    Raises
    ------
    WiringError : an FMU cannot be unpacked, or not be run from there.
    """
    folders: dict[tuple[str, Path], Path] = {}
    with TemporaryDirectory(prefix="rov_cosim_", ignore_cleanup_errors=True) as root:
        for wiring in wirings:
            for element in wiring.elements:
                key = (element.name, element.fmu)
                if key not in folders:
                    folders[key] = unpack(element, Path(root) / str(len(folders)))
        yield folders


def unpack(element: Element, folder: Path) -> Path:
    """Unpack what runs of the FMU of an element into a folder, and return the folder; errors as in `unpacked`."""
    try:
        zipped.unpack(element.fmu, folder, without=_NOT_RUN)
    except zipped.ZipError as error:
        raise WiringError(element.name, [f"{element.fmu.name} {error}"]) from None
    where = str(folder)
    if (folder / "resources" / "slavemodule.txt").is_file() and (not where.isascii() or set(where) & set("#%")):
        problem = (
            f"pythonfmu cannot load {element.fmu.name} from the temporary folder {where}, "
            "whose name is not ASCII or has # or %: set TMPDIR to another."
        )
        raise WiringError(element.name, [problem])
    return folder
