"""An FMU by raw calls of FMI 2.0, which pass on whatever they are given: wrappers would refuse half of all misuse."""

from copy import copy
from ctypes import CDLL, CFUNCTYPE, byref, c_char_p, c_double, c_int, c_size_t, c_uint32, c_void_p, cast
from ctypes import create_string_buffer as buffer
from math import isfinite
from pathlib import Path
from xml.etree import ElementTree
from zipfile import ZipFile

STATUS = ("ok", "warning", "discard", "error", "fatal", "pending")
LOGGER = CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)
VALUE = {"Real": c_double, "Integer": c_int, "Boolean": c_int, "String": c_char_p}
ARGUMENT = {float: c_double, int: c_size_t}  # an int may be passed as wide: it has the same register
STAGES = BEGIN, INIT, RUN, END = ("instantiated", "initializing", "running", "terminated")
SETUP = ("SetupExperiment", 0, 0.0, 0.0, 0, 0.0)
LIFE = ((SETUP, ("EnterInitializationMode",)), (("ExitInitializationMode",),), (("Terminate",),))  # from stage to stage


class Bench:
    """An unpacked FMU and an instance of it; `messages` is what the last call logged."""

    version = "fmi2"

    def __init__(self, fmu: Path, folder: Path):
        with ZipFile(fmu) as archive:
            archive.extractall(folder)
        root = ElementTree.parse(folder / "modelDescription.xml").getroot()
        self.fmu, self.folder, self.guid = fmu, folder, root.get("guid").encode()
        self.resources = (folder / "resources").as_uri().encode()
        self.path = folder / "binaries" / "linux64" / f"{fmu.stem}.so"
        self.library, libc, self.messages = CDLL(str(self.path)), CDLL(None), []
        variables = list(root.iter("ScalarVariable"))
        self.references = {v.get("name"): int(v.get("valueReference")) for v in variables}
        self.types = {v.get("name"): v[0].tag for v in variables}
        outputs = [v.get("name") for v in variables if v.get("causality") == "output" and v[0].tag == "Real"]
        self.outputs = (c_uint32 * len(outputs))(*(self.references[name] for name in outputs))
        self.logger = LOGGER(lambda *arguments: self.messages.append(arguments[-1].decode(errors="replace")))
        functions = (cast(function, c_void_p).value for function in (self.logger, libc.calloc, libc.free))
        self.callbacks = (c_void_p * 5)(*functions)
        self.component, self.time, self.before = self.instance(), 0.0, b""
        assert self.component, f"fmi2Instantiate: NULL {' '.join(self.messages)}"

    def alias(self, names):
        """Let variables be called by other names besides."""
        for other, name in names.items():
            self.references[other], self.types[other] = self.references[name], self.types[name]

    def instance(self, **other):
        self.messages.clear()
        arguments = {"name": b"tested", "type": 1, "guid": self.guid, "resources": self.resources}
        arguments |= {"callbacks": self.callbacks, "visible": 0, "logging": 1} | other
        function = self.library["fmi2Instantiate"]
        function.restype = c_void_p
        return function(*arguments.values())

    def instantiate(self, **other):
        return "ok" if self.instance(**other) else "NULL"

    def call(self, name, *arguments, **on):
        self.messages.clear()
        function = self.library[f"{self.version}{name}"]
        function.restype = None if name == "FreeInstance" else c_int
        component = c_void_p(on.get("component", self.component))
        return STATUS[function(component, *(ARGUMENT.get(type(a), lambda a: a)(a) for a in arguments)) or 0]

    def must(self, *call):
        status = self.call(*call)
        assert status == "ok", f"{call[0]}: {status} {' '.join(self.messages)}"

    def lead(self, first, last=RUN):
        """Lead the instance from one stage of its life to another."""
        for calls in LIFE[STAGES.index(first) : STAGES.index(last)]:
            for call in calls:
                self.must(*call)

    def step(self, h=0.03, at=None):
        begin = self.time if at is None else at
        status = self.call("DoStep", begin, h, 1)
        self.time = begin + h if status == "ok" else self.time
        return status

    def put(self, values, type_=None):
        type_ = type_ or self.types[next(iter(values))]
        references = (self.references.get(name, name) for name in values)
        n = len(values)
        return self.call(f"Set{type_}", (c_uint32 * n)(*references), n, (VALUE[type_] * n)(*values.values()))

    def get(self, name, type_):
        return self.call(f"Get{type_}", byref(c_uint32(self.references.get(name, name))), 1, byref(VALUE[type_]()))

    def check(self, step=True):
        """Check that a step works, and that the outputs are finite."""
        status = self.step() if step else "ok"
        assert status == "ok", f"a good step: {status} {' '.join(self.messages)}"
        values = (c_double * len(self.outputs))()
        self.must("GetReal", self.outputs, len(values), values)
        assert all(map(isfinite, values)), "an output is not finite"

    def state(self):
        state = c_void_p()
        self.must("GetFMUstate", byref(state))
        return state

    def save(self):
        state, size = self.state(), c_size_t()
        self.must("SerializedFMUstateSize", state, byref(size))
        data = buffer(size.value)
        self.must("SerializeFMUstate", state, data, size.value)
        self.must("FreeFMUstate", byref(state))
        return data.raw

    def restore(self, data):
        state = c_void_p()
        status = self.call("DeSerializeFMUstate", data, len(data), byref(state))
        return self.call("SetFMUstate", state) if status == "ok" else status

    def beside(self):
        """Return the bench of another component in the same process."""
        return type(self)(self.fmu.with_name("adaptive_pd.fmu"), self.folder / "beside")

    def twin(self, **other):
        twin = copy(self)
        twin.component, twin.time = self.instance(**other), 0.0
        return twin
