"""A release: its lists tell of all that lies there, its wheel has nothing strange, and any machine makes the same."""

import json
import os
import shutil
import subprocess
import sys
from base64 import b64encode
from hashlib import sha256
from pathlib import Path
from zipfile import ZipFile

import pytest
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from packaging.requirements import Requirement

from rov_cosim.release import bill, settled, source
from typed import call, one_line

ROOT = Path(__file__).parent.parent
FILES = {"kits/a-0.1.0.zip": b"kit", "fmus/a.fmu": b"fmu", "a.whl": b"wheel", "kits/pid-0.1.0.zip": b"kit"}


@pytest.fixture(scope="module")
def listed(tmp_path_factory):
    """Return a folder of some files with the lists of a release, and its bill."""
    folder = tmp_path_factory.mktemp("release")
    for name, content in FILES.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(content)
    bill.write(folder, "0123abc")
    return folder, json.loads((folder / bill.BILL).read_text(encoding="utf-8"))


def files_of(told):
    """Return the SHA-256 of each file in a bill by name."""
    parts = [part for part in told["components"] if part["type"] == "file"]
    return {part["name"]: part["hashes"][0]["content"] for part in parts}


def test_sha256sum_takes_the_checksums_of_all_files_and_finds_a_changed_one(listed, tmp_path):
    folder = shutil.copytree(listed[0], tmp_path / "copy")
    command = ["sha256sum", "--check", "--strict", bill.CHECKSUMS]
    done = subprocess.run(command, cwd=folder, capture_output=True, encoding="utf-8", check=True)
    told = {line.removesuffix(": OK") for line in done.stdout.splitlines()}
    assert told == {*FILES, bill.BILL, bill.CONSTRAINTS}
    (folder / "a.whl").write_bytes(b"wheels")
    assert subprocess.run(command, cwd=folder, capture_output=True, check=False).returncode == 1


def test_the_bill_is_valid_and_has_the_files_and_every_package_of_the_wheel(listed):
    folder, told = listed
    assert JsonStrictValidator(SchemaVersion.V1_6).validate_str(json.dumps(told)) is None
    constraints = (folder / bill.CONSTRAINTS).read_bytes()
    contents = {**FILES, bill.CONSTRAINTS: constraints}
    assert files_of(told) == {name: sha256(content).hexdigest() for name, content in contents.items()}
    assert {"name": "rov-cosim:commit", "value": "0123abc"} in told["metadata"]["properties"]
    packages = {part["name"]: part for part in told["components"] if part.get("purl", "").startswith("pkg:pypi/")}
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8").partition("[project.optional-dependencies]")[0]
    needed = {name for name, part in packages.items() if part["scope"] == "required"}
    assert {"numpy", "lxml", "fmpy"} <= {name for name in needed if f'"{name}>=' in project}
    assert {packages[name]["scope"] for name in ("ziglang", "casadi", "setuptools")} == {"excluded"}
    pinned = [Requirement(line) for line in constraints.decode().splitlines()]
    assert {one.name: str(one.specifier) for one in pinned} == {n: f"=={p['version']}" for n, p in packages.items()}


def test_the_bill_has_the_libraries_of_the_pages_as_they_are_fetched(listed):
    _, told = listed
    web = ROOT / "rov_cosim" / "report" / "web"
    found = {part["name"]: part for part in told["components"] if part.get("purl", "").startswith("pkg:npm/")}
    asked = json.loads((web / "package.json").read_text(encoding="utf-8"))["dependencies"]
    assert {name: part["version"] for name, part in found.items()} == asked
    lock = (web / "package-lock.json").read_text(encoding="utf-8")
    for name, part in found.items():
        assert part["purl"] == f"pkg:npm/{name}@{asked[name]}"
        assert part["licenses"] == [{"expression": "MIT"}]
        (digest,) = part["hashes"]
        assert f"sha512-{b64encode(bytes.fromhex(digest['content'])).decode()}" in lock


def test_the_lists_tell_of_no_time_and_no_chance(listed, tmp_path):
    copy = shutil.copytree(listed[0], tmp_path / "copy", ignore=shutil.ignore_patterns("sbom*", "constraints*", "SHA*"))
    bill.write(copy, "0123abc")
    assert bill.checksums(copy) == bill.checksums(listed[0])


def test_what_no_wheel_should_have_is_found(tmp_path):
    entries = {
        "rov_cosim/components/pid/equations.py": b"x = 1\n",
        "rov_cosim-0.1.0.dist-info/RECORD": b"\n",
        "rov_cosim/left_over.py": b"x = 1\n",
        "rov_cosim/whole/c/loop.o": b"\x7fELF\0",
        "rov_cosim/cli/main.py": b"\x7fELF\0",
        "rov_cosim/cli/words.py": b"\xff\xfe",
    }
    with ZipFile(tmp_path / "some.whl", "w") as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    names = ["components/pid/equations.py", "rov_cosim/cli/main.py", "rov_cosim/cli/words.py"]
    assert source.strange(tmp_path / "some.whl", names) == list(entries)[2:]


