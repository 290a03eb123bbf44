"""Campaigns on workers: the same table however it came about, and what dies on the way."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from distributed import LocalCluster
from pythonfmu.builder import FmuBuilder
from test_matrix import is_gone

from rov_cosim.master.simulation import simulate
from rov_cosim.ssp.declaration import wire
from rov_cosim.study.campaign import declared, engine
from rov_cosim.study.campaign.conduct import conduct
from rov_cosim.study.campaign.errors import CampaignError
from rov_cosim.study.scores import score
from rov_cosim.systems.catalogue import SYSTEMS
from typed import call, ok, one_line

EXAMPLE = Path(__file__).parent.parent / "systems" / "campaigns" / "station_keeping.toml"


def written(folder, text, name="some.toml"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


SHORT = EXAMPLE.read_text(encoding="utf-8").replace("runs = 1024", "runs = 12").replace("60.0", "1.5")


@pytest.fixture
def short(tmp_path):
    """Return the example with few and short runs."""
    return written(tmp_path, SHORT)


@pytest.fixture(scope="module")
def whole(fmus, tmp_path_factory):
    """Return the table of these by one worker, from the command."""
    folder = tmp_path_factory.mktemp("whole")
    told = ok("campaign", written(folder, SHORT), "--jobs", 1, "--output", folder / "out")
    names = [f"campaign+some.{end}" for end in ("parquet", "png", "txt")]
    assert sorted(path.name for path in (folder / "out").iterdir()) == names
    assert (folder / "out" / names[2]).read_text(encoding="utf-8") in told
    return folder / "out" / names[0]


def test_the_table_has_the_masters_own_results(whole):
    rows = pq.read_table(whole).to_pylist()
    assert [row["run"] for row in rows] == list(range(12))
    wiring = wire(SYSTEMS["station_keeping"])
    for row in rows[::3]:
        varied = {end: value for end, value in row.items() if "." in end}
        assert len(varied) == 7
        changed = wiring.with_values(varied)
        alone = score(simulate(changed, stop_time=1.5), changed)
        assert {name: row[name] for name in vars(alone)} == vars(alone)


def test_one_that_goes_on_with_two_workers_gives_the_bytes_of_one(whole, short, tmp_path):
    def interrupted(runs, total, before):
        for n, run in enumerate(runs):
            if n == 1:
                raise KeyboardInterrupt
            yield run

    counted = []

    def counting(runs, total, before):
        counted.append((before, sorted(runs)))
        return ()

    table = tmp_path / "a.parquet"
    with pytest.raises(CampaignError, match=r"Interrupted: \d+ of 12 runs are recorded; the same command goes on"):
        conduct(declared.read(short), table, 1, progress=interrupted)
    kept = sorted(run for part in tmp_path.glob("*/*.parquet") for run in pq.read_table(part)["run"].to_pylist())
    assert 1 < len(kept) < 12
    conduct(declared.read(short), table, 2, progress=counting)
    assert counted == [(len(kept), sorted({*range(12)} - {*kept}))]
    assert table.read_bytes() == whole.read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.parquet", "some.toml"]


CRASHES = """\
system = "bluerov2_pd"
swaps.scenario = "crashing.fmu"
map = "map.toml"
stop_time = 0.9

