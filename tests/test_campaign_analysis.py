"""What a campaign says of its runs, against closed forms."""

from math import sqrt

import matplotlib.pyplot as plt
import numpy as np
import pytest

from rov_cosim.study.campaign import picture
from rov_cosim.study.campaign.analysis import effect, effects, numbers, report, share
from rov_cosim.study.campaign.conduct import Outcome
from rov_cosim.study.campaign.declared import Declared
from rov_cosim.study.changes import Changes
from rov_cosim.study.limits import broken
from rov_cosim.study.scores import Score
from rov_cosim.systems.catalogue import SYSTEMS

N = 400
Z = 1.959963984540054
"""The normal distribution's quantile of 97.5 %."""


@pytest.mark.parametrize(("n", "total"), [(0, 20), (7, 20), (20, 20), (950, 1000)])
def test_the_interval_of_a_share_is_wilsons(n, total):
    found = share([True] * n + [False] * (total - n))
    p, a = n / total, Z**2 / total
    middle, half = (p + a / 2) / (1 + a), Z * sqrt(p * (1 - p) / total + a / (4 * total)) / (1 + a)
    assert (found.n, found.total) == (n, total)
    assert (found.low, found.high) == pytest.approx((middle - half, middle + half), abs=1e-12)
    assert str(share([True] * 7 + [False] * 13)) == "35.0 % (18.1 to 56.7 %), 7 of 20"


def test_what_matters_is_seen_be_it_monotonic_or_not_and_noise_is_chance():
    random = np.random.default_rng(4)
    x, noise = random.normal(size=N), random.normal(size=N)
    assert effect(x, np.exp(x)).rho == pytest.approx(1.0)
    assert effect(x, -x).rho == pytest.approx(-1.0)
    assert effect(x, x).share > 0.97  # but for the spread within the ten classes, a hundredth
    curved = effect(x, x**2)
    assert abs(curved.rho) < 0.2
    assert curved.share > 0.5
    assert effect(x, noise).chance > 0.01
    assert effect(x, np.ones(N)) is None
    assert effect(np.ones(N), x) is None
    # As large an effect as the noise: half of the variance, somewhat less of the ranks and by the classes.
    assert 0.4 < effect(x, x + noise).share < 0.55
    names = np.array(["a", "b"], dtype=object)[(x > 0).astype(int)]
    assert effect(names, x).rho is None
    assert effect(names, x).share == pytest.approx(0.75, abs=0.01)  # two halves that do not overlap


def test_the_share_is_free_of_the_number_of_classes_where_there_is_nothing():
    random = np.random.default_rng(1)
    shares = [effect(random.normal(size=60), random.normal(size=60)).share for _ in range(100)]
    assert np.median(shares) < 0.02  # it is cut off at 0; without the correction it would be 9 of 59


def test_a_run_without_a_number_is_worse_than_any():
    scores = [Score("held", rms=0.2), Score("lost"), Score("offset", rms=float("nan"))]
    assert numbers(scores, "rms").tolist() == [0.2, np.inf, np.inf]
    assert numbers(scores, "verdict").tolist() == [0, 3, 1]


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ({"verdict": "held"}, [True, False, False]),
        ({"verdict": "oscillates"}, [True, True, False]),
        ({"rms": 0.2}, [True, False, False]),
        ({"rms": 0.1}, [False, False, False]),
        ({"verdict": "offset", "rms": 0.5}, [True, True, False]),
        ({"settling": 9.0}, [False, True, False]),
    ],
)
def test_a_run_passes_that_keeps_every_limit(limits, expected):
    scores = [Score("held", rms=0.2), Score("offset", rms=0.3, settling=9.0), Score("lost", rms=float("nan"))]
    assert [not broken(score, limits) for score in scores] == expected


@pytest.fixture
def outcome():
    """Return a campaign in which the error grows with x, and the seven runs with the largest x are lost."""
    x, y = (np.random.default_rng(seed).permutation(N) / N for seed in (1, 2))
    last = np.sort(x)[-7]
    scores = [Score("lost", reason="far off") if a >= last else Score("held", rms=a, effort=2.0) for a in x.tolist()]
    grid = {"trouble": ("bias", "still_water")}
    declared = Declared(SYSTEMS["station_keeping"], Changes(), {}, grid, runs=N // 2)
    troubles = np.repeat(np.array(["bias", "still_water"], dtype=object), N // 2)
    passed = tuple(score.verdict == "held" for score in scores)
    return Outcome(declared, {"a.x": x, "b.y": y, "trouble": troubles}, tuple(scores), passed)


def test_the_report_tells_shares_quantiles_and_what_matters(outcome):
    lines = [line.split() for line in report(outcome).splitlines()]
    assert lines[0] == ["400", "runs:", "393", "held,", "0", "offset,", "0", "oscillates,", "7", "lost"]
    assert lines[1] == ["lost", "7:", "far", "off"]
    assert lines[2] == f"held: {share(outcome.passed)}".split()
    first = sum(outcome.passed[: N // 2])
    assert f"trouble=bias {share([True] * first + [False] * (N // 2 - first))}".split() in lines
    assert [
        "rms",
        "[m]",
        "0.0475",
        "0.2475",
        "0.4975",
        "0.7475",
        "0.9475",
    ] in lines  # every 400th, from 0 on: no interpolation
    found = effects(outcome)
    assert found["a.x"]["rms"].rho == pytest.approx(1.0, abs=1e-3)
    row = next(line for line in lines if line[:1] == ["a.x"])
    assert row[3:5] == [f"{found['a.x']['rms'].share:.2f}", "+1.00"]
    assert [line for line in lines if line[:1] == ["b.y"]] == [["b.y", ".", ".", "."]]


def test_the_picture_shows_the_runs_in_their_colours(outcome, tmp_path):
    picture.draw(outcome, "some", tmp_path / "a.png")
    pixels = (plt.imread(tmp_path / "a.png")[..., :3] * 255).round().astype(int).reshape(-1, 3)
    shown = []
    for colour in picture.COLOURS:
        rgb = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
        shown.append(int((pixels == rgb).all(axis=1).sum()))
    held, offset, oscillates, lost = shown
    assert offset == oscillates == 0 < lost < held / 10
    first = (tmp_path / "a.png").read_bytes()
    picture.draw(outcome, "some", tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes() == first
