"""Native components under any sequence of FMI calls, by libFuzzer and the sanitizers; fuzz.c tells what must hold."""

import os
import re
import shutil
import subprocess
from pathlib import Path
from random import Random

import pytest

from rov_cosim.exporters.build import components
from rov_cosim.exporters.native_export import sources
from rov_cosim.ssp.declaration import wire
from rov_cosim.systems.catalogue import SYSTEMS
from rov_cosim.whole import face

COMPONENTS = components()
SANITIZERS = "-fsanitize=fuzzer,address,undefined,float-cast-overflow"
COMPILE = ["clang", "-std=c99", "-g", "-O1", SANITIZERS, "-fno-sanitize-recover=all"]
RUNS = 1000
LONGEST = 1000
LIMITS = ["-timeout=30", "-rss_limit_mb=2048", "-len_control=0", f"-max_len={LONGEST}", "-print_funcs=0"]
FIRST_CASES = 200
TRIVIAL = "int LLVMFuzzerTestOneInput(const char *data, unsigned long size) { return !data && size; }"


def compiled(folder: Path, *options: str) -> Path:
    program = folder / "fuzz"
    command = [*COMPILE, *options, *sorted(folder.glob("*.c")), "-lm", "-o", program]
    subprocess.run(command, capture_output=True, text=True, check=True)
    return program


def fuzz(program: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if not k.endswith("SAN_OPTIONS")}
    command = [program, "-seed=1", *LIMITS, *arguments]
    return subprocess.run(
        command, cwd=program.parent, env=environment, capture_output=True, text=True, errors="replace", check=False
    )


@pytest.fixture(scope="module")
def leaks(tmp_path_factory) -> str:
    """Return the option for leaks: they are not looked for where LeakSanitizer may not trace the process."""
    if not shutil.which("clang"):
        pytest.skip("clang is not installed")
    folder = tmp_path_factory.mktemp("trivial")
    (folder / "fuzz.c").write_text(TRIVIAL, encoding="utf-8")
    try:
        program = compiled(folder)
    except subprocess.CalledProcessError as error:
        pytest.skip(f"clang has no libFuzzer or sanitizers here: {error.stderr[-300:]}")
    done = fuzz(program, "-runs=10")
    if done.returncode and "LeakSanitizer has encountered a fatal error" in done.stderr:
        return "-detect_leaks=0"
    assert done.returncode == 0, done.stderr
    return "-detect_leaks=1"


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("name", COMPONENTS)
def test_calls_in_any_order_keep_the_instance_whole(name, fmi, leaks, tmp_path):
    for file, content in sources(COMPONENTS[name], fmi).items():
        (tmp_path / file).write_bytes(content)
    keeps_whole(tmp_path, leaks, fmi)


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
def test_calls_in_any_order_keep_a_system_whole(fmus, fmi, leaks, tmp_path):
    wiring = wire(SYSTEMS["station_keeping"], fmus)
    for name, content in face.entries(wiring, {}, fmi=fmi).items():
        if name.startswith("sources/"):
            path = tmp_path / name.removeprefix("sources/")
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(content)
    keeps_whole(tmp_path, leaks, fmi, "-DSYSTEM", f"-I{tmp_path / 'system'}")


def keeps_whole(tmp_path, leaks, fmi, *options):
    for file in ("fuzz.c", f"fuzz_fmi{fmi}.h"):
        shutil.copy(Path(__file__).with_name(file), tmp_path)
    options = [*options, "-DFMI3"] if fmi == 3 else options
    cases, random = tmp_path / "cases", Random(1)
    cases.mkdir()
    for i in range(FIRST_CASES):  # random mutations alone take long to grow into long sequences
        (cases / str(i)).write_bytes(random.randbytes(LONGEST // 2))
    done = fuzz(compiled(tmp_path, *options), f"-runs={RUNS}", leaks, cases)
    assert done.returncode == 0, done.stderr[-6000:]
    runs = re.search(r"Done (\d+) runs", done.stderr)  # it ends with the case that it is at, and its kin
    assert runs, done.stderr[-600:]
    assert int(runs[1]) >= RUNS