[grid]
"scenario.fuse" = [1e9, 0.3, 2e9]
"""


def test_an_fmu_that_crashes_costs_its_own_runs_alone(fmus, tmp_path):
    FmuBuilder.build_FMU(Path(__file__).parent / "fmus" / "crashing.py", tmp_path).rename(tmp_path / "crashing.fmu")
    written(tmp_path, '[scenario]\nwithout = ["set_point"]\n[scenario.constants]\nthrust_loss = 0.0\n', "map.toml")
    file = written(tmp_path, CRASHES)
    told = ok("campaign", file, "--jobs", 1, "--output", tmp_path)
    assert f"  lost 1: {engine.DIED}" in told
    rows = pq.read_table(tmp_path / "campaign+some.parquet").to_pylist()
    assert [row["scenario.fuse"] for row in rows] == [1e9, 0.3, 2e9]
    assert [row["reason"] == engine.DIED for row in rows] == [False, True, False]
    assert all((row["rms"] is None) == (row["reason"] == engine.DIED) for row in rows)


@pytest.mark.slow
def test_an_fmu_that_crashes_in_every_run_ends_the_campaign(fmus, tmp_path, monkeypatch):
    monkeypatch.setattr(engine, "HOPELESS", 2)
    FmuBuilder.build_FMU(Path(__file__).parent / "fmus" / "crashing.py", tmp_path).rename(tmp_path / "crashing.fmu")
    written(tmp_path, '[scenario]\nwithout = ["set_point"]\n[scenario.constants]\nthrust_loss = 0.0\n', "map.toml")
    file = written(tmp_path, CRASHES.replace("1e9", "0.0").replace("2e9", "0.6"))
    done = call("campaign", file, "--jobs", 1, "--output", tmp_path)
    assert done.exit_code == 1
    assert "Error: The first 2 runs ended their process, each: an FMU crashes. " in done.output


def command(file, output):
    return [sys.executable, "-m", "rov_cosim.cli.main", "campaign", str(file), "--jobs", "2", "--output", str(output)]


def begun(file, output, temporary):
    """Start a campaign, and wait until some of it is recorded."""
    known = len(list(output.glob("*.parts-*/*.parquet")))
    process = subprocess.Popen(
        command(file, output),
        env={**os.environ, "TMPDIR": str(temporary)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while len(list(output.glob("*.parts-*/*.parquet"))) < known + 4:
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)
    return process


@pytest.fixture
def longer(tmp_path):
    """Return the example with as many runs as take a while."""
    return written(tmp_path, EXAMPLE.read_text(encoding="utf-8").replace("runs = 1024", "runs = 256"))


@pytest.mark.slow
def test_the_page_has_what_the_example_says(fmus, tmp_path):
    ok("campaign", EXAMPLE, "--output", tmp_path)
    report = (tmp_path / "campaign+station_keeping.txt").read_text(encoding="utf-8")
    assert f"```text\n{report}```" in (EXAMPLE.parent / "README.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_campaign_killed_twice_gives_the_bytes_of_one_that_was_not(fmus, longer, tmp_path):
    for _ in range(2):
        process = begun(longer, tmp_path / "killed", tmp_path)
        process.kill()
        process.communicate(timeout=60)
        assert is_gone(process.pid)  # the workers too
    for folder in ("killed", "whole"):
        subprocess.run(command(longer, tmp_path / folder), check=True, capture_output=True)
    killed, whole = ((tmp_path / folder / "campaign+some.parquet").read_bytes() for folder in ("killed", "whole"))
    assert killed == whole


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_order_to_end_keeps_what_is_done_and_leaves_no_process(fmus, longer, tmp_path, number):
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    process = begun(longer, tmp_path / "cut", temporary)
    if number == signal.SIGINT:
        os.killpg(process.pid, number)  # as a terminal does: to the parent and to its processes
    else:
        process.terminate()
    _, told = process.communicate(timeout=60)
    assert process.returncode == 1
    assert told.endswith("runs are recorded; the same command goes on from there.\n")
    assert "Traceback" not in told
    assert is_gone(process.pid)
    assert not list(temporary.iterdir())


@pytest.mark.slow
def test_the_workers_of_a_cluster_give_the_same_table(whole, short, tmp_path):
    with LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address="localhost:0") as cluster:
        ok("campaign", short, "--scheduler", cluster.scheduler_address, "--output", tmp_path / "there")
    assert (tmp_path / "there" / "campaign+some.parquet").read_bytes() == whole.read_bytes()
    done = call("campaign", short, "--scheduler", "tcp://127.0.0.1:1", "--output", tmp_path / "nowhere")
    assert "There is no Dask scheduler at tcp://127.0.0.1:1" in one_line(done)


def test_a_missing_module_is_told_with_the_command_that_brings_it(short, tmp_path):
    script = "import sys; sys.modules['distributed'] = None; from rov_cosim.cli.main import main; main()"
    arguments = ["campaign", str(short), "--output", str(tmp_path)]
    done = subprocess.run([sys.executable, "-c", script, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    told = "Error: Campaigns need distributed, which is not installed: pip install distributed pyarrow\n"
    assert done.stderr == told
