"""The random numbers: uniform, normal, independent of one another, and the same in every order and any lane."""

import numpy as np
import pytest
from scipy import stats

from hydrone_gym._jit import kernel
from hydrone_gym.weather.noise import Key, derived, kicks, normals, uniforms

COUNT = 60_000
KEYS = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (4294967295.0, 4294967295.0), (2718281828.0, 3141592653.0)]


@kernel
def uniforms_of(low, high, numbers, out):
    for i in range(numbers.size):
        out[0, i], out[1, i] = uniforms(Key(low, high), numbers[i])


@kernel
def normals_of(low, high, numbers, out):
    for i in range(numbers.size):
        out[0, i], out[1, i] = normals(Key(low, high), numbers[i])


@kernel
def kicks_of(low, high, numbers, out):
    for i in range(numbers.size):
        out[0, i], out[1, i] = kicks(Key(low, high), numbers[i])


@kernel
def derived_of(low, high, numbers, out):
    for i in range(numbers.size):
        out[0, i], out[1, i] = derived(Key(low, high), numbers[i])


@kernel
def of_each_key(keys, n, out):
    for i in range(out.shape[1]):
        out[0, i], out[1, i] = uniforms(Key(keys[0, i], keys[1, i]), n)


@kernel
def side_by_side(keys, numbers, out):
    for i in range(16):
        out[0, i], out[1, i] = normals(Key(keys[0, i], keys[1, i]), numbers[i])


@kernel
def one(keys, numbers, out, i):
    out[0, i], out[1, i] = normals(Key(keys[0, i], keys[1, i]), numbers[i])


def drawn(function, key, first=0, count=COUNT):
    out = np.empty((2, count))
    function(*key, np.arange(first, first + count, dtype=float), out)
    return out


def assert_independent(a, b):
    """No more alike than chance has it: numbers, their squares, and how pairs fill a chessboard."""
    bound = 4.5 / np.sqrt(a.size)
    assert abs(np.corrcoef(a, b)[0, 1]) < bound
    assert abs(np.corrcoef((a - 0.5) ** 2, (b - 0.5) ** 2)[0, 1]) < bound
    filled, _, _ = np.histogram2d(a, b, bins=16, range=[[0, 1], [0, 1]])
    assert stats.chisquare(filled.ravel()).pvalue > 1e-4


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize("first", [0, 2**32 - COUNT])
def test_uniform(key, first):
    for numbers in drawn(uniforms_of, key, first):
        assert 0.0 < numbers.min() < numbers.max() < 1.0
        assert stats.kstest(numbers, "uniform").pvalue > 1e-4


@pytest.mark.parametrize("key", KEYS)
def test_independent_of_each_other_and_of_what_came_before(key):
    first, second = drawn(uniforms_of, key)
    assert_independent(first, second)
    for lag in (1, 2, 4, 64):  # a tick takes four pairs
        for earlier in (first, second):
            assert_independent(earlier[:-lag], first[lag:])
            assert_independent(earlier[:-lag], second[lag:])


@pytest.mark.parametrize("other", [(1.0, 0.0), (0.0, 1.0), (0.0, 2147483648.0), (2147483648.0, 0.0)])
def test_keys_of_one_different_bit_are_independent(other):
    for a in drawn(uniforms_of, (0.0, 0.0)):
        for b in drawn(uniforms_of, other):
            assert_independent(a, b)


@pytest.mark.parametrize("n", [0.0, 1.0, 65.0])
def test_uniform_over_keys(n):
    """Of keys that count up, and of derived ones, as episodes have them."""
    counted = np.zeros((2, COUNT))
    counted[1] = np.arange(COUNT)
    for keys in (counted, counted[::-1].copy(), drawn(derived_of, KEYS[-1])):
        out = np.empty((2, COUNT))
        of_each_key(keys, n, out)
        assert all(stats.kstest(numbers, "uniform").pvalue > 1e-4 for numbers in out)
        assert_independent(*out)
        assert_independent(out[0, :-1], out[0, 1:])


def test_normal():
    numbers = drawn(normals_of, KEYS[-1], count=400_000)
    for z in numbers:
        # mean, variance, skewness, kurtosis, each within 4.5 standard errors
        np.testing.assert_array_less(np.abs(z.mean()), 7.2e-3)
        np.testing.assert_array_less(np.abs(z.var() - 1.0), 7.2e-3 * np.sqrt(2.0))
        np.testing.assert_array_less(np.abs(stats.skew(z)), 7.2e-3 * np.sqrt(6.0))
        np.testing.assert_array_less(np.abs(stats.kurtosis(z)), 7.2e-3 * np.sqrt(24.0))
        assert stats.kstest(z, "norm").pvalue > 1e-4
        assert 4.2 < np.abs(z).max() < 6.8
    assert_independent(*stats.norm.cdf(numbers))


