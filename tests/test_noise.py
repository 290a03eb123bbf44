"""Noise: its bits, its statistics, its repeatability."""

import numpy as np
import pytest
from scipy import stats

from rov_cosim.components.noise import standard_normal


def test_bits_are_philox_of_salmon_et_al():
    # Known answer of Philox4x64-10 for key 0 and counter 1: NumPy's generator starts one past the counter given.
    first = np.random.Philox(key=0, counter=0).random_raw(1)[0]
    u = ((int(first) >> 11) + 1) * 2.0**-53
    second = (int(np.random.Philox(key=0, counter=0).random_raw(2)[1]) >> 11) + 1
    expected = np.sqrt(-2 * np.log(u)) * np.cos(2 * np.pi * second * 2.0**-53)
    assert standard_normal(0, 0, 1)[0] == pytest.approx(expected, abs=1e-15)


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
