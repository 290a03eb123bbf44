"""An FMU file from anywhere: what it says of itself, if it is one that this project runs."""

from pathlib import Path

from fmpy import read_model_description
from fmpy.model_description import ModelDescription

from ..errors import UserError


class FmuError(UserError):
    """A file that cannot be used as an FMU; the message says why."""


def described(fmu: Path, name: str = "") -> ModelDescription:
    """Return the description of an FMU, an archive; `name` is what an error calls it, its path if left out.

    Raises
    ------
    FmuError : it is not a readable FMU for co-simulation with FMI 2.0.
    """
    name = name or str(fmu)
    if fmu.is_dir():
        raise FmuError(f"{name} is a folder; expected an FMU, which is a zip archive of such a folder.")
    try:
        description = read_model_description(str(fmu))
    except Exception as error:  # FMPy raises plain exceptions of many types
        raise FmuError(f"{name} is not a readable FMU: {' '.join(str(error).split())}") from None
    if description.fmiVersion != "2.0" or description.coSimulation is None:
        raise FmuError(f"{name} is not an FMU for co-simulation with FMI 2.0.")
    return description