def test_kicks_are_sums_of_four_bytes():
    """Of the two hashes; so their mean is exactly 0 and their variance 1 over all of them, their kurtosis -0.3."""
    uniform, sums = drawn(uniforms_of, KEYS[-1]), drawn(kicks_of, KEYS[-1])
    whole = (uniform * 2.0**32 - 0.5).astype(np.uint32)
    expected = whole.view(np.uint8).reshape(2, COUNT, 4).sum(2, dtype=float) - 510.0
    np.testing.assert_allclose(sums, expected / np.sqrt((256.0**2 - 1.0) / 3.0), rtol=1e-14, atol=1e-14)
    numbers = drawn(kicks_of, KEYS[-1], count=400_000)
    np.testing.assert_allclose(numbers.mean(1), 0.0, atol=7.2e-3)
    np.testing.assert_allclose(numbers.var(1), 1.0, atol=7.2e-3 * np.sqrt(1.7))
    np.testing.assert_allclose(stats.skew(numbers, axis=1), 0.0, atol=0.02)
    np.testing.assert_allclose(stats.kurtosis(numbers, axis=1), -0.3, atol=0.03)
    bound = 4.5 / np.sqrt(numbers.shape[1])
    first, second = numbers
    for a, b in ((first, second), (first[:-1], first[1:]), (first[:-1], second[1:]), (second[:-1], second[1:])):
        assert abs(np.corrcoef(a, b)[0, 1]) < bound
        assert abs(np.corrcoef(a**2, b**2)[0, 1]) < bound


@pytest.mark.parametrize("other", [(1.0, 0.0), (0.0, 1.0), (2654435769.0, 0.0), (2718281828.0, 0.0), KEYS[-1]])
def test_derived_keys_do_not_collide(other):
    """Half a million each of two keys, of which some share a half or, but for a shift, what is hashed first."""
    low, high = np.concatenate([drawn(derived_of, key, count=500_000) for key in (KEYS[0], other)], axis=1)
    whole = low.astype(np.uint64) << np.uint64(32) | high.astype(np.uint64)
    np.testing.assert_array_equal([whole >> np.uint64(32), whole % np.uint64(2**32)], [low, high])
    assert len(np.unique(whole)) == 1_000_000


@pytest.mark.parametrize("key", KEYS)
def test_a_number_of_derived_keys_is_as_good_as_any(key):
    """Not hashed of what made the key: all different, but for the few that chance makes equal."""
    keys = drawn(derived_of, key)
    for n in (0.0, 1.0, 2.0, 64.0):
        out = np.empty((2, COUNT))
        of_each_key(keys, n, out)
        for numbers in out:
            assert COUNT - len(np.unique(numbers)) < 8  # 0.4 are expected


def test_streams_of_derived_keys_are_independent():
    keys = drawn(derived_of, KEYS[0], count=3)
    streams = [drawn(uniforms_of, key)[0] for key in (*keys.T, KEYS[0])]
    for i, a in enumerate(streams):
        for b in streams[:i]:
            assert_independent(a, b)


def test_lanes_side_by_side_draw_what_one_draws():
    rng = np.random.default_rng(3)
    for _ in range(200):
        keys, numbers = np.floor(rng.uniform(0, 2**32, (2, 16))), np.floor(rng.uniform(0, 2**32, 16))
        together, alone = np.empty((2, 16)), np.empty((2, 16))
        side_by_side(keys, numbers, together)
        for i in range(16):
            one(keys, numbers, alone, i)
        np.testing.assert_array_equal(together, alone)


def test_the_hash_is_lowbias32():
    """By its published arithmetic, in Python's whole numbers."""

    def mixed(x):
        x ^= x >> 16
        x = x * 0x7FEB352D % 2**32
        x ^= x >> 15
        x = x * 0x846CA68B % 2**32
        return x ^ x >> 16

    def expected(low, high, n):
        between = mixed(low ^ n * 0x9E3779B9 % 2**32)
        first = mixed((between + high + n) % 2**32)
        return (first + 0.5) / 2**32, (mixed(((first ^ 0x85EBCA6B) + between) % 2**32) + 0.5) / 2**32

    low, high = (int(word) for word in KEYS[-1])
    np.testing.assert_array_equal(drawn(uniforms_of, KEYS[-1], count=50).T, [expected(low, high, n) for n in range(50)])
