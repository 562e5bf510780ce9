"""Statistics of flights: percentiles, success rates, robust means, and differences between policies on equal worlds."""

import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

RESAMPLES = 2000
_AT_ONCE = 2_000_000  # numbers that are resampled at once: 16 MB
_TRIMMED = 0.25  # share cut from each end: what is left is the interquartile range


class Estimate(NamedTuple):
    """A number with its confidence interval; the ends are None where there are too few values for one."""

    value: float
    low: float | None
    high: float | None


class PairedSuccess(NamedTuple):
    """How two policies fared on the same worlds."""

    difference: Estimate  #: of the success rates
    only_first: int  #: worlds that the first alone solved
    only_second: int
    p_value: float  #: of McNemar's exact test of no difference, two-sided


def percentiles(values: ArrayLike, shares: Sequence[float]) -> list[float | None]:
    """Return percentiles of values at shares in percent, interpolated linearly; None for each if there is no value."""
    numbers = np.asarray(values, dtype=np.float64)
    return np.percentile(numbers, shares).tolist() if numbers.size else [None] * len(shares)


def wilson_interval(successes: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return the Wilson score interval of a success rate, which holds near 0 and 1 too; ValueError for no such rate."""
    if not 0 <= successes <= trials or trials < 1:
        raise ValueError(f"successes must lie between 0 and the number of trials, got {successes} of {trials}")
    from scipy.stats import binomtest  # a second to import

    low, high = binomtest(successes, trials).proportion_ci(confidence, method="wilson")
    return float(low), float(high)


def interquartile_mean(values: ArrayLike, confidence: float = 0.95) -> Estimate:
    """Return the mean of the middle half of the values (IQM) with its percentile bootstrap interval.

    A quarter of the values, rounded down, is cut off at each end, so outliers do not weigh. The interval is that of
    2,000 resamples from a fixed seed (Agarwal et al., "Deep RL at the Edge of the Statistical Precipice", 2021).

    Raises ValueError for no values, or values that are not finite.
    """
    return mean(values, _TRIMMED, confidence)


def mean(values: ArrayLike, trimmed: float = 0.0, confidence: float = 0.95) -> Estimate:
    """Return the mean of the values, less the share `trimmed` at each end, as `interquartile_mean` does."""
    numbers = np.asarray(values, dtype=np.float64).ravel()
    if numbers.size == 0 or not np.isfinite(numbers).all():
        raise ValueError(f"there must be at least one value, and finite ones, got {numbers.tolist()}")
    from scipy.stats import bootstrap, trim_mean

    value = float(trim_mean(numbers, trimmed))
    if numbers.size < 2 or np.ptp(numbers) == 0.0:
        end = value if numbers.size > 1 else None
        return Estimate(value, end, end)
    options = {"n_resamples": RESAMPLES, "batch": max(1, _AT_ONCE // numbers.size), "rng": np.random.default_rng(0)}
    statistic = partial(trim_mean, proportiontocut=trimmed)
    resampled = bootstrap((numbers,), statistic, confidence_level=confidence, method="percentile", **options)
    return Estimate(value, *map(float, resampled.confidence_interval))


def paired_success(first: ArrayLike, second: ArrayLike, confidence: float = 0.95) -> PairedSuccess:
    """Compare two policies by which of the same worlds they solved, (n,) each; ValueError for no pairs.

    The interval is Newcombe's for paired proportions, made of two Wilson intervals and the correlation of the pairs
    (Statistics in Medicine 17, 2635-2650, 1998, method 10); it holds where rates are 0 or 1 too.
    """
    one, two = np.asarray(first, bool), np.asarray(second, bool)
    if one.shape != two.shape or one.ndim != 1 or not one.size:
        raise ValueError(f"both policies must have flown the same worlds, got shapes {one.shape} and {two.shape}")
    from scipy.stats import binomtest

    n, both = one.size, int((one & two).sum())
    only_first, only_second = int((one & ~two).sum()), int((two & ~one).sum())
    solved1, solved2 = both + only_first, both + only_second
    p1, p2 = solved1 / n, solved2 / n
    low1, high1 = wilson_interval(solved1, n, confidence)
    low2, high2 = wilson_interval(solved2, n, confidence)
    margins = math.prod((solved1, n - solved1, solved2, n - solved2))
    covariance = float(n * both - solved1 * solved2)
    if covariance > 0.0:  # Newcombe's correction for continuity
        covariance = max(covariance - n / 2.0, 0.0)
    phi = covariance / math.sqrt(margins) if margins else 0.0

    def reach(a: float, b: float) -> float:
        return math.sqrt(max(a * a - 2.0 * phi * a * b + b * b, 0.0))

    difference = p1 - p2
    low, high = difference - reach(p1 - low1, high2 - p2), difference + reach(high1 - p1, p2 - low2)
    discordant = only_first + only_second
    p_value = float(binomtest(only_first, discordant).pvalue) if discordant else 1.0
    return PairedSuccess(Estimate(difference, low, high), only_first, only_second, p_value)
