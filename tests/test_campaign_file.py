"""The file of a campaign, the draws that follow from it, and what is said of a wrong one."""

from math import erf, log, sqrt

import numpy as np
import pytest
from scipy.stats import kstest
from test_campaign import EXAMPLE, written

from rov_cosim.ssp.declaration import wire
from rov_cosim.study.campaign import declared
from rov_cosim.study.campaign.draws import drawn, unit_draws
from rov_cosim.study.campaign.records import Records
from rov_cosim.study.changes import Changes
from rov_cosim.study.scores import Score
from rov_cosim.study.settings import Settings
from rov_cosim.systems.catalogue import SYSTEMS
from typed import call


@pytest.fixture(scope="module")
def wiring(fmus):
    return wire(SYSTEMS["station_keeping"])


def draws_of(tmp_path, wiring, text):
    return drawn(declared.read(written(tmp_path, f'system = "station_keeping"\n{text}')), wiring)


MANY = """\
runs = 1000
seed = 5
sampling = "{}"
[vary]
"rov_plant.dB" = {{ distribution = "norm", loc = 10.0, scale = 2.0 }}
"rov_plant.mass" = {{ distribution = "uniform", loc = 70.0, scale = 20.0, also = ["controller.mass"] }}
"passive_arm.noise_std" = {{ distribution = "lognorm", s = 0.5, scale = 0.005 }}
"passive_arm.delay" = [0, 3, 5, 2]
"passive_arm.seed" = {{ distribution = "randint", low = 1, high = 11 }}
"controller.adaptation" = {{ distribution = "bernoulli", p = 0.25 }}
trouble = ["still_water", "bias"]
"""


@pytest.mark.parametrize("sampling", declared.SAMPLINGS)
def test_draws_are_of_the_distributions_that_are_named(tmp_path, wiring, sampling):
    table = draws_of(tmp_path, wiring, MANY.format(sampling))
    closed_forms = {
        "rov_plant.dB": lambda x: 0.5 * (1 + erf((x - 10) / (2 * sqrt(2)))),
        "rov_plant.mass": lambda x: (x - 70) / 20,
        "passive_arm.noise_std": lambda x: 0.5 * (1 + erf(log(x / 0.005) / (0.5 * sqrt(2)))),
    }
    for end, cdf in closed_forms.items():
        assert kstest(table[end], np.vectorize(cdf)).pvalue > 0.05, end
    assert table["passive_arm.delay"].dtype == table["passive_arm.seed"].dtype == np.int64
    assert table["controller.adaptation"].dtype == bool
    tolerance = 4 * sqrt(1000 / 16) if sampling == "random" else 8
    counts = {
        end: np.unique(table[end], return_counts=True) for end in ("passive_arm.delay", "passive_arm.seed", "trouble")
    }
    assert list(counts["passive_arm.delay"][0]) == [0, 2, 3, 5]
    assert list(counts["passive_arm.seed"][0]) == list(range(1, 11))
    for _, number in counts.values():
        assert np.abs(number - 1000 / len(number)).max() <= tolerance
    assert abs(table["controller.adaptation"].sum() - 250) <= tolerance
    names = [end for end in table if end != "trouble"]
    assert np.abs(np.corrcoef([table[end] for end in names]) - np.eye(len(names))).max() < 0.1
    again = draws_of(tmp_path, wiring, MANY.format(sampling))
    other = draws_of(tmp_path, wiring, MANY.format(sampling).replace("seed = 5", "seed = 6"))
    assert all(np.array_equal(table[end], again[end]) for end in table)
    assert not any(np.array_equal(table[end], other[end]) for end in closed_forms)


def test_a_latin_hypercube_has_a_draw_in_each_slice_and_sobol_in_each_block():
    for sampling, runs in (("latin_hypercube", 50), ("sobol", 64)):
        u = unit_draws(3, runs, sampling, 1)
        assert (np.sort((u * runs).astype(int), axis=0) == np.arange(runs)[:, None]).all()
    blocks = (unit_draws(2, 64, "sobol", 3) * 8).astype(int)
    assert len({tuple(block) for block in blocks}) == 64


def test_more_runs_of_sobol_keep_the_first():
    assert np.array_equal(unit_draws(4, 100, "sobol", 1), unit_draws(4, 1000, "sobol", 1)[:100])


