"""Statistics of flights: percentiles of times, intervals of success rates."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike


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
