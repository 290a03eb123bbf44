"""An FMU file from anywhere: what it says of itself, if it is one that this project runs."""

from collections.abc import Callable, Collection, Iterable
from pathlib import Path
from zipfile import ZipFile

import fmpy
from fmpy import read_model_description
from fmpy.model_description import ModelDescription, ValidationError
from fmpy.validation import validate_model_description
from lxml import etree

from ..errors import UserError
from ..exporters import zig
from . import zipped
from .values import is_value

DESCRIPTION = "modelDescription.xml"
MOST_NAMED = 2
"""Formal faults of an FMU that a warning shows; it counts the rest."""
_LARGEST_REFERENCE = 2**32 - 1
_PYTHONFMU = "resources/slavemodule.txt"


class FmuError(UserError):
    """A file that cannot be used as an FMU; the message says why."""


def described(
    fmu: Path,
    name: str = "",
    warn: Callable[[str], None] = lambda message: None,
    versions: Collection[int] = (2,),
) -> ModelDescription:
    """Return the description of an FMU, an archive; `name` is what a message calls it, its path if left out.

    What is formally wrong with it, but does not keep FMPy from running it, is told to `warn` in a line.

    Raises
    ------
    FmuError : it is not a readable FMU for co-simulation with one of the major versions of FMI, has no binary for this
        machine, or needs the tool that made it.
    """
    name = name or str(fmu)
    if fmu.is_dir():
        raise FmuError(f"{name} is a folder; expected an FMU, which is a zip archive of such a folder.")
    try:
        with zipped.opened(fmu) as archive:
            if problem := _problem(archive, versions):
                raise FmuError(f"{name} {problem}")
            try:
                description, faults = _read(fmu)
            except _UnreadableError as error:
                raise FmuError(f"{name} is not a readable FMU: {_line(str(error))}") from None
            if problem := _unfit(description, archive):
                raise FmuError(f"{name} {problem}")
    except zipped.ZipError as error:
        raise FmuError(f"{name} is not a readable FMU: it {error}") from None
    for variable in description.modelVariables:
        # A variable has the unit of its type unless it has one of its own, which FMPy leaves to its callers.
        if variable.unit is None and variable.declaredType is not None:
            variable.unit = variable.declaredType.unit
        # What is no finite value of its type cannot be set or handed on: the FMU begins with what it means by it.
        for attribute in ("start", "min", "max") if description.fmiMajorVersion == 2 else ():
            if not is_value(getattr(variable, attribute), variable.type):
                setattr(variable, attribute, None)
    if faults:
        more = f" And {len(faults) - MOST_NAMED} more." if len(faults) > MOST_NAMED else ""
        warn(f"{name} is not quite as FMI wants it: {' '.join(map(_line, faults[:MOST_NAMED]))}{more}")
    return description


def _problem(archive: ZipFile, versions: Collection[int]) -> str:
    """Return what keeps an archive from being an FMU with one of some versions of FMI, or nothing."""
    names = [str(zipped.place(info)) for info in archive.infolist()]
    if DESCRIPTION not in names:
        inside = [n for n in names if n.endswith(f"/{DESCRIPTION}") and not n.startswith("__MACOSX/")]
        if "SystemStructure.ssd" in names:
            return "is an SSP archive, not an FMU."
        if inside:
            folder = inside[0].removesuffix(DESCRIPTION)
            return f"is no FMU: its {DESCRIPTION} lies in the folder {folder}; zip what that folder holds."
        return f"is no FMU: it has no {DESCRIPTION}."
    try:
        root = etree.fromstring(archive.read(DESCRIPTION), etree.XMLParser(resolve_entities=False, no_network=True))
    except etree.XMLSyntaxError as error:
        return f"is not a readable FMU: its {DESCRIPTION} is not well-formed XML: {_line(str(error))}."
    if root.getroottree().docinfo.internalDTD is not None:
        return f"is not a readable FMU: its {DESCRIPTION} has a DOCTYPE, which FMI does not know."
    version = root.get("fmiVersion")
    if root.tag != "fmiModelDescription" or version is None:
        return f"is no FMU: its {DESCRIPTION} holds {_line(str(root.tag))}, not fmiModelDescription with an fmiVersion."
    fits = {2: version == "2.0", 3: version.startswith("3.0")}  # of the latter there are versions of three numbers
    return "" if any(fits[major] for major in versions) else f"{_other(versions)}: it is of FMI {version}."


def _other(versions: Iterable[int]) -> str:
    return f"is not an FMU for co-simulation with FMI {' or '.join(f'{major}.0' for major in versions)}"


class _UnreadableError(Exception):
    """A description that FMPy cannot read, with the reason."""


def _read(fmu: Path) -> tuple[ModelDescription, list[str]]:
    """Return the description of an FMU, and what is formally wrong with it; _UnreadableError if there is none."""
    try:
        return read_model_description(str(fmu)), []
    except ValidationError as error:
        faults = list(error.problems)
    except Exception:  # FMPy's validation stumbles over display units whose unit is not defined
        faults = []
    try:
        description = read_model_description(str(fmu), validate=False)
    except IndexError:
        raise _UnreadableError("it refers to a variable by an index that none has.") from None
    except Exception as error:  # of many types, and often less telling than the schema
        raise _UnreadableError(faults[0] if faults else str(error)) from None
    if not faults:
        defined = {unit.name for unit in description.unitDefinitions}
        for variable in description.modelVariables:
            own = variable.unit or (variable.declaredType and variable.declaredType.unit)
            if own not in defined:
                variable.displayUnit = None
        faults = validate_model_description(description)
    return description, faults


def _unfit(description: ModelDescription, archive: ZipFile) -> str:
    """Return what keeps an FMU from being run here, or nothing."""
    simulation = description.coSimulation
    if simulation is None:
        return f"{_other([description.fmiMajorVersion])}: it is for model exchange alone."
    token = "guid" if description.fmiMajorVersion == 2 else "instantiationToken"
    for attribute, value in {token: description.guid, "modelIdentifier": simulation.modelIdentifier}.items():
        if value is None:
            return f"is not a readable FMU: it has no {attribute}."
    for variable in description.modelVariables:
        if not 0 <= variable.valueReference <= _LARGEST_REFERENCE:
            return f"is not a readable FMU: the valueReference {variable.valueReference} of {variable.name} is none."
    names = {str(zipped.place(info)) for info in archive.infolist()}
    if simulation.needsExecutionTool and _PYTHONFMU not in names:  # pythonfmu says so of Python, which is here
        tool = description.generationTool or "whichever that is"
        return f"needs the tool that made it in each run ({tool}; needsExecutionTool): export it anew without that."
    library = f"{simulation.modelIdentifier}{fmpy.sharedLibraryExtension}"
    here = zig.host_folders() if description.fmiMajorVersion == 2 else [fmpy.platform_tuple]
    if any(f"binaries/{folder}/{library}" in names for folder in here):
        return ""
    there = sorted({n.split("/")[1] for n in names if n.startswith("binaries/") and n.count("/") > 1})
    for folder in set(here) & set(there):
        return f"has no {library} among its binaries for {folder}, though its modelIdentifier says so."
    has = f"it has those for {', '.join(there)}" if there else "it has none"
    return f"has no binary for {here[0]}, which is this machine: {has}."


def _line(text: str) -> str:
    """Return a message as a line that is not too long."""
    line = " ".join(text.split())
    return line if len(line) <= 200 else f"{line[:200]}..."
