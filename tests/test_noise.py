"""Noise: its bits, its statistics, its repeatability."""

import math

import numpy as np
import pytest
from scipy import stats

from rov_cosim.components.noise import standard_normal


def test_bits_are_those_of_philox4x64_10():
    # The known answer of Random123 for counter 0 and key 0; NumPy generates from one past the counter given.
    words = np.random.Philox(key=0, counter=2**256 - 1).random_raw(4)
    assert [f"{int(word):016x}" for word in words] == [
        "16554d9eca36314c",
        "db20fe9d672d0fdc",
        "d7e772cee186176b",
        "7e68b68aec7ba23b",
    ]


def test_draws_are_the_box_muller_transform_of_those_bits():
    for seed, index in ((0, 0), (7, 123)):
        words = [int(word) for word in np.random.Philox(key=seed, counter=[0, index, 0, 0]).random_raw(8)]
        first, second = ((word >> 11) + 1 for word in words[6:8])
        radius = math.sqrt(-2 * math.log(first * 2.0**-53))
        expected = [
            radius * math.cos(2 * math.pi * second * 2.0**-53),
            radius * math.sin(2 * math.pi * second * 2.0**-53),
        ]
        assert standard_normal(seed, index, 8)[6:] == pytest.approx(expected, abs=1e-15)


def test_samples_share_no_draws():
    draws = np.concatenate([standard_normal(1, k, 16) for k in range(50)])
    assert len(np.unique(draws)) == draws.size


def test_a_sample_is_a_function_of_seed_and_index_alone():
    late = standard_normal(7, 5000, 6)
    for index in (3, 17):
        standard_normal(7, index, 6)
    assert np.array_equal(standard_normal(7, 5000, 6), late)
    assert not np.array_equal(standard_normal(8, 5000, 6), late)
    assert not np.array_equal(standard_normal(7, 5001, 6), late)


def test_draws_are_standard_normal_and_independent():
    draws = np.array([standard_normal(1, k, 6) for k in range(20000)])
    assert stats.kstest(draws.ravel(), "norm").pvalue > 1e-3
    assert np.abs(np.corrcoef(draws.T) - np.eye(6)).max() < 5 / np.sqrt(len(draws))
    assert abs(np.corrcoef(draws[1:, 0], draws[:-1, 0])[0, 1]) < 5 / np.sqrt(len(draws))