def test_the_grid_takes_the_same_draws_for_each_combination(tmp_path, wiring):
    vary = '[vary]\n"rov_plant.dB" = { distribution = "norm" }\n'
    grid = '[grid]\n"controller.adaptation" = [true, false]\ntrouble = ["bias", "delay_2", "dropout"]\n'
    table = draws_of(tmp_path, wiring, f"runs = 4\n{vary}{grid}")
    assert table["controller.adaptation"].tolist() == [True] * 12 + [False] * 12
    assert table["trouble"].tolist() == [name for name in ("bias", "delay_2", "dropout") for _ in range(4)] * 2
    assert (table["rov_plant.dB"].reshape(6, 4) == table["rov_plant.dB"][:4]).all()
    assert len(set(table["rov_plant.dB"])) == 4


def test_the_file_tells_all(tmp_path):
    found = declared.read(EXAMPLE)
    assert (found.system, found.runs, found.seed, found.settings) == (
        SYSTEMS["station_keeping"],
        1024,
        2007,
        Settings(stop_time=60.0),
    )
    assert found.limits == {"verdict": "offset", "rms": 0.012}
    text = (
        'system = "their.ssp"\nswaps.rov_plant = "a.fmu"\ntroubles = ["bias"]\n[values]\n"a.b" = 2\n[grid]\n"c.d" = [1]'
    )
    found = declared.read(written(tmp_path, text))
    assert found.system == tmp_path / "their.ssp"
    assert found.changes == Changes({"rov_plant": tmp_path / "a.fmu"}, {}, {"a.b": 2}, ("bias",))
    assert (found.grid, found.runs, found.limits) == ({"c.d": (1,)}, 1, {"verdict": "held"})


HEAD = 'system = "station_keeping"\nruns = 8\n'
VARY = f"{HEAD}[vary]\n"
NORM = '{ distribution = "norm" }'


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("system = ", "This is not TOML"),
        (
            f'runs = 8\n[vary]\n"rov_plant.mass" = {NORM}',
            "system: expected a name in quotes, or an .ssp, for example sys",
        ),
        (
            VARY.replace("keeping", "keping") + f'"rov_plant.mass" = {NORM}',
            "no system station_keping. Did you mean station_k",
        ),
        (HEAD, "Nothing varies: write [vary] or [grid], for example"),
        (f'{HEAD}jobs = 3\n[vary]\n"rov_plant.mass" = {NORM}', "jobs is unknown; expected system, runs"),
        (f"{HEAD}sampling = 'sobel'\n[vary]\n'rov_plant.mass' = {NORM}", "sampling: expected sobol or latin_hypercube"),
        (f"system = 'station_keeping'\n[vary]\n'rov_plant.mass' = {NORM}", "runs: expected a whole number from 1 to"),
        (f"{HEAD}[grid]\n'rov_plant.mass' = [1.0]", "runs: without [vary] all runs of a combination are the same"),
        (
            f"{HEAD}stop_time = -1\n[vary]\n'rov_plant.dB' = {NORM}",
            "The run is from 0.0 s to -1 s; expected finite times",
        ),
        (f"{HEAD}step = 0\n[vary]\n'rov_plant.dB' = {NORM}", "step: expected a number of seconds above 0, got 0"),
        (f"{VARY}'rov_plant.mas' = {NORM}", "There is no variable rov_plant.mas. Did you mean rov_plant.mass"),
        (
            f"{VARY}rov_plant.mass = {NORM}",
            '[vary] rov_plant: expected { distribution = "NAME", ... } or a list of values',
        ),
        (f"{VARY}'adaptive_pd.mass' = {NORM}", "adaptive_pd is the FMU of controller; write controller.mass"),
        (f"{VARY}'rov_plant.tau.X' = {NORM}", "rov_plant.tau.X is of causality output: only inputs and parameters"),
        (f"{VARY}'controller.nu_m.u' = {NORM}", "controller.nu_m.u is connected: its value comes from rov_plant.nu.u"),
        (
            f"{VARY}'rov_plant.mass' = {{ distribution = 'normm' }}",
            "scipy.stats has no distribution normm. Did you mean",
        ),
        (
            f"{VARY}'rov_plant.mass' = {{ distribution = 'norm', mu = 1 }}",
            "norm has no argument mu; expected loc, scale",
        ),
        (f"{VARY}'rov_plant.mass' = {{ distribution = 'truncnorm', a = 1 }}", "truncnorm needs b"),
        (f"{VARY}'rov_plant.mass' = {{ distribution = 'norm', scale = -1 }}", "draws nothing with scale = -1"),
        (f"{VARY}'rov_plant.mass' = {{ distribution = 'norm', loc = 'a' }}", "loc = 'a': expected a finite number"),
        (f"{VARY}'passive_arm.seed' = {NORM}", "passive_arm.seed is of type Integer: take a discrete distribution"),
        (
            f"{VARY}'controller.adaptation' = [1, 0]",
            "controller.adaptation is of type Boolean: expected true or false, got 1",
        ),
        (
            f"{VARY}'rov_plant.mass' = {NORM}",
            "rov_plant.mass: 4 of 8 runs are out of its range, the first, run 0, with -",
        ),
        (f"{VARY}'passive_arm.delay' = ['a']", "passive_arm.delay: expected a whole number"),
        (f"{VARY}'passive_arm.delay' = [0, 99]", "with 99 above its most, 10"),
        (f"{VARY}'trouble' = ['bais', 'bias']", "there is no trouble bais. Did you mean bias"),
        (f"{VARY}'trouble' = ['bias', 'current']", "There is no scenario.current_mean.x, which the trouble is about"),
        (f"{VARY}'rov_plant.dB' = {{ distribution = 'norm', also = ['rov_plant.mas'] }}", "no variable rov_plant.mas."),
        (
            f"{VARY}'rov_plant.dB' = {NORM}\n[values]\n'rov_plant.dB' = 2",
            "rov_plant.dB stands in [values] and is varied",
        ),
        (f"{VARY}'rov_plant.dB' = {NORM}\n[grid]\n'rov_plant.dB' = [2]", "rov_plant.dB stands in [vary] and in [grid]"),
        (f"{VARY}'rov_plant.dB' = {NORM}\n[pass]\nrmss = 2", "[pass] there is no score rmss; expected verdict"),
        (
            f"{VARY}'rov_plant.dB' = {NORM}\n[pass]\nverdict = 'lost'",
            "[pass] verdict: expected the worst that passes, held",
        ),
        (f"{VARY}'rov_plant.dB' = {NORM}\n[swaps]\nrov_plant = 'none.fmu'", "none.fmu"),
    ],
)
def test_a_wrong_file_is_told_before_any_run(fmus, tmp_path, monkeypatch, text, reason):
    monkeypatch.setattr("rov_cosim.study.campaign.engine.run_all", None)
    done = call("campaign", written(tmp_path, text), "--output", tmp_path)
    assert done.exit_code == 1, done.output
    assert isinstance(done.exception, SystemExit)
    assert reason in done.output
    assert len(done.output.splitlines()) <= 2


