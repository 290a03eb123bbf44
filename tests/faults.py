"""What the FMUs make of misuse. Each fault gets a process of its own, as some end it:

python faults.py FMU FAULT    commits it; prints what the call answers, then what is wrong with the FMU afterwards
python faults.py --table      commits all on both exports and on a system, and writes rov_cosim/exporters/FAULTS.md
"""

import argparse
import json
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_uint32, c_void_p
from dataclasses import dataclass
from functools import partial
from math import inf, nan
from operator import methodcaller
from pathlib import Path
from struct import pack
from tempfile import TemporaryDirectory

from raw_fmi import BEGIN, END, INIT, RUN, SETUP, Bench
from raw_fmi3 import Bench3

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "rov_cosim" / "exporters" / "FAULTS.md"
ACCEPTED = "accepted"


def diverge(one):
    """Step until a step fails; the state must stay that before it."""
    while (status := one.step()) == "ok":
        one.before = one.save()
    return status


def off_by_rounding(one):
    for n in range(500):
        one.step(at=n * 0.03)
    return one.step(at=sum([0.03] * 500))


def lose_thrusters(one):
    one.put(dict(FEW))
    one.before = one.save()
    return one.step()


def spoil_after_reading(one):
    one.must("GetReal", one.outputs, len(one.outputs), (c_double * len(one.outputs))())
    for name, value in LIGHT:
        one.put({name: value})
    one.before = one.save()
    return EXIT(one)


def past_stop_time(one):
    twin = one.twin()
    twin.must("SetupExperiment", 0, 0.0, 0.0, 1, 0.03)
    twin.must("EnterInitializationMode")
    twin.must("ExitInitializationMode")
    twin.check()
    return twin.step()


