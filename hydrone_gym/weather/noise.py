"""Random numbers that are a function of a key and a count, so that no order of flying can change them.

The weather of an episode is drawn with the key of that episode: number n is the same whoever asks, for one row or many
side by side, and however a period is cut up. The hash is Chris Wellons' ``lowbias32``, three times for
64 bits of key and as many of numbers; normal numbers follow by Box and Muller.
"""

import math
from typing import NamedTuple

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym.physics.exponentials import log
from hydrone_gym.physics.trigonometry import sincos

_LOW = 0xFFFFFFFF
_GOLDEN = 0x9E3779B9
_APART = 0x85EBCA6B  # no small multiple of the former: a derived key and its numbers share no step
_WHOLE = 4503599627370496.0  # 2**52, see `hydrone_gym.physics.exponentials`
_WHOLE_BITS = 0x4330000000000000
_PER_BYTE = math.sqrt(3.0 / (256.0**2 - 1.0))  # four numbers even in 0 … 255 have the variance (256² − 1) / 3


class Key(NamedTuple):
    """The key of a stream: two whole numbers below 2**32, kept as floats."""

    low: float
    high: float


@inlined
def _whole(x):
    """Bits of a whole number of at least 0 and below 2**32 that is kept as a float."""
    return np.float64(x + _WHOLE).view(np.int64) & _LOW


@inlined
def _float(n):
    """The float of a whole number below 2**32."""
    return np.int64(n | _WHOLE_BITS).view(np.float64) - _WHOLE


@inlined
def _hashed(x):
    """Mix the bits of a whole number below 2**32."""
    x = x ^ (x >> 16)
    x = (x * 0x7FEB352D) & _LOW
    x = x ^ (x >> 15)
    x = (x * 0x846CA68B) & _LOW
    return x ^ (x >> 16)


@inlined
def _pair(key, n):
    """Two hashes of number n, below 2**32: no two numbers of a key, nor number n of two keys, have both the same."""
    count = _whole(n)
    mixed = _hashed(_whole(key.low) ^ ((count * _GOLDEN) & _LOW))
    first = _hashed((mixed + _whole(key.high) + count) & _LOW)
    return first, _hashed(((first ^ _APART) + mixed) & _LOW)


@inlined
def uniforms(key, n):
    """Return pair n of independent numbers uniform between 0 and 1, neither included."""
    first, second = _pair(key, n)
    return (_float(first) + 0.5) * 2.0**-32, (_float(second) + 0.5) * 2.0**-32


@inlined
def normals(key, n):
    """Return pair n of independent standard normal numbers; it is made of the same bits as `uniforms` of n."""
    first, second = uniforms(key, n)
    length = np.sqrt(-2.0 * log(first))
    sine, cosine = sincos(6.283185307179586 * second)
    return length * cosine, length * sine


@inlined
def _sum_of_bytes(n):
    """The sum of the four bytes of a whole number below 2**32."""
    pairs = (n & 0x00FF00FF) + ((n >> 8) & 0x00FF00FF)
    return (pairs & 0xFFFF) + (pairs >> 16)


@inlined
def kicks(key, n):
    """Return pair n of independent numbers of zero mean and unit variance, to drive filters with.

    Each is the sum of four even ones. A filter's variance, autocorrelation and spectrum are those that normal numbers
    give, and so is, nearly, its distribution; the square root, logarithm and division they would take are saved.
    """
    first, second = _pair(key, n)
    return (_float(_sum_of_bytes(first)) - 510.0) * _PER_BYTE, (_float(_sum_of_bytes(second)) - 510.0) * _PER_BYTE


@inlined
def derived(key, n):
    """Return the key of stream n of a key: of an episode, from that of all episodes of a row.

    It is made of the same bits as `uniforms` of n: a key is for numbers or for keys.
    """
    first, second = _pair(key, n)
    return Key(_float(first), _float(second))
