"""The exponential and the logarithm against extended precision, to the last place."""

import numpy as np
import pytest

from hydrone_gym._jit import kernel
from hydrone_gym.physics.exponentials import exp, log

# Where long double is double the C library is the reference, and is itself only good to a unit.
BOUND = 1.0 if np.finfo(np.longdouble).eps < 1e-18 else 2.0


@kernel
def exp_of(numbers, out):
    for i in range(numbers.size):
        out[i] = exp(numbers[i])


@kernel
def log_of(numbers, out):
    for i in range(numbers.size):
        out[i] = log(numbers[i])


def last_places(function, numbers, exact):
    """Largest distance from the exact values, in units of their last place."""
    out = np.empty_like(numbers)
    function(numbers, out)
    values = exact(numbers.astype(np.longdouble))
    return float((np.abs(out - values) / np.spacing(np.abs(values.astype(float)))).max())


@pytest.mark.parametrize("span", [1e-9, 0.4, 3.0, 50.0, 699.9])
def test_exponential(span):
    numbers = np.random.default_rng(1).uniform(-span, span, 200_000)
    halves = (np.arange(-1000, 1000) + 0.5) * np.log(2.0)  # where the power of two changes
    numbers = np.concatenate([numbers, *(halves[np.abs(halves) < span] + offset for offset in (-1e-9, 0.0, 1e-9))])
    assert last_places(exp_of, numbers, np.exp) < BOUND


@pytest.mark.parametrize("decades", [1e-8, 0.3, 3.0, 300.0])
def test_logarithm(decades):
    numbers = 10.0 ** np.random.default_rng(2).uniform(-decades, decades, 200_000)
    roots = 2.0 ** (np.arange(-900, 900) + 0.5)  # where the power of two changes
    numbers = np.concatenate([numbers, *(roots * (1.0 + offset) for offset in (-1e-9, 0.0, 1e-9))])
    assert last_places(log_of, numbers, np.log) < BOUND


def test_exact_where_it_must_be():
    out = np.empty(2)
    exp_of(np.array([0.0, -0.0]), out)
    np.testing.assert_array_equal(out, [1.0, 1.0])
    log_of(np.array([1.0, 2.0]), out)
    np.testing.assert_array_equal(out, [0.0, np.log(2.0)])