def altered(alter):
    """Restore the saved state altered in each eighth byte in turn: all must be refused."""

    def act(one):
        good = one.save()
        wrong = [alter(good, i) for i in range(0, len(good) // 8 * 8, 8)]
        answers = [(one.restore(data), *one.messages[-1:]) for data in wrong]
        passed = [answer for answer in answers if answer[0] == "ok"]
        assert one.restore(good) == "ok"
        status, *one.messages = ("ok", f"in {len(passed)} of {len(wrong)} places") if passed else answers[-1]
        return status

    return act


def free_twice(one):
    state = one.state()
    one.must("FreeFMUstate", byref(state))
    return one.call("FreeFMUstate", byref(state))


def together(others):
    """Let instances live side by side."""

    def act(one):
        benches = others(one)
        for bench in benches:
            bench.lead(BEGIN)
        for bench in [*benches, one] * 2:
            bench.check()
        return "ok"

    return act


def in_c_host(one):
    if not shutil.which("cc"):
        return "skipped: there is no C compiler"
    source, program = one.folder / "host.c", one.folder / "host"
    source.write_text(HOST, encoding="utf-8")
    subprocess.run(["cc", f"-D{one.version.upper()}", source, "-o", program, "-ldl"], check=True)
    done = subprocess.run([program, one.path, one.guid, one.resources], capture_output=True, text=True, check=False)
    one.messages[:] = done.stdout.splitlines()
    return {0: "ok", 2: "does not load"}.get(done.returncode, f"ends with {done.returncode}")


HOST = r"""
#include <dlfcn.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#ifdef FMI3
static void show(void *e, int status, const char *category, const char *text) { puts(text); }
static int run(void *library, char *guid, char *resources) {
    void *(*instantiate)(const char *, char *, char *, bool, bool, bool, bool, void *, size_t, void *, void *, void *) =
        dlsym(library, "fmi3InstantiateCoSimulation");
    int (*enter)(void *, bool, double, double, bool, double) = dlsym(library, "fmi3EnterInitializationMode");
    int (*leave)(void *) = dlsym(library, "fmi3ExitInitializationMode");
    int (*step)(void *, double, double, bool, bool *, bool *, bool *, double *) = dlsym(library, "fmi3DoStep");
    void *c = instantiate("host", guid, resources, 0, 1, 0, 0, NULL, 0, NULL, show, NULL);
    bool answers[3];
    double last;
    return !c || enter(c, 0, 0, 0, 0, 0) || leave(c) || step(c, 0, 0.03, 1, answers, answers + 1, answers + 2, &last);
}
#else
static void show(void *e, const char *name, int status, const char *category, const char *text, ...) { puts(text); }
static int run(void *library, char *guid, char *resources) {
    void *callbacks[5] = {show, calloc, free};
    void *(*instantiate)(const char *, int, char *, char *, void *, int, int) = dlsym(library, "fmi2Instantiate");
    int (*setup)(void *, int, double, double, int, double) = dlsym(library, "fmi2SetupExperiment");
    int (*enter)(void *) = dlsym(library, "fmi2EnterInitializationMode");
    int (*leave)(void *) = dlsym(library, "fmi2ExitInitializationMode");
    int (*step)(void *, double, double, int) = dlsym(library, "fmi2DoStep");
    void *c = instantiate("host", 1, guid, resources, callbacks, 0, 1);
    return !c || setup(c, 0, 0, 0, 0, 0) || enter(c) || leave(c) || step(c, 0, 0.03, 1);
}
#endif
int main(int argc, char **argv) {
    void *library = dlopen(argv[1], RTLD_NOW);
    return library ? run(library, argv[2], argv[3]) : (puts(dlerror()), 2);
}
"""


@dataclass(frozen=True)
class Fault:
    """A fault and what the native export answers: ACCEPTED, or a part of its message ("" where no logger can tell)."""

    name: str
    act: Callable[[Bench], str]
    expected: str
    stage: str = RUN
    component: str = "rov_plant"
    given: tuple = ()  # start values; they stay bad, so that afterwards only a reset helps
    resets: bool = False  # whether the fault itself sets values that stay bad
    folder: str = "fmu"
    python: str = ""  # what the page tells of the pythonfmu export in place of an answer
    system: str = ""  # a part of the message of a system, where it is another
    fails: bool = False  # whether a system has failed by it, for some elements took the step
    three: Callable[[Bench3], str] | None = None  # how it is committed by FMI 3.0, where that is otherwise
    only_two: bool = False  # whether FMI 3.0 has no such function


call, put, get = (partial(methodcaller, name) for name in ("call", "put", "get"))
step, make = (partial(methodcaller, name) for name in ("step", "instantiate"))
EXIT = call("ExitInitializationMode")
PAIR, FIRST, SIZE, NOWHERE = (c_double * 2)(), byref(c_uint32(0)), byref(c_size_t()), {"component": None}
EIGHT = (c_double * 8)()
LIGHT = (("I.xx", 0.01), ("I.yy", 0.01), ("added_mass.p", 0.0), ("r_G.z", 0.3))
FEW = tuple((f"thruster[{i}].enabled", 0) for i in range(5, 9))
FREE = (("lock_roll_pitch", 0), ("r_B.z", 0.0), ("F_A.z", 60.0))

# fmt: off
FAULTS = [
    Fault("input set to NaN", put({"u[1]": nan}), "u[1] is nan"),
    Fault("input set to infinity", put({"u[1]": inf}), "u[1] is inf"),
    Fault("two inputs set, the second to NaN", put({"u[1]": 1.0, "u[2]": nan}), "u[2] is nan"),
    Fault("parameter out of range", put({"mass": -5.0}), "mass is -5", BEGIN),
    Fault("Integer parameter out of range", put({"seed": -1}), "seed is -1", BEGIN, "passive_arm"),
    Fault("parameter set to NaN", put({"mass": nan}), "mass is nan", BEGIN),
    Fault("parameter set to infinity", put({"mass": inf}), "mass is inf", BEGIN),
    Fault("parameters of an impossible mass matrix", EXIT, "mass matrix", INIT, given=LIGHT),
    Fault("too few thrusters enabled", EXIT, "enable more thrusters", INIT, "adaptive_pd", given=FEW),
    Fault("too few thrusters enabled during the run", lose_thrusters, "enable more thrusters", component="adaptive_pd",
          resets=True, fails=True),
    Fault("parameters made impossible after the outputs were read", spoil_after_reading, "mass matrix", INIT,
          resets=True),
    Fault("direction not of unit length", EXIT, "unit length", INIT, given=(("thruster[1].d.x", 0.1),)),
    Fault("initial roll while roll is locked", EXIT, "eta_0.phi", INIT, given=(("eta_0.phi", 0.1),)),
    Fault("output set", put({"eta.x": 1.0}), "eta.x is an output"),
    Fault("fixed parameter set during the run", put({"mass": 70.0}), "mass is a fixed"),
    Fault("unknown value reference read", get(99999, "Real"), "reference 99999"),
    Fault("unknown value reference set", put({99999: 1.0}, "Real"), "reference 99999"),
    Fault("Boolean read as Real", get("lock_roll_pitch", "Real"), "lock_roll_pitch (value reference"),
    Fault("Real set as Integer", put({"u[1]": 1}, "Integer"), "u[1] (value reference"),
    Fault("Real read as String", get("u[1]", "String"), "u[1] (value reference"),
    Fault("second derivative of an input", call("SetRealInputDerivatives", FIRST, 1, byref(c_int(2)), PAIR),
          "of order 2", python="-", system="no derivatives", only_two=True),
    Fault("derivative of an input set to NaN",
          call("SetRealInputDerivatives", FIRST, 1, byref(c_int(1)), byref(c_double(nan))), "u[1] is nan", python="-",
          system="no derivatives", only_two=True),
    Fault("directional derivative of an input", call("GetDirectionalDerivative", FIRST, 1, FIRST, 1, PAIR, PAIR),
          "is no output", python="-",
          three=call("GetDirectionalDerivative", FIRST, 1, FIRST, 1, EIGHT, 8, EIGHT, 8)),
    Fault("step of 0 s", step(0.0), "step size is 0"),
    Fault("step of -0.03 s", step(-0.03), "step size is -0.03"),
    Fault("step of NaN", step(nan), "step size is nan"),
    Fault("step of infinity", step(inf), "step size is inf"),
    Fault("step of 1e9 s", step(1e9), "at most 1000000"),
    Fault("step of 1e9 s, sampled component", step(1e9), "at most 1000000", component="adaptive_pd"),
    Fault("step of 5e-15 s, which rounding left over", step(5e-15), ACCEPTED),
    Fault("communication point of 7 s instead of 0 s", step(at=7.0), "communication point 0"),
    Fault("communication point of NaN", step(at=nan), "communication point 0"),
    Fault("communication point off by rounding", off_by_rounding, ACCEPTED),
    Fault("vehicle pushed until it pitches over", diverge, "eta.theta", given=FREE, fails=True),
    Fault("step past the stop time", past_stop_time, "at most the stop time 0.03 s", BEGIN),
    Fault("step before the initialization", step(), "only while running", BEGIN),
    Fault("step during the initialization", step(), "only while running", INIT),
    Fault("fmi2ExitInitializationMode before enter", EXIT, "only while initializing", BEGIN),
    Fault("fmi2EnterInitializationMode twice", call("EnterInitializationMode"), "only while instantiated", INIT),
    Fault("fmi2SetupExperiment twice", lambda one: one.must(*SETUP) or one.call(*SETUP), ACCEPTED, BEGIN,
          only_two=True),
    Fault("fmi2SetupExperiment during the run", call(*SETUP), "only while instantiated", only_two=True),
    Fault("start time of NaN", call("SetupExperiment", 0, 0.0, nan, 0, 0.0), "from nan s", BEGIN,
          three=call("EnterInitializationMode", 0, 0.0, nan, 0, 0.0)),
    Fault("fmi2Terminate before the initialization", call("Terminate"), "only while running", BEGIN),
    Fault("step after fmi2Terminate", step(), "is terminated", END),
    Fault("input set after fmi2Terminate", put({"u[1]": 1.0}), "is terminated", END),
    Fault("fmi2CancelStep without a step to cancel", call("CancelStep"), "no step to cancel", only_two=True),
    Fault("fmi2GetStatus without a pending step", call("GetStatus", 0, byref(c_int())), "no such status",
          only_two=True),
    Fault("wrong GUID", make(guid=b"{wrong}"), "{wrong}"),
    Fault("GUID of NULL", make(guid=None), "GUID is NULL"),
    Fault("instantiated for model exchange", make(type=0), "fmi2CoSimulation"),
    Fault("empty instance name", make(name=b""), "name of the instance"),
    Fault("instance name of NULL", make(name=None), "name of the instance"),
    Fault("callbacks of NULL", make(callbacks=None), "", only_two=True),
    Fault("input set to NaN without a logger",
          lambda one: one.twin(callbacks=(c_void_p * 5)()).put({"u[1]": nan}), "",
          three=lambda one: one.twin(callbacks=None).put({"u[1]": nan})),
    Fault("resource location of NULL", make(resources=None), ACCEPTED),
    Fault("unknown log category", call("SetDebugLogging", 1, 1, byref(c_char_p(b"logAl"))), "no log category logAl"),
    Fault("log category of NULL", call("SetDebugLogging", 1, 1, byref(c_char_p())), "no log category NULL"),
    Fault("fmi2GetReal: vr is NULL", call("GetReal", None, 1, PAIR), "vr is NULL"),
    Fault("fmi2GetReal: value is NULL", call("GetReal", FIRST, 1, None), "value is NULL"),
    Fault("fmi2SetReal: vr is NULL", call("SetReal", None, 1, PAIR), "vr is NULL"),
    Fault("fmi2SetReal: value is NULL", call("SetReal", FIRST, 1, None), "value is NULL"),
    Fault("fmi2GetReal of no variables: all is NULL", call("GetReal", None, 0, None), ACCEPTED),
    Fault("fmi2GetFMUstate: state is NULL", call("GetFMUstate", None), "FMUstate is NULL"),
    Fault("fmi2SetFMUstate: state is NULL", call("SetFMUstate", None), "FMUstate is NULL"),
    Fault("fmi2FreeFMUstate: state is NULL", call("FreeFMUstate", None), ACCEPTED),
    Fault("fmi2SerializedFMUstateSize: state is NULL", call("SerializedFMUstateSize", None, SIZE), "FMUstate is NULL"),
    Fault("fmi2SerializeFMUstate: state is NULL", call("SerializeFMUstate", None, PAIR, 16), "FMUstate is NULL"),
    Fault("fmi2SerializeFMUstate into too few bytes", lambda one: one.call("SerializeFMUstate", one.state(), PAIR, 16),
          "room for 16 bytes", python="undefined: it writes past their end"),
    Fault("fmi2DeSerializeFMUstate: bytes are NULL", call("DeSerializeFMUstate", None, 16, byref(c_void_p())),
          "serializedState is NULL"),
    Fault("fmi2GetReal: component is NULL", call("GetReal", FIRST, 1, PAIR, **NOWHERE), ""),
    Fault("fmi2DoStep: component is NULL", call("DoStep", 0.0, 0.03, 1, **NOWHERE), ""),
    Fault("fmi2FreeInstance: component is NULL", call("FreeInstance", **NOWHERE), ACCEPTED),
    Fault("nonsense restored as a state", methodcaller("restore", b"nonsense"), "8 bytes; expected"),
    Fault("saved state without its last byte", lambda one: one.restore(one.save()[:-1]), "bytes; expected"),
    Fault("saved state of another component", lambda one: one.restore(one.beside().save()), "bytes; expected"),
    Fault("state of another component serialised", lambda one: one.call("SerializeFMUstate", one.beside().state(),
          (c_double * 999)(), 7992), "of another component", python="undefined: it takes any state for its own"),
    Fault("state saved over that of another component",
          lambda one: one.call("GetFMUstate", byref(one.beside().state())), "of another component"),
    Fault("state of another component, not serialised", lambda one: one.call("SetFMUstate", one.beside().state()),
          "of another component"),
    Fault("saved state with a flipped bit, in each eighth byte in turn",
          altered(lambda good, i: good[:i] + bytes([good[i] ^ 16]) + good[i + 1 :]), "damaged"),
    Fault("saved state with a NaN, in each eighth byte in turn",
          altered(lambda good, i: good[:i] + pack("<d", nan) + good[i + 8 :]), "damaged"),
    Fault("state freed twice: the first time makes it NULL", free_twice, ACCEPTED,
          python="undefined: may crash, as it frees the state twice"),
    Fault("second instance in the process", together(lambda one: [one.twin()]), ACCEPTED),
    Fault("another component in the process", together(lambda one: [one.beside()]), ACCEPTED),
    Fault("100 instances", together(lambda one: [one.twin() for _ in range(99)]), ACCEPTED),
    Fault("unpacked into a folder with a space", step(), ACCEPTED, folder="a b"),
    Fault("unpacked into a folder with #", step(), ACCEPTED, folder="a#b"),
    Fault("unpacked into a folder with %", step(), ACCEPTED, folder="a%20b"),
    Fault("unpacked into a folder with non-ASCII characters", step(), ACCEPTED, folder="Fähre 海"),
    Fault("host in C, without libpython", in_c_host, ACCEPTED),
]

OF_THREE = [
    Fault("7 values for the 8 elements of u", call("SetFloat64", FIRST, 1, EIGHT, 7), "7 values; expected 8"),
    Fault("room for 9 values of the 8 elements of u", call("GetFloat64", FIRST, 1, (c_double * 9)(), 9),
          "9 values; expected 8"),
    Fault("value reference of an element within an array", get(1, "Real"), "no variable with value reference 1"),
    Fault("time set", lambda one: one.call("SetFloat64", byref(c_uint32(one.time_reference)), 1, PAIR, 1),
          "independent variable"),
    Fault("Float64 read as Float32", call("GetFloat32", FIRST, 1, PAIR, 1), "u (value reference 0) is of type Float64"),
    Fault("Float64 read as Binary", call("GetBinary", FIRST, 1, PAIR, PAIR, 1), "u (value reference 0)"),
    Fault("clock read", call("GetClock", FIRST, 1, PAIR), "no clocks"),
    Fault("instantiated for Scheduled Execution", make(type="ScheduledExecution"), "expected Co-Simulation"),
    Fault("instantiated with Event Mode", make(event_mode=1), "hasEventMode is false"),
    Fault("instantiated with an intermediate variable", make(intermediate=1), "providesIntermediateUpdate is false"),
    Fault("fmi3EnterEventMode", call("EnterEventMode"), "no Event Mode"),
    Fault("fmi3EnterStepMode", call("EnterStepMode"), "no Event Mode"),
    Fault("fmi3EnterConfigurationMode", call("EnterConfigurationMode"), "no structural parameters", BEGIN),
    Fault("fmi3GetContinuousStates", call("GetContinuousStates", PAIR, 1), "not for Model Exchange"),
    Fault("fmi3GetOutputDerivatives", call("GetOutputDerivatives", FIRST, 1, FIRST, PAIR, 1),
          "maxOutputDerivativeOrder"),
    Fault("fmi3GetNumberOfVariableDependencies", call("GetNumberOfVariableDependencies", 0, SIZE),
          "providesPerElementDependencies"),
    Fault("fmi3DoStep: lastSuccessfulTime is NULL",
          lambda one: one.call("DoStep", 0.0, 0.03, 1, *[byref(c_int())] * 3, None), "lastSuccessfulTime is NULL"),
    Fault("adjoint derivative of an input", call("GetAdjointDerivative", FIRST, 1, FIRST, 1, EIGHT, 8, EIGHT, 8),
          "is no output"),
    Fault("adjoint derivative with a weight of NaN",
          lambda one: one.call("GetAdjointDerivative", one.outputs, 1, FIRST, 1, (c_double * 6)(nan), 6, EIGHT, 8),
          "change of eta.x is not finite"),
    Fault("directional derivative with too short a seed",
          lambda one: one.call("GetDirectionalDerivative", one.outputs, 1, FIRST, 1, EIGHT, 7, EIGHT, 6),
          "7 values; expected 8"),
]
"""Those that FMI 3.0 alone has."""
# fmt: on


SYSTEM = "station_keeping"
FMI3 = "fmi3"
SAME = "the same"
WORDS = {"GUID": "instantiation token", "fmi2CoSimulation": "Co-Simulation", "vr is": "valueReferences is"}
WORDS |= {"value is NULL": "values is NULL", "u[1] (value": "u (value", "fmi2": "fmi3"}
ELEMENTS = {"adaptive_pd": "controller"}
INPUTS = {"u[1]": "rov_plant.current.x", "u[2]": "rov_plant.current.y"}  # those of a vehicle have sources in a system


def expected(fault: Fault, fmu: str) -> str:
    """Return a part of the message that an FMU answers to a fault."""
    if fmu == FMI3:
        return in_three(fault.expected)
    if fmu != SYSTEM:
        return fault.expected
    text = fault.system or fault.expected
    for name, input_ in INPUTS.items():
        text = text.replace(name, input_)
    return text


def in_three(text: str) -> str:
    """Return a part of a message of FMI 2.0 as FMI 3.0 has it."""
    for two, three in WORDS.items():
        text = text.replace(two, three)
    return text


def names_in_system(one: Bench, component: str) -> dict[str, str]:
    """Return the variables of a system by their names in a component, as the faults have them."""
    element = ELEMENTS.get(component, component)
    own = {name.removeprefix(f"{element}."): name for name in one.references if name.startswith(f"{element}.")}
    return own | INPUTS


def has_failed(one: Bench) -> bool:
    """Tell whether a system lives on after a reset alone."""
    return one.step() == "error" and "the component is stopped by a failure" in " ".join(one.messages)


def commit(fmu: Path, fault: Fault) -> None:
    """Print a line of JSON with the answer of the call, and one with what is wrong afterwards, if anything is."""
    with TemporaryDirectory() as folder:
        three = fmu.parent.name == FMI3
        one = (Bench3 if three else Bench)(fmu, Path(folder) / fault.folder)
        if fmu.stem == SYSTEM:
            one.alias(names_in_system(one, fault.component))
        for name, value in fault.given:
            assert one.put({name: value}) == "ok"
        one.lead(BEGIN, fault.stage)
        one.before = one.save()
        status = ((three and fault.three) or fault.act)(one)
        text = (
            " ".join(" ".join(one.messages).split()).replace(f"{one.folder}/", "").replace(one.guid.decode(), "{...}")
        )
        print(json.dumps({"status": status, "text": text}), flush=True)
        try:
            fails = fault.fails and fmu.stem == SYSTEM
            assert status == "ok" or one.save() == one.before or (fails and has_failed(one)), "the state is another"
            if not (fault.given or fault.resets):
                one.check(step=False)
                if fault.stage != END:
                    one.lead(fault.stage)
                    one.check()
            one.must("Reset")
            one.time = 0.0
            one.lead(BEGIN)
            one.check()
            one.call("FreeInstance")
        except AssertionError as error:
            print(json.dumps({"problem": str(error)}), flush=True)


def answer(fmu: Path, fault: Fault) -> str:
    """Commit a fault in a process of its own; return what came of it."""
    command = [sys.executable, __file__, fmu, fault.name]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    except subprocess.TimeoutExpired:
        return "hang"
    assert done.returncode <= 0, done.stderr  # the fault could not be committed
    said = {"problem": ""}
    for line in done.stdout.splitlines():
        said |= json.loads(line) if line.startswith('{"') else {}
    end = f"crash ({signal.Signals(-done.returncode).name})" if done.returncode else said["problem"]
    if "status" not in said:
        return end
    status = ACCEPTED if said["status"] in ("ok", "warning") else said["status"]
    return status + (said["text"] and f": {said['text']}") + (end and f"; afterwards: {end}")


def answers(fmus: dict[str, Path], export: str) -> dict[str, str]:
    """Return what came of each fault, by its name; the export may be "system", of which there is one, or `FMI3`."""
    with ThreadPoolExecutor(2) as pool:
        known = {fault.name: fault.python for fault in FAULTS if fault.python and export == "pythonfmu"}
        known |= {fault.name: "-" for fault in FAULTS if fault.only_two and export == FMI3}
        jobs = {
            f.name: pool.submit(answer, fmus[SYSTEM if export == "system" else f.component], f)
            for f in (*FAULTS, *(OF_THREE if export == FMI3 else ()))
            if f.name not in known
        }
        return known | {name: job.result() for name, job in jobs.items()}


def page(native: dict[str, str], python: dict[str, str], system: dict[str, str], three: dict[str, str]) -> str:
    """Return the page for the answers of both exports, of a system, and of FMI 3.0."""
    text = INTRODUCTION
    for title, harmless in (("Must be refused", False), ("Must be accepted", True)):
        text += f"\n## {title}\n\n| fault | native | pythonfmu | system | FMI 3.0 |\n|---|---|---|---|---|\n"
        for fault in FAULTS:
            if (fault.expected == ACCEPTED) == harmless:
                answers = (
                    native[fault.name],
                    python[fault.name],
                    system[fault.name],
                    beside(native, three)[fault.name],
                )
                text += f"| {' | '.join((fault.name, *answers))} |\n".replace("*", r"\*")
    text += INTRODUCTION_OF_THREE
    for fault in OF_THREE:
        text += f"| {fault.name} | {three[fault.name]} |\n".replace("*", r"\*")
    return text


def beside(native: dict[str, str], three: dict[str, str]) -> dict[str, str]:
    """Return the answers of FMI 3.0 as they stand beside those of the native FMUs of 2.0."""
    return {name: SAME if answer_ == native.get(name) else answer_ for name, answer_ in three.items()}


INTRODUCTION = """\
# What the FMUs make of misuse

Every fault is committed by raw calls of FMI in a process of its own. Afterwards the FMU must be as before, take a good
step, and run again after a reset; what went wrong then follows *afterwards*. A status (*error*, *discard*, *fatal*;
*NULL* from fmi2Instantiate) stands with the message logged; *accepted* is success without a complaint, *crash* the end
of the process by a signal, *hang* no answer in a minute, *-* what an export does not have. The system is
`station_keeping.fmu`, of native components; there inputs stand for others that are connected. FMI 3.0 stands for the
native FMUs of that version: *the same* as native, or their own words.
`python tests/faults.py --table` writes this page.
"""

INTRODUCTION_OF_THREE = """
## What FMI 3.0 alone knows

| fault | FMI 3.0 |
|---|---|
"""


def write_page() -> None:
    """Commit all faults on current FMUs and write the page."""
    from rov_cosim.exporters.build import EXPORTS, FMI3, build_fmus, fmu_path
    from rov_cosim.study import archives
    from rov_cosim.systems.catalogue import SYSTEMS

    fmus = {export: {path.stem: path for path in build_fmus(ROOT, export)} for export in EXPORTS}
    archives.build(SYSTEMS[SYSTEM])
    fmus["system"] = {SYSTEM: fmu_path(ROOT, SYSTEM)}
    fmus[FMI3] = {path.stem: path for path in build_fmus(ROOT, FMI3)}
    PAGE.write_text(page(*(answers(those, export) for export, those in fmus.items())), encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("fmu", type=Path, nargs="?")
    parser.add_argument("fault", nargs="?", choices=[fault.name for fault in (*FAULTS, *OF_THREE)], metavar="fault")
    parser.add_argument("--table", action="store_true", help="write rov_cosim/exporters/FAULTS.md")
    given = parser.parse_args()
    if given.table:
        write_page()
    elif given.fault:
        commit(given.fmu, next(fault for fault in (*FAULTS, *OF_THREE) if fault.name == given.fault))
    else:
        parser.error("expected FMU and FAULT, or --table")
