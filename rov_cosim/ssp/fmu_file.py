"""An FMU file from anywhere: unpacked, if it is one that this project runs."""

from pathlib import Path

from fmpy import extract, read_model_description
from fmpy.model_description import ModelDescription


class FmuError(ValueError):
    """A file that cannot be used as an FMU; the message says why."""


def unpacked(fmu: Path, folder: Path, named: str) -> ModelDescription:
    """Unpack an FMU into a folder and return its description; `named` is what an error calls it.

    Raises
    ------
    FmuError : it is not a readable FMU for co-simulation with FMI 2.0, or cannot be run from this folder.
    """
    try:
        description = read_model_description(extract(str(fmu), str(folder)))
    except Exception as error:  # FMPy raises plain exceptions of many types
        raise FmuError(f"{named} is not a readable FMU: {' '.join(str(error).split())}") from None
    if description.fmiVersion != "2.0" or description.coSimulation is None:
        raise FmuError(f"{named} is not an FMU for co-simulation with FMI 2.0.")
    where = str(folder)
    if (folder / "resources" / "slavemodule.txt").is_file() and (not where.isascii() or set(where) & set("#%")):
        raise FmuError(
            f"pythonfmu cannot load {named} from the temporary folder {where}, whose name is not ASCII or has # or %: "
            "set TMPDIR to another."
        )
    return description