def test_a_release_is_of_a_clone_without_changes(tmp_path):
    def git(*arguments):
        subprocess.run(["git", "-c", "user.name=A", "-c", "user.email=a@b", *arguments], cwd=tmp_path, check=True)

    with pytest.raises(source.ReleaseError, match="is made in a clone of the repository"):
        source.commit(tmp_path)
    git("init", "-q")
    (tmp_path / "setup.py").write_text("", encoding="utf-8")
    git("add", ".")
    git("commit", "-q", "-m", "First")
    commit = source.commit(tmp_path)
    assert len(commit) == 40
    (tmp_path / "more.py").write_text("", encoding="utf-8")
    with pytest.raises(source.ReleaseError, match=r"more.py differs from what is committed: commit it, or take --unco"):
        source.commit(tmp_path)
    assert source.commit(tmp_path, uncommitted=True) == f"{commit}+"


def test_a_folder_that_holds_something_is_left_alone(tmp_path):
    (tmp_path / "mine").write_text("", encoding="utf-8")
    told = one_line(call("release", "scenario", "--uncommitted", "--output", tmp_path))
    assert told == f"Error: {tmp_path} is not empty: remove it, or name another by --output."
    assert "there is no component or system pidd. Did you mean pid" in one_line(call("release", "pidd"))


REFERENCE = """
import sys
from hashlib import sha256
from rov_cosim.components.cases import cases_of
from rov_cosim.exporters.build import components
from rov_cosim.handover import reference
for name in sys.argv[1:]:
    component = components()[name]
    print(sha256(reference.run(component, cases_of(component)[0]).outputs.tobytes()).hexdigest())
"""
NAMES = ("taut_wire", "rov_plant")


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("qemu-x86_64") is None, reason="qemu is not installed: apt-get install qemu-user")
def test_a_settled_process_computes_what_a_processor_without_fused_operations_does():
    environment = {**os.environ, **settled.variables()}
    here = subprocess.run([sys.executable, "-c", REFERENCE, *NAMES], env=environment, capture_output=True, check=True)
    places = {"PYTHONPATH": os.pathsep.join([str(ROOT), *filter(None, sys.path)]), "PATH": os.environ["PATH"]}
    python = os.path.realpath(sys.executable)
    old = ["qemu-x86_64", "-cpu", "Nehalem", python, "-c", REFERENCE, *NAMES]
    there = subprocess.run(old, env=places, capture_output=True, check=True)
    assert len(here.stdout.split()) == len(NAMES)
    assert here.stdout == there.stdout


RELEASED = ("pid", "paper_simulation_pd", "--platform", "linux64", "--platform", "win64")


@pytest.mark.slow
def test_two_clones_make_the_same_release(tmp_path):
    cache = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "zig"
    made = {}
    for name, umask, zone, cpu in (("one", 0o022, "UTC", ""), ("another", 0o077, "Asia/Tokyo", "Nehalem")):
        clone, home = tmp_path / name / "clone", tmp_path / name / "home"
        home.mkdir(parents=True)
        subprocess.run(["git", "clone", "-q", ROOT, clone], check=True, umask=umask)
        own = {"PYTHONPATH": str(clone), "HOME": str(home), "TZ": zone, "OPENBLAS_CORETYPE": cpu, "TMPDIR": str(home)}
        # What zig compiles of its own library is the same anywhere, and takes minutes.
        environment = {**os.environ, **own, "ZIG_GLOBAL_CACHE_DIR": str(cache)}
        command = [sys.executable, "-m", "rov_cosim.cli.main", "release", *RELEASED]
        done = subprocess.run(command, env=environment, cwd=home, capture_output=True, umask=umask, check=False)
        assert done.returncode == 0, done.stderr
        folder = clone / "build" / "release"
        made[name] = (folder / bill.CHECKSUMS).read_bytes()
        assert not [*folder.parent.glob(".*")]
    assert made["one"] == made["another"]
    with ZipFile(next((folder / "kits").iterdir())) as archive:
        assert any(name.endswith("/live.html") for name in archive.namelist())
    told = json.loads((folder / bill.BILL).read_text(encoding="utf-8"))
    kinds = {Path(name).suffix for name in files_of(told)}
    assert kinds == {".whl", ".fmu", ".ssp", ".zip", ".txt"}
    with ZipFile(folder / "fmus" / "pid.fmu") as archive:
        assert {name.split("/")[1] for name in archive.namelist() if name.startswith("binaries")} == {
            "linux64",
            "win64",
        }
