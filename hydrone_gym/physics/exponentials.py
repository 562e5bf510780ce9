"""Exponential and logarithm as plain arithmetic, for the same reasons as sine and cosine in `trigonometry`.

Within 1 unit in the last place of the exact value (tests/physics/test_exponentials.py). The exponent of a number is
read and written as bits, without a conversion between integers and floats, which not every machine has for lanes.
Coefficients of the logarithm: FreeBSD msun ``e_log.c``; the exponential is its series.
"""

import math

import numpy as np

from hydrone_gym._jit import inlined

_LOG2_E = 1.0 / math.log(2.0)
_LN2_HIGH = 6.93147180369123816490e-01  # first 32 bits of ln 2
_LN2_LOW = 1.90821492927058770002e-10
_ROUND = 6755399441055744.0  # 1.5 * 2**52: adding and taking it away rounds to the nearest integer
_WHOLE = 4503599627370496.0  # 2**52: the last 52 bits of m + 2**52 are those of the whole number m
_WHOLE_BITS = 0x4330000000000000  # the bits of 2**52
_MANTISSA = 0x000FFFFFFFFFFFFF
_ONE_BITS = 0x3FF0000000000000
_BIAS = 1023.0
_REST = tuple(1.0 / math.factorial(k) for k in range(12, 1, -1))


@inlined
def exp(x):
    """Return e to the power x, -700 < x < 700."""
    k = (x * _LOG2_E + _ROUND) - _ROUND
    high, low = x - k * _LN2_HIGH, k * _LN2_LOW
    r = high - low
    # the series without its first two terms; a division would cost more than the terms that it saves
    series = 1.0 / 6227020800.0  # 1 / 13!
    for coefficient in _REST:
        series = coefficient + r * series
    power = np.int64(np.float64(k + _BIAS + _WHOLE).view(np.int64) << 52).view(np.float64)
    return (1.0 + (high - (low - r * r * series))) * power


@inlined
def log(x):
    """Return the natural logarithm of a positive, normal number."""
    bits = np.float64(x).view(np.int64)
    exponent = np.int64((bits >> 52) | _WHOLE_BITS).view(np.float64) - (_WHOLE + _BIAS)
    mantissa = np.int64((bits & _MANTISSA) | _ONE_BITS).view(np.float64)
    big = mantissa > 1.4142135623730951
    f = (0.5 * mantissa if big else mantissa) - 1.0
    k = exponent + 1.0 if big else exponent
    s = f / (2.0 + f)
    z = s * s
    series = z * (
        6.666666666666735130e-01
        + z
        * (
            3.999999999940941908e-01
            + z
            * (
                2.857142874366239149e-01
                + z
                * (
                    2.222219843214978396e-01
                    + z * (1.818357216161805012e-01 + z * (1.531383769920937332e-01 + z * 1.479819860511658591e-01))
                )
            )
        )
    )
    half = 0.5 * f * f
    return k * _LN2_HIGH - ((half - (s * (half + series) + k * _LN2_LOW)) - f)