def records(tmp_path, told, digest="d" * 64):
    return Records(tmp_path / "a.parquet", {"x.y": np.arange(4.0)}, digest, told.append)


SCORES = {
    0: Score("held", rms=0.1),
    1: Score("lost", rms=float("inf"), reason="far, \u00e9"),
    2: Score("offset", settling=1 / 3, lost_at=None),
    3: Score("lost"),
}


def test_records_come_back_as_they_were_and_in_any_order(tmp_path):
    told = []
    first = records(tmp_path / "a", told)
    for run in (2, 0):
        first.add({run: SCORES[run]})
    assert records(tmp_path / "a", told, "e" * 64).scores == {}
    again = records(tmp_path / "a", told)
    assert again.scores == {run: SCORES[run] for run in (0, 2)}
    again.add({3: SCORES[3], 1: SCORES[1]})
    other = records(tmp_path / "b", told)
    other.add(SCORES)
    passed = dict.fromkeys(range(4), True)
    again.finish(passed)
    other.finish(passed)
    assert (tmp_path / "a" / "a.parquet").read_bytes() == (tmp_path / "b" / "a.parquet").read_bytes()
    assert records(tmp_path / "a", told).scores == SCORES
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["a.parquet"]
    records(tmp_path / "a", told).forget()
    assert records(tmp_path / "a", told).scores == {}
    assert told == []


def test_a_damaged_part_is_told_and_its_runs_are_missing(tmp_path):
    told = []
    kept = records(tmp_path, told)
    kept.add({0: SCORES[0]})
    kept.add({2: SCORES[2]})
    part = kept.parts / "00000000.parquet"
    part.write_bytes(part.read_bytes()[:-9])
    assert records(tmp_path, told).scores == {2: SCORES[2]}
    assert len(told) == 1
    assert str(part) in told[0]
