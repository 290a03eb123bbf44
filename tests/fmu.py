"""An FMU on the bench: one instance behind FMI, its log, its values by name."""

from pathlib import Path

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from lxml import etree

from rov_cosim.exporters import archive
from rov_cosim.master.slave import Slave
from rov_cosim.ssp.wiring import Element


class Fmu:
    """An instantiated FMU, its log, and values by name."""

    def __init__(self, path: Path, folder: Path):
        self.folder = extract(path, folder)
        element = Element("tested", path, read_model_description(folder))
        self.warnings: list[str] = []
        self.slave = Slave(element, Path(folder), self.warnings.append)
        self.fmu: FMU2Slave = self.slave.fmu
        self.variables = element.variables

    @property
    def errors(self):
        return " ".join(self.slave.errors)

    def set(self, values):
        for name, value in values.items():
            self[name] = value

    def __setitem__(self, name, value):
        variable = self.variables[name]
        getattr(self.fmu, f"set{variable.type}")([variable.valueReference], [value])

    def __getitem__(self, name):
        variable = self.variables[name]
        return getattr(self.fmu, f"get{variable.type}")([variable.valueReference])[0]

    def outputs(self):
        return [self[v.name] for v in self.variables.values() if v.causality == "output"]

    def start(self):
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def step(self, n, h=0.03):
        self.fmu.doStep(n * h, h)


def with_units(fmu, path, units, definitions):
    """Write a copy of an FMU whose variables declare units, by name; definitions are the attributes of BaseUnit."""
    content = archive.read(fmu)
    root = etree.fromstring(content["modelDescription.xml"])
    defined = etree.Element("UnitDefinitions")
    for name, base in definitions.items():
        unit = etree.SubElement(defined, "Unit", name=name)
        if base is not None:
            etree.SubElement(unit, "BaseUnit", base)
    root.find("CoSimulation").addnext(defined)
    for variable in root.iter("ScalarVariable"):
        if variable.get("name") in units:
            variable[0].set("unit", units[variable.get("name")])
    archive.write(path, {**content, "modelDescription.xml": etree.tostring(root)})
    return path
