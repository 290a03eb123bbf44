"""The native binaries: what they need, what they export, how they are made; and hosts without Python."""

import re
import shutil
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import lief
import numpy as np
import pytest
from fmpy import extract, read_model_description
from fmpy.validation import validate_fmu

from fmu import Fmu
from rig import RELAXED, random_inputs
from rov_cosim.components.cases import Case
from rov_cosim.exporters import archive, native_export, zig
from rov_cosim.exporters.build import components
from rov_cosim.handover import reference

COMPONENTS = components()
NAMES = list(COMPONENTS)
EVERYWHERE = ("adaptive_pd", "passive_arm", "rov_plant")
"""Those that are compiled for each platform: sampled, with noise, continuous. The rest differs in its equations."""
HEADERS = files("fmpy") / "c-code"
LIBRARIES = {
    "linux64": {"libc.so.6", "libm.so.6"},
    "win64": {"KERNEL32.dll"},
    "darwin64": {"/usr/lib/libSystem.B.dylib"},
    "aarch64-linux": {"libc.so.6", "libm.so.6"},
    "aarch64-windows": {"KERNEL32.dll"},
}
ARCHITECTURES = {"x86_64": lief.Header.ARCHITECTURES.X86_64, "aarch64": lief.Header.ARCHITECTURES.ARM64}
# fmt: off
HARMLESS = {
    "acos", "asin", "atan2", "ceil", "cos", "exp", "expm1", "fabs", "floor", "fmax", "fmin", "log", "nextafter", "pow",
    "sin", "sincos", "sqrt", "tan",
    "bcmp", "memchr", "memcmp", "memcpy", "memset", "snprintf", "strchr", "strcmp", "strcpy", "strlen", "strncpy",
    "strpbrk", "vsnprintf",
    "calloc", "free", "malloc",
}
# fmt: on
MODEL_EXCHANGE = {
    "fmi2EnterEventMode",
    "fmi2NewDiscreteStates",
    "fmi2EnterContinuousTimeMode",
    "fmi2CompletedIntegratorStep",
    "fmi2SetTime",
    "fmi2SetContinuousStates",
    "fmi2GetDerivatives",
    "fmi2GetEventIndicators",
    "fmi2GetContinuousStates",
    "fmi2GetNominalsOfContinuousStates",
}
STANDARD = (
    set(re.findall(r"#define (fmi2\w+) +fmi2FullName", (HEADERS / "fmi2Functions.h").read_text(encoding="utf-8")))
    - MODEL_EXCHANGE
)


@pytest.fixture(scope="session")
def universal(tmp_path_factory) -> dict[str, Path]:
    """Return FMUs with the binaries of every platform by component name."""
    folder = tmp_path_factory.mktemp("universal")
    for name in EVERYWHERE:
        native_export.export(COMPONENTS[name], folder / f"{name}.fmu", zig.TARGETS)
    return {name: folder / f"{name}.fmu" for name in EVERYWHERE}


def assert_self_sufficient(fmu, name, platform):
    content = archive.read(fmu)[f"binaries/{platform}/{name}{zig.SUFFIXES[platform]}"]
    parsed = lief.MachO.parse(list(content)) if platform == "darwin64" else [lief.parse(list(content))]
    for binary, target in zip(parsed, zig.TARGETS[platform], strict=True):
        assert binary.abstract.header.architecture == ARCHITECTURES[target.split("-")[0]]
        libraries = {getattr(library, "name", library) for library in binary.libraries}
        own = {f"{name}.dylib"}  # a Mach-O names itself, and Windows has its C runtime in parts
        assert {lib for lib in libraries - own if not lib.startswith("api-ms-win-crt-")} <= LIBRARIES[platform]
        exported = {function.name for function in binary.exported_functions}
        if platform == "darwin64":  # C names begin with _ there; the linker adds two of its own
            exported = {name.removeprefix("_") for name in exported - {"___dso_handle", "__mh_dylib_header"}}
        assert exported == STANDARD
        if platform == "darwin64":
            assert tuple(binary.build_version.minos)[:2] <= (11, 0)
        if zig.SUFFIXES[platform] == ".so":
            versions = {v.name for needed in binary.symbols_version_requirement for v in needed.get_auxiliary_symbols()}
            assert max(tuple(map(int, v.removeprefix("GLIBC_").split("."))) for v in versions) <= (2, 17)


@pytest.mark.parametrize("name", NAMES)
def test_the_linux_binary_needs_an_old_libc_alone_and_exports_fmi_alone(fmus, name):
    assert_self_sufficient(fmus[name], name, "linux64")


SYSTEM = "station_keeping"


def test_the_binary_of_a_system_needs_and_exports_no_more(systems):
    assert_self_sufficient(systems[SYSTEM], SYSTEM, "linux64")


