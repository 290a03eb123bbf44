"""An FMU for co-simulation (FMI 2.0) by the names of its variables: one file on FMPy, free to copy (MIT).

    from fmu import Fmu

    with Fmu("adaptive_pd.fmu", "parameters/station_keeping.ssv") as controller:
        controller["eta_m_valid"] = True
        controller["eta_m"] = 0.1, 0.0, 0.0, 0.0, 0.0, 0.0
        controller.step()
        print(controller["u"])

A name is that of a variable, `eta_m.x`, or of a group, `eta_m`, which is all `eta_m.*` and `eta_m[*]` in their order.
Parameters are set before the first step. FMPy prints what the FMU says; a call that it refuses is an FMICallException.
"""

import shutil
from difflib import get_close_matches
from xml.etree import ElementTree

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

TYPES = {"Real": float, "Integer": int, "Boolean": bool}


class Fmu:
    """An instance of an FMU, with the values of a parameter set (SSV), if one is given."""

    def __init__(self, path, ssv=None, step_size=0.03):
        self.step_size, self.steps, self._started = step_size, 0, False
        description = read_model_description(str(path))
        if description.fmiVersion != "2.0":
            raise ValueError(f"it is of FMI {description.fmiVersion}, and this is for FMI 2.0")
        self.variables = {variable.name: variable for variable in description.modelVariables}
        self._folder = extract(str(path))
        model, guid = description.coSimulation.modelIdentifier, description.guid
        self._fmu = FMU2Slave(guid=guid, unzipDirectory=self._folder, modelIdentifier=model, instanceName=model)
        self._fmu.instantiate()
        self._fmu.setupExperiment(startTime=0.0)
        if ssv:
            self.apply(ssv)

    def apply(self, ssv):
        """Set the values of a parameter set; its units have to be the FMU's."""
        for element in ElementTree.parse(ssv).iter():
            if element.tag.endswith("}Parameter"):
                text = element[0].get("value")
                self[element.get("name")] = {"true": True, "false": False}.get(text, text)

    def start(self):
        """End the initialization, if the first step has not: outputs then have their first values."""
        if not self._started:
            self._fmu.enterInitializationMode()
            self._fmu.exitInitializationMode()
            self._started = True

    def step(self):
        """Take a step and return the time at its end in s."""
        self.start()
        self._fmu.doStep(self.steps * self.step_size, self.step_size)
        self.steps += 1
        return self.steps * self.step_size

    def __setitem__(self, name, value):
        group = self._group(name)
        values = [value] if len(group) == 1 else list(value)
        if len(values) != len(group):
            raise ValueError(f"{name} has {len(group)} elements, not {len(values)}.")
        for variable, one in zip(group, values, strict=True):
            set_ = getattr(self._fmu, f"set{variable.type}")
            set_([variable.valueReference], [TYPES[variable.type](one)])

    def __getitem__(self, name):
        group = self._group(name)
        values = [TYPES[v.type](getattr(self._fmu, f"get{v.type}")([v.valueReference])[0]) for v in group]
        return values[0] if name in self.variables else values

    def _group(self, name):
        if name in self.variables:
            return [self.variables[name]]
        group = [variable for key, variable in self.variables.items() if key.startswith((f"{name}.", f"{name}["))]
        if not group:
            close = get_close_matches(name, [*self.variables, *(key.split(".")[0] for key in self.variables)], 1)
            raise KeyError(f"the FMU has no variable {name}" + (f"; is it {close[0]}?" if close else ""))
        return group

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self._started:
            self._fmu.terminate()
        self._fmu.freeInstance()
        shutil.rmtree(self._folder, ignore_errors=True)
