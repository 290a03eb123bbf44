"""An FMU by raw calls of FMI 3.0, under the names that `raw_fmi` has for those of 2.0."""

from ctypes import CDLL, CFUNCTYPE, byref, c_bool, c_char_p, c_double, c_int, c_int32, c_size_t, c_uint32, c_void_p
from pathlib import Path
from xml.etree import ElementTree
from zipfile import ZipFile

from raw_fmi import Bench
from rov_cosim.exporters import zig
from rov_cosim.exporters.build import components

LOGGER = CFUNCTYPE(None, c_void_p, c_int, c_char_p, c_char_p)
TYPES = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean", "String": "String"}
VALUE = {"Float64": c_double, "Int32": c_int32, "Boolean": c_bool, "String": c_char_p}
NAMES = {f"{verb}{two}": f"{verb}{three}" for verb in ("Get", "Set") for two, three in TYPES.items()}
NAMES |= {f"{verb}FMUstate": f"{verb}FMUState" for verb in ("Get", "Set", "Free", "Serialize")}
NAMES |= {"SerializedFMUstateSize": "SerializedFMUStateSize", "DeSerializeFMUstate": "DeserializeFMUState"}
HOST = zig.host_platform(3)


class Bench3(Bench):
    """An unpacked FMU and an instance of it; its variables are elements of arrays."""

    version = "fmi3"

    def __init__(self, fmu: Path, folder: Path):
        with ZipFile(fmu) as archive:
            archive.extractall(folder)
        root = ElementTree.parse(folder / "modelDescription.xml").getroot()
        self.fmu, self.folder, self.guid = fmu, folder, root.get("instantiationToken").encode()
        self.resources = f"{folder / 'resources'}/".encode()
        self.path = folder / "binaries" / HOST / f"{fmu.stem}{zig.SUFFIXES[HOST]}"
        self.library, self.messages = CDLL(str(self.path)), []
        arrays = {v.get("name"): v for v in root.find("ModelVariables")}
        self.references, self.types, self.arrays = {}, {}, {}
        component = components()[fmu.stem]
        for signal in component.inputs + component.outputs + component.parameters:
            for i, name in enumerate(signal.names):
                self.references[name] = int(arrays[signal.name].get("valueReference"))
                self.types[name], self.arrays[name] = arrays[signal.name].tag, (signal.size, i)
        self.time_reference = int(arrays["time"].get("valueReference"))
        outputs = [v for v in arrays.values() if v.get("causality") == "output" and v.tag == "Float64"]
        self.outputs = (c_uint32 * len(outputs))(*(int(v.get("valueReference")) for v in outputs))
        self.n_outputs = sum(int(v.find("Dimension").get("start")) if len(v) else 1 for v in outputs)
        self.logger = self.callbacks = LOGGER(lambda *a: self.messages.append(a[-1].decode(errors="replace")))
        self.times = (0, 0.0, 0.0, 0, 0.0)
        self.component, self.time, self.before = self.instance(), 0.0, b""
        assert self.component, f"fmi3Instantiate: NULL {' '.join(self.messages)}"

    def instance(self, type="CoSimulation", event_mode=0, intermediate=0, **other):
        self.messages.clear()
        arguments = {"name": b"tested", "guid": self.guid, "resources": self.resources, "visible": 0, "logging": 1}
        arguments |= {"environment": None, "callbacks": self.callbacks} | other
        logger = [arguments.pop("environment"), arguments.pop("callbacks")]
        if type == "CoSimulation":
            between = [c_bool(event_mode), c_bool(0), (c_uint32 * 1)(), c_size_t(intermediate)]
        else:
            between = []
        function = self.library[f"fmi3Instantiate{'ModelExchange' if type == 0 else type}"]
        function.restype = c_void_p
        return function(*arguments.values(), *between, *logger, None, None, None)

    def call(self, name, *arguments, **on):
        """Call a function by its name in 2.0, with what 3.0 asks for besides."""
        if name == "SetupExperiment":  # its arguments go to fmi3EnterInitializationMode
            self.times = arguments
            return "ok"
        if name == "EnterInitializationMode":
            arguments = arguments or self.times
        if name == "DoStep" and len(arguments) == 3:
            arguments = (*arguments, byref(c_bool()), byref(c_bool()), byref(c_bool()), byref(c_double()))
        if name == "GetReal" and arguments[0] is self.outputs:
            arguments = (self.outputs, len(self.outputs), (c_double * self.n_outputs)(), self.n_outputs)
        elif name in ("GetReal", "SetReal") and len(arguments) == 3:
            arguments = (*arguments, arguments[1])
        return super().call(NAMES.get(name, name), *arguments, **on)

    def put(self, values, type_=None):
        """Set elements, with the rest of their arrays as it is."""
        type_ = TYPES[type_] if type_ else self.types[next(iter(values))]
        references = list(dict.fromkeys(self.references.get(name, name) for name in values))
        elements = {reference: [0.0] for reference in references}
        for name in values:
            if name in self.arrays:
                elements[self.references[name]] = self.array(name)
        for name, value in values.items():
            elements[self.references.get(name, name)][self.arrays.get(name, (1, 0))[1]] = value
        flat = [VALUE[type_](int(v) if type_ != "Float64" else v).value for r in references for v in elements[r]]
        n = len(references)
        return self.call(f"Set{type_}", (c_uint32 * n)(*references), n, (VALUE[type_] * len(flat))(*flat), len(flat))

    def array(self, name):
        size, type_ = self.arrays[name][0], self.types[name]
        found = (VALUE[type_] * size)()
        self.must(f"Get{type_}", byref(c_uint32(self.references[name])), 1, found, size)
        return list(found)

    def get(self, name, type_):
        reference, size = self.references.get(name, name), self.arrays.get(name, (1, 0))[0]
        return self.call(f"Get{TYPES[type_]}", byref(c_uint32(reference)), 1, (VALUE[TYPES[type_]] * size)(), size)