@pytest.mark.parametrize("name", [*NAMES, SYSTEM])
def test_the_binary_calls_mathematics_text_and_memory_alone_and_has_no_variables_of_its_own(fmus, systems, name):
    path = systems[name] if name == SYSTEM else fmus[name]
    binary = lief.parse(list(archive.read(path)[f"binaries/linux64/{name}.so"]))
    imported = {function.name for function in binary.imported_functions}
    assert imported - {"__cxa_finalize", "__stack_chk_fail", ""} <= HARMLESS
    written = {section.name: section.size for section in binary.sections if section.name in (".data", ".bss")}
    # What each component knows of the processor, and the linker's own; what an instance needs is in its memory.
    assert sum(written.values()) <= 16


CPU = Path("/proc/cpuinfo")


@pytest.mark.skipif(not CPU.exists() or " avx " not in CPU.read_text(encoding="utf-8"), reason="no AVX, or not told")
@pytest.mark.parametrize("name", EVERYWHERE)
def test_what_is_stepped_by_avx_gives_the_same_bits(fmus, tmp_path, name):
    sources, place = native_export.sources(COMPONENTS[name]), native_export.binary_place(name, zig.host_platform())
    changes = {"never": (b"(low & SAVED) == SAVED", b"0"), "or nothing": (b": body(arg, res, iw, w, mem)", b": 1")}
    outputs, random = {}, np.random.default_rng(3)
    inputs = [random_inputs(COMPONENTS[name], random) for _ in range(100)]
    for label, change in changes.items():
        header = sources["processor.h"].replace(*change)
        assert header != sources["processor.h"]
        binary = zig.shared_library(name, {**sources, "processor.h": header}, zig.host_platform())
        archive.write(tmp_path / f"{label}.fmu", {**archive.read(fmus[name]), place: binary})
        fmu = Fmu(tmp_path / f"{label}.fmu", tmp_path / label)
        fmu.set(RELAXED[name])
        fmu.start()
        outputs[label] = []
        for n, values in enumerate(inputs):
            fmu.set(values)
            fmu.step(n)
            outputs[label].append(fmu.outputs())
    assert outputs["never"] == outputs["or nothing"]
    assert outputs["never"][0] != outputs["never"][99]


def test_memory_is_taken_for_instances_and_saved_states_alone():
    sources = {file.name: file.read_text(encoding="utf-8") for file in (files("rov_cosim.exporters") / "c").iterdir()}
    takers = {name for name, text in sources.items() if re.search(r"\b(m|c|re)alloc\b", text)}
    assert takers == {"slave.c", "keeping.c"}
    assert sources["slave.c"].count("alloc(") == sources["keeping.c"].count("malloc(") == 1


def test_a_source_that_does_not_compile_ends_the_build_with_the_compilers_words():
    with pytest.raises(zig.BuildError, match="no_such_thing"):
        zig.shared_library("broken", {"broken.c": b"int f(void) { return no_such_thing; }"}, "linux64")


@pytest.fixture
def no_home(monkeypatch):
    """Take away all that tells where a home or a cache is."""
    for variable in ("ZIG_GLOBAL_CACHE_DIR", "LOCALAPPDATA", "XDG_CACHE_HOME", "HOME"):
        monkeypatch.delenv(variable, raising=False)


@pytest.mark.parametrize("home", [None, "/proc/none", __file__], ids=["none", "one that cannot be made", "a file"])
def test_the_compiler_needs_no_home(no_home, monkeypatch, tmp_path, home):
    if home:
        monkeypatch.setenv("HOME", home)
    script = """
from rov_cosim.exporters import zig
assert zig.compiled({"f.c": b"int f(void) { return 1; }"}, zig.host_target(), "f.o", ["-c"])
"""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    subprocess.run([sys.executable, "-c", script], check=True, timeout=120)
    assert list(tmp_path.iterdir()) == []


