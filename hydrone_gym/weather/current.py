"""Current: a mean and a Gauss-Markov variation about it, horizontal, the same at every depth.

Of each component, with white noise, and stepped exactly:

    u̇ = −μ (u − ū) + noise      u⁺ − ū = e^(−μ dt) (u − ū) + σ √(1 − e^(−2 μ dt)) N(0, 1)
"""

import math
from typing import NamedTuple

from hydrone_gym._jit import inlined
from hydrone_gym.weather.noise import normals

TIME = 20.0  # s, 1/μ: eddies of a few metres in a current of decimetres a second


class CurrentParams(NamedTuple):
    """A current: what does not change in an episode."""

    speed: float  # mean, m/s
    deviation: float  # of each horizontal component, m/s
    keep: float  # e^(-μ dt)
    kick: float


class Eddies(NamedTuple):
    """The variation at unit variance, along x and y."""

    x: float
    y: float


def current_params(speed: float, variation: float, dt: float) -> CurrentParams:
    """Return a current of a mean speed (m/s) that varies by a share of it, stepped by dt (s)."""
    return CurrentParams(speed, variation * speed, math.exp(-dt / TIME), math.sqrt(-math.expm1(-2.0 * dt / TIME)))


@inlined
def first_eddies(key, n):
    """Draw the variation as it is at any time, from pair n of a key."""
    x, y = normals(key, n)
    return Eddies(x, y)


@inlined
def next_eddies(eddies, current, noise):
    """Step the variation with two independent normal numbers."""
    return Eddies(
        current.keep * eddies.x + current.kick * noise[0],
        current.keep * eddies.y + current.kick * noise[1],
    )


@inlined
def velocity(eddies, current, direction):
    """Return the water's velocity (x, y in m/s); `direction` (cosine, sine) is where the mean current flows to."""
    return (
        current.speed * direction[0] + current.deviation * eddies.x,
        current.speed * direction[1] + current.deviation * eddies.y,
    )
