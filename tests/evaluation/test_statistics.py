"""Every statistic against a computation of another kind: formulas by hand, published figures, simulated coverage."""

import math
import statistics

import numpy as np
import pytest

from hydrone_gym.evaluation.statistics import interquartile_mean, mean, paired_success, percentiles, wilson_interval


def wilson_by_hand(k, n, z):
    """Wilson (1927): the rates p whose normal deviation from k / n is at most z, solved as a quadratic."""
    a, b, c = n + z * z, -(2.0 * k + z * z), k * k / n
    root = math.sqrt(b * b - 4.0 * a * c)
    return (-b - root) / (2.0 * a), (-b + root) / (2.0 * a)


@pytest.mark.parametrize(("k", "n"), [(0, 1), (1, 1), (0, 100), (37, 100), (99, 100), (100, 100), (500, 1000)])
@pytest.mark.parametrize("confidence", [0.9, 0.95, 0.99])
def test_wilson_solves_its_quadratic(k, n, confidence):
    z = statistics.NormalDist().inv_cdf(0.5 + confidence / 2.0)
    assert wilson_interval(k, n, confidence) == pytest.approx(wilson_by_hand(k, n, z), abs=1e-12)


@pytest.mark.parametrize(
    ("k", "n", "low", "high"),
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_wilson_as_published(k, n, low, high):
    """Newcombe, Statistics in Medicine 17, 857-872 (1998), Table I, method 3."""
    assert wilson_interval(k, n) == pytest.approx((low, high), abs=5e-5)


@pytest.mark.parametrize(("k", "n"), [(-1, 5), (6, 5), (0, 0)])
def test_wilson_refuses_impossible_counts(k, n):
    with pytest.raises(ValueError, match=f"must lie between 0 and the number of trials, got {k} of {n}"):
        wilson_interval(k, n)


def middle_half(values):
    ordered = sorted(values)
    cut = len(ordered) // 4
    return statistics.fmean(ordered[cut : len(ordered) - cut])


@pytest.mark.parametrize("n", [2, 3, 4, 7, 20, 101])
def test_the_interquartile_mean_and_its_interval_by_hand(n):
    values = np.random.default_rng(n).gamma(2.0, 5.0, n)
    estimate = interquartile_mean(values)
    assert estimate.value == pytest.approx(middle_half(values), rel=1e-12)
    random = np.random.default_rng(99)  # another stream: the intervals agree within the noise of resampling
    means = sorted(middle_half(random.choice(values, n)) for _ in range(4000))
    spread = means[-1] - means[0]
    assert estimate.low == pytest.approx(means[100], abs=0.05 * spread)
    assert estimate.high == pytest.approx(means[-101], abs=0.05 * spread)


def test_an_outlier_does_not_move_it():
    values = [20.0, 20.5, 21.0, 21.5, 22.0, 22.5, 23.0, 23.5]
    assert interquartile_mean([*values[:-1], 1e6]).value == interquartile_mean(values).value == 21.75


def test_the_bootstrap_interval_covers():
    """Of 95 % intervals from 40 values, about 95 % hold the mean of the middle half of the law itself."""
    random = np.random.default_rng(5)
    middle = middle_half(random.exponential(1.0, 400_001))
    held = sum(
        low <= middle <= high for _, low, high in (interquartile_mean(random.exponential(1.0, 40)) for _ in range(200))
    )
    assert 178 <= held <= 199


def test_the_mean_of_all_values_has_an_interval_too():
    values = [0.0, 0.5, 1.0, 1.0] * 25
    value, low, high = mean(values)
    reach = 1.96 * statistics.pstdev(values) / 10.0  # the normal law's for a hundred values
    assert value == 0.625
    assert (low, high) == pytest.approx((value - reach, value + reach), abs=0.01)


def test_few_or_equal_values():
    assert interquartile_mean([3.5]) == (3.5, None, None)
    assert interquartile_mean([2.0, 2.0, 2.0]) == (2.0, 2.0, 2.0)
    assert interquartile_mean([1.0, 2.0, 4.0]) == interquartile_mean([1.0, 2.0, 4.0])
    for bad in ([], [1.0, math.nan], [math.inf]):
        with pytest.raises(ValueError, match="at least one value, and finite ones"):
            interquartile_mean(bad)


def outcomes(both, only_first, only_second, neither):
    first = [1] * both + [1] * only_first + [0] * only_second + [0] * neither
    second = [1] * both + [0] * only_first + [1] * only_second + [0] * neither
    order = np.random.default_rng(1).permutation(len(first))
    return np.array(first)[order], np.array(second)[order]


def test_paired_success_as_published():
    """Airways before and after transplantation, in Fagerland, Lydersen and Laake, Stat. Med. 33, 2850-2875 (2014)."""
    compared = paired_success(*outcomes(1, 1, 7, 12))
    assert compared.difference.value == pytest.approx(-6 / 21)
    assert compared.difference[1:] == pytest.approx((-0.507, -0.026), abs=5e-4)
    assert (compared.only_first, compared.only_second) == (1, 7)
    assert compared.p_value == pytest.approx(2 * (1 + 8) / 2**8)  # exact: at most one of eight


@pytest.mark.parametrize("counts", [(40, 4, 1, 15), (20, 10, 10, 20), (1, 9, 8, 2), (5, 3, 2, 4)])
def test_paired_success_by_its_formula(counts):
    """Newcombe (1998), method 10, written out with the letters of the paper."""
    e, f, g, h = counts
    n, z = e + f + g + h, statistics.NormalDist().inv_cdf(0.975)
    (l2, u2), (l3, u3) = wilson_by_hand(e + f, n, z), wilson_by_hand(e + g, n, z)
    p2, p3 = (e + f) / n, (e + g) / n
    numerator = e * h - f * g
    if numerator > 0:
        numerator = max(numerator - n / 2, 0)
    phi = numerator / math.sqrt((e + f) * (g + h) * (e + g) * (f + h))
    delta = math.sqrt((p2 - l2) ** 2 - 2 * phi * (p2 - l2) * (u3 - p3) + (u3 - p3) ** 2)
    epsilon = math.sqrt((p3 - l3) ** 2 - 2 * phi * (p3 - l3) * (u2 - p2) + (u2 - p2) ** 2)
    found = paired_success(*outcomes(*counts)).difference
    assert found == pytest.approx((p2 - p3, p2 - p3 - delta, p2 - p3 + epsilon), abs=1e-12)


def test_paired_success_turned_round():
    forth, back = paired_success(*outcomes(30, 2, 9, 4)), paired_success(*outcomes(30, 9, 2, 4))
    assert forth.difference.value == -back.difference.value
    assert (forth.difference.low, forth.difference.high) == pytest.approx((-back.difference.high, -back.difference.low))
    assert forth.p_value == back.p_value


def test_paired_success_where_nothing_differs():
    same = paired_success(*outcomes(100, 0, 0, 0))
    assert (same.difference.value, same.p_value) == (0.0, 1.0)
    reach = 1.0 - wilson_interval(100, 100)[0]
    assert same.difference[1:] == pytest.approx((-reach, reach))  # without correlation: as far as one rate may be lower


def test_the_paired_interval_covers():
    random, held = np.random.default_rng(8), 0
    for _ in range(300):
        hard = random.random(60)  # worlds differ in how hard they are, so outcomes are correlated
        first, second = hard < 0.9, (hard + random.normal(0.0, 0.1, 60)) < 0.75
        low, high = paired_success(first, second).difference[1:]
        held += low <= TRUTH <= high
    assert held >= 0.92 * 300


def _truth():
    random = np.random.default_rng(9)
    hard = random.random(1_000_000)
    return np.mean(hard < 0.9) - np.mean(hard + random.normal(0.0, 0.1, len(hard)) < 0.75)


TRUTH = _truth()


def test_paired_success_needs_pairs():
    for first, second in (([], []), ([1], [1, 0]), ([[1]], [[1]])):
        with pytest.raises(ValueError, match="must have flown the same worlds"):
            paired_success(first, second)


def test_percentiles():
    assert percentiles([3.0, 1.0, 2.0], (0.0, 50.0, 75.0)) == [1.0, 2.0, 2.5]
    assert percentiles([], (50.0,)) == [None]