def test_the_compiler_keeps_its_usual_cache_where_there_is_one(no_home, monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    zig.compiled({"f.c": b"int f(void) { return 1; }"}, zig.host_target(), "f.o", ["-c"])
    assert any((tmp_path / ".cache" / "zig").iterdir())


def test_a_compiler_that_does_not_end_is_ended(monkeypatch):
    monkeypatch.setattr(zig, "TIME_LIMIT", 0.0)
    with pytest.raises(zig.BuildError, match="does not end for x86_64-windows-gnu within 0 s"):
        zig.compiled({"f.c": b"int f(void) { return 1; }"}, "x86_64-windows-gnu", "f.o", ["-c"])


@pytest.mark.slow
@pytest.mark.parametrize("platform", zig.TARGETS)
@pytest.mark.parametrize("name", EVERYWHERE)
def test_the_binary_of_each_platform_needs_its_c_library_alone(universal, name, platform):
    assert_self_sufficient(universal[name], name, platform)
    assert validate_fmu(str(universal[name])) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", EVERYWHERE)
def test_rebuilt_binaries_are_the_same_to_the_byte(universal, tmp_path, name):
    again = tmp_path / f"{name}.fmu"
    native_export.export(COMPONENTS[name], again, zig.TARGETS)
    assert again.read_bytes() == universal[name].read_bytes()


@pytest.mark.slow
def test_an_fmu_keeps_the_binaries_of_other_platforms_while_they_are_current(universal, tmp_path):
    path = tmp_path / "passive_arm.fmu"
    shutil.copy(universal["passive_arm"], path)
    assert not native_export.export(COMPONENTS["passive_arm"], path)
    archive.write(path, {**archive.read(path), "sources/model.c": b"/* of an older version */"})
    assert native_export.export(COMPONENTS["passive_arm"], path, ["linux64"])
    assert {name.split("/")[1] for name in archive.read(path) if name.startswith("binaries/")} == {"linux64"}


def test_the_binary_of_another_compiler_does_not_pass_for_ours(fmus, tmp_path):
    path = tmp_path / "passive_arm.fmu"
    archive.write(
        path, {**archive.read(fmus["passive_arm"]), "binaries/linux64/passive_arm.so": b"of another compiler"}
    )
    assert native_export.export(COMPONENTS["passive_arm"], path)
    assert archive.read(path) == archive.read(fmus["passive_arm"])


LONG = Case(
    "long",
    "A minute of poses and set-points that move",
    2000,
    lambda t: {
        "eta_m_valid": 1.0,
        "eta_m": 0.4 * np.sin(np.outer(t, [0.33, 0.37, 0.4, 0.43, 0.47, 0.5])),
        "eta_d": 0.3 * np.cos(np.outer(t, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6])),
    },
)


def compiled_host(folder: Path, target: str, suffix: str = "") -> Path:
    host = folder / f"host{suffix}"
    source = files("rov_cosim.handover") / "host.c"
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-I", HEADERS, "-o", host]
    libraries = [] if "windows" in target else ["-ldl", "-lm"]
    command = [sys.executable, "-m", "ziglang", "cc", "-target", target, *flags, source, *libraries]
    subprocess.run(command, check=True, cwd=folder)
    return host


def assert_host_agrees(command, fmu, folder):
    (folder / "script.txt").write_text(
        reference.script(reference.run(COMPONENTS["adaptive_pd"], LONG)), encoding="utf-8"
    )
    done = subprocess.run(
        [*command, read_model_description(fmu).guid, "script.txt"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    steps, deviation = re.fullmatch(r"(\d+) steps, largest deviation (\S+)\s*", done.stdout).groups()
    assert int(steps) == 2000
    assert float(deviation) < 1e-9


@pytest.mark.slow
def test_a_c_host_gets_the_reference_numbers(fmus, tmp_path):
    folder = Path(extract(fmus["adaptive_pd"], tmp_path / "fmu"))
    host = compiled_host(tmp_path, "x86_64-linux-gnu")
    library = folder / "binaries" / "linux64" / "adaptive_pd.so"
    assert_host_agrees([host, library], str(fmus["adaptive_pd"]), tmp_path)


@pytest.mark.wine
@pytest.mark.skipif(shutil.which("wine") is None, reason="wine is not installed")
def test_the_windows_binary_runs_under_wine(universal, tmp_path):
    folder = Path(extract(universal["adaptive_pd"], tmp_path / "fmu"))
    host = compiled_host(tmp_path, "x86_64-windows-gnu", ".exe")
    library = folder / "binaries" / "win64" / "adaptive_pd.dll"
    assert_host_agrees(["wine", host, library], str(universal["adaptive_pd"]), tmp_path)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cmake") is None or shutil.which("cc") is None, reason="needs cmake and a C compiler")
@pytest.mark.parametrize("name", NAMES)
def test_fmpy_compiles_the_source_inside(fmus, tmp_path, name):
    place = f"binaries/linux64/{name}.so"
    content = archive.read(fmus[name])
    shipped = content.pop(place)
    path = tmp_path / f"{name}.fmu"
    archive.write(path, content)
    command = [Path(sys.executable).with_name("fmpy"), "compile", path, "--all-warnings", "--warning-as-error"]
    subprocess.run(command, check=True, cwd=tmp_path)
    compiled = archive.read(path)[place]
    assert compiled != shipped
    exported = {function.name for function in lief.parse(list(compiled)).exported_functions}
    assert {symbol for symbol in exported if not symbol.startswith("_")} == STANDARD
    one, reference = Fmu(path, tmp_path / "one"), Fmu(fmus[name], tmp_path / "reference")
    for fmu in (one, reference):
        fmu.start()
        for n in range(100):
            fmu.step(n)
    assert one.outputs() == pytest.approx(reference.outputs(), rel=1e-9, abs=1e-12)
