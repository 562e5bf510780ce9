"""Wind: a mean and Dryden gusts (MIL-F-8785C, low altitude), frozen to the mean wind, in its own axes.

Lengths and intensities are those of 20 ft above the surface, the specification's reference height, where its formulas
take feet:

    L_w = h,  L_u = L_v = h / (0.177 + 0.000823 h)^1.2,  σ_w = 0.1 W,  σ_u = σ_v = σ_w / (0.177 + 0.000823 h)^0.4

The spectra belong to the filters

    u: 1 / (1 + τ s)      v, w: (1 + √3 τ s) / (1 + τ s)²      τ = L / W

which are stepped exactly, at any time step: with x₁ the first-order filter at unit variance and x₂ the same filter
once more, v = (√3 x₁ + (1 − √3) x₂) / √2 has unit variance too. The time scale is that of gusts carried past a fixed
point by the mean wind W: the weather of an episode does not depend on how the vehicle flies through it.
"""

import math
from typing import NamedTuple

from hydrone_gym._jit import inlined
from hydrone_gym.physics.exponentials import log
from hydrone_gym.weather.noise import normals

REFERENCE_HEIGHT = 6.096  # m, 20 ft
_FOOT = 0.3048  # m
ROUGHNESS = 0.15 * _FOOT  # m, MIL-F-8785C category C
_LEAST_HEIGHT = 3.0 * _FOOT  # where the profile of the specification begins
_LOG_REFERENCE = math.log(REFERENCE_HEIGHT / ROUGHNESS)
_C1, _C2 = math.sqrt(1.5), (1.0 - math.sqrt(3.0)) / math.sqrt(2.0)


class Filter(NamedTuple):
    """An exactly stepped second-order filter at unit variance."""

    keep: float  # e^(-dt/τ)
    pass_on: float  # dt/τ times the same
    kick_11: float  # square root of the covariance that a step adds
    kick_21: float
    kick_22: float


class WindParams(NamedTuple):
    """A wind: what does not change in an episode."""

    speed: float  # mean at 20 ft, m/s
    along: float  # standard deviation along the mean, and across it, m/s
    up: float  # and upwards
    keep: float  # e^(-dt/τ) along the mean
    kick: float
    across: Filter
    vertical: Filter
    shear: float  # 1 or 0


class Gusts(NamedTuple):
    """The filters' states, at unit variance."""

    u: float
    v1: float
    v2: float
    w1: float
    w2: float


def dryden(speed: float) -> tuple[float, float, float, float]:
    """Return σ along and across, σ upwards (m/s), L along and across, L upwards (m) for a mean wind (m/s) at 20 ft."""
    feet = REFERENCE_HEIGHT / _FOOT
    rise = 0.177 + 0.000823 * feet
    up = 0.1 * speed
    return up / rise**0.4, up, feet / rise**1.2 * _FOOT, feet * _FOOT


def filter_of(time: float, dt: float) -> Filter:
    """Return the exact filter of a time constant for a time step, both in s."""
    d = dt / time
    a = math.exp(-d)
    # the stationary covariance [[1, 1/2], [1/2, 1/2]] less what of it a step keeps
    q11 = -math.expm1(-2.0 * d)
    q12 = 0.5 - a * a * (d + 0.5)
    q22 = 0.5 - a * a * (d * d + d + 0.5)
    k11 = math.sqrt(q11)
    return Filter(a, d * a, k11, q12 / k11, math.sqrt(max(q22 - q12 * q12 / q11, 0.0)))


def wind_params(speed: float, turbulence: float, shear: bool, dt: float) -> WindParams:
    """Return a wind of a mean speed (m/s) with gusts of a share of Dryden's intensity, stepped by dt (s)."""
    along, up, length, rising = dryden(speed)
    still = speed == 0.0
    across = Filter(0.0, 0.0, 0.0, 0.0, 0.0) if still else filter_of(length / speed, dt)
    vertical = across if still else filter_of(rising / speed, dt)
    gusts = (turbulence * along, turbulence * up, across.keep, across.kick_11)
    return WindParams(speed, *gusts, across, vertical, float(shear))


@inlined
def first_gusts(key, n):
    """Draw gusts as they are at any time, from pairs n to n + 2 of a key."""
    u, a = normals(key, n)
    b, c = normals(key, n + 1.0)
    d, _ = normals(key, n + 2.0)
    return Gusts(u, a, 0.5 * (a + b), c, 0.5 * (c + d))


@inlined
def next_gusts(gusts, wind, noise):
    """Step gusts with five independent normal numbers."""
    across, vertical = wind.across, wind.vertical
    return Gusts(
        wind.keep * gusts.u + wind.kick * noise[0],
        across.keep * gusts.v1 + across.kick_11 * noise[1],
        across.pass_on * gusts.v1 + across.keep * gusts.v2 + across.kick_21 * noise[1] + across.kick_22 * noise[2],
        vertical.keep * gusts.w1 + vertical.kick_11 * noise[3],
        vertical.pass_on * gusts.w1
        + vertical.keep * gusts.w2
        + vertical.kick_21 * noise[3]
        + vertical.kick_22 * noise[4],
    )


@inlined
def velocity(gusts, wind, direction, profile):
    """Return the air's velocity (m/s); `direction` (cosine, sine) is where the mean wind blows to."""
    along = wind.speed * profile + wind.along * gusts.u
    across = wind.along * (_C1 * gusts.v1 + _C2 * gusts.v2)
    up = wind.up * (_C1 * gusts.w1 + _C2 * gusts.w2)
    return along * direction[0] - across * direction[1], along * direction[1] + across * direction[0], up


@inlined
def shear_profile(z, shear):
    """Return the mean wind at a height (m) over that at 20 ft: logarithmic with `shear`, which is 1 or 0."""
    height = z if z > _LEAST_HEIGHT else _LEAST_HEIGHT
    return 1.0 + shear * (log(height / ROUGHNESS) / _LOG_REFERENCE - 1.0)
