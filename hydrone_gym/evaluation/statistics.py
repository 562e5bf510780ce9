"""Statistics of flights: percentiles, success rates, robust means, and differences between policies on equal worlds."""

import math
from collections.abc import Sequence
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
    """How two policies fared on the same worlds.

    `difference` of the success rates with its interval; `only_first` and `only_second` worlds that one alone solved;
    `p_value` of McNemar's exact test of no difference, two-sided.
    """

    difference: Estimate
    only_first: int
    only_second: int
    p_value: float


def percentiles(values: ArrayLike, shares: Sequence[float]) -> list[float | None]:
    """Return percentiles of values at shares in percent, interpolated linearly; None for each if there is no value."""
    numbers = np.asarray(values, dtype=np.float64)
    if numbers.size == 0:
        return [None] * len(shares)
    return np.percentile(numbers, shares).tolist()


def wilson_interval(successes: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return the Wilson score interval of a success rate, which holds near 0 and 1 too.

    Raises ValueError for no trials, or more successes than trials.
    """
    if not 0 <= successes <= trials or trials < 1:
        raise ValueError(f"successes must lie between 0 and the number of trials, got {successes} of {trials}")
    from scipy.stats import binomtest  # a second to import

    interval = binomtest(successes, trials).proportion_ci(confidence, method="wilson")
    return float(interval.low), float(interval.high)


def interquartile_mean(values: ArrayLike, confidence: float = 0.95) -> Estimate:
    """Return the mean of the middle half of the values (IQM) with its percentile bootstrap interval.

    A quarter of the values, rounded down, is cut off at each end, so outliers do not weigh. The interval is that of
    2,000 resamples from a fixed seed (Agarwal et al., "Deep RL at the Edge of the Statistical Precipice", 2021).

    Raises ValueError for no values, or values that are not finite.
    """
    numbers = np.asarray(values, dtype=np.float64).ravel()
    if numbers.size == 0 or not np.isfinite(numbers).all():
        raise ValueError(f"there must be at least one value, and finite ones, got {numbers.tolist()}")
    from scipy.stats import bootstrap, trim_mean

    value = float(trim_mean(numbers, _TRIMMED))
    if numbers.size < 2 or np.ptp(numbers) == 0.0:
        end = value if numbers.size > 1 else None
        return Estimate(value, end, end)

    def statistic(sample: np.ndarray, axis: int) -> np.ndarray:
        return trim_mean(sample, _TRIMMED, axis=axis)

    interval = bootstrap(
        (numbers,),
        statistic,
        n_resamples=RESAMPLES,
        batch=max(1, _AT_ONCE // numbers.size),
        confidence_level=confidence,
        method="percentile",
        vectorized=True,
        rng=np.random.default_rng(0),
    ).confidence_interval
    return Estimate(value, float(interval.low), float(interval.high))


def paired_success(first: ArrayLike, second: ArrayLike, confidence: float = 0.95) -> PairedSuccess:
    """Compare two policies by which of the same worlds they solved.

    The interval is Newcombe's for paired proportions, made of two Wilson intervals and the correlation of the pairs
    (Statistics in Medicine 17, 2635-2650, 1998, method 10); it holds where rates are 0 or 1 too.

    Args:
        first, second: (n,) whether each world was solved.
        confidence: of the interval.

    Raises:
        ValueError: no worlds, or different numbers of them.
    """
    one, two = np.asarray(first, bool), np.asarray(second, bool)
    if one.shape != two.shape or one.ndim != 1 or not one.size:
        raise ValueError(f"both policies must have flown the same worlds, got shapes {one.shape} and {two.shape}")
    from scipy.stats import binomtest

    n, both = one.size, int((one & two).sum())
    only_first, only_second = int((one & ~two).sum()), int((two & ~one).sum())
    neither = n - both - only_first - only_second
    p1, p2 = (both + only_first) / n, (both + only_second) / n
    low1, high1 = wilson_interval(both + only_first, n, confidence)
    low2, high2 = wilson_interval(both + only_second, n, confidence)
    phi = _correlation(both, only_first, only_second, neither)

    def reach(a: float, b: float) -> float:
        return math.sqrt(max(a * a - 2.0 * phi * a * b + b * b, 0.0))

    difference = p1 - p2
    low, high = difference - reach(p1 - low1, high2 - p2), difference + reach(high1 - p1, p2 - low2)
    discordant = only_first + only_second
    p_value = float(binomtest(only_first, discordant).pvalue) if discordant else 1.0
    return PairedSuccess(Estimate(difference, low, high), only_first, only_second, p_value)


def _correlation(both: int, only_first: int, only_second: int, neither: int) -> float:
    """Return the correlation of paired outcomes, with Newcombe's continuity correction where it is positive."""
    margins = math.prod((both + only_first, only_second + neither, both + only_second, only_first + neither))
    if margins == 0:
        return 0.0
    covariance = float(both * neither - only_first * only_second)
    if covariance > 0.0:
        covariance = max(covariance - (both + only_first + only_second + neither) / 2.0, 0.0)
    return covariance / math.sqrt(margins)
