"""Waves: a few components of Airy's linear theory over a flat bottom, regular or drawn from a JONSWAP spectrum.

With the phase θ = k·x − ω t + ε, the depth h, and z ≤ 0 from the mean surface,

    ω² = g k tanh(k h)
    η = a cos θ
    u = a ω cosh k(z + h) / sinh kh · cos θ   along the way the wave runs
    w = a ω sinh k(z + h) / sinh kh · sin θ

Above the mean surface the water of a crest moves as at z = 0. In the code q = e^(−2 k h), so that
cosh k(z + h) / sinh kh = (e^(kz) + q e^(−kz)) / (1 − q).
"""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import inlined
from hydrone_gym.physics.exponentials import exp
from hydrone_gym.physics.trigonometry import sincos
from hydrone_gym.weather.noise import uniforms

COMPONENTS = 4  # of a sea
GRAVITY = 9.78  # m/s^2, Table 1
STEEPEST = 0.142  # height over length at which a wave in deep water breaks (Michell 1893)
_PEAKEDNESS = 3.3  # γ of JONSWAP
_NEWTON = 8  # steps to the wave number: from deep water, exact to the last digit for k h > 0.3


class Component(NamedTuple):
    """One wave."""

    amplitude: float  # a, m
    k: float  # 1/m
    kx: float
    ky: float
    omega: float  # rad/s
    phase: float  # ε, rad
    q: float  # e^(-2 k h)
    speed: float  # a ω / (1 - q), m/s


class Band(NamedTuple):
    """Where a component is drawn from: one of the parts of equal energy that a spectrum is cut into."""

    amplitude: float  # m
    lowest: float  # rad/s
    highest: float


class Sea(NamedTuple):
    """The components of a sea."""

    first: Component
    second: Component
    third: Component
    fourth: Component


class SeaParams(NamedTuple):
    """The bands of a sea, and the water's depth."""

    first: Band
    second: Band
    third: Band
    fourth: Band
    depth: float  # m


class Swell(NamedTuple):
    """What waves do at a place: elevation and its rate as seen from a moving vehicle, the water's motion there."""

    elevation: float  # m
    rate: float  # m/s
    u: float  # m/s
    v: float
    w: float
    ax: float  # m/s^2, at the place
    ay: float
    az: float


def wave_number(omega: float, depth: float) -> float:
    """Return k (1/m) of a wave of ω (rad/s) over a depth (m)."""
    return float(_wave_number.py_func(omega, depth))


def jonswap(omega: NDArray[np.float64], peak: float) -> NDArray[np.float64]:
    """Return the JONSWAP spectrum at frequencies ω (rad/s) for a peak frequency, but for a factor."""
    width = np.where(omega <= peak, 0.07, 0.09)
    peaked = _PEAKEDNESS ** np.exp(-0.5 * ((omega / peak - 1.0) / width) ** 2)
    return omega**-5.0 * np.exp(-1.25 * (peak / omega) ** 4) * peaked


def sea_params(height: float, period: float, irregular: bool, depth: float) -> SeaParams:
    """Return a sea of a height (m; significant, if irregular) and a (peak) period (s) over a depth (m).

    A regular sea is one component of half the height. An irregular one has four of equal energy, with the four parts of
    the spectrum between 0.5 and 3 times its peak as their bands: 4 √m₀ is the height.
    """
    omega = 2.0 * math.pi / period
    none = Band(0.0, omega, omega)
    if height == 0.0 or not irregular:
        return SeaParams(Band(0.5 * height, omega, omega), none, none, none, depth)
    grid = np.linspace(0.5 * omega, 3.0 * omega, 20001)
    energy = np.cumsum(jonswap(grid, omega))
    edges = np.interp(np.linspace(0.0, energy[-1], COMPONENTS + 1), energy, grid).tolist()
    amplitude = height / 4.0 * math.sqrt(2.0 / COMPONENTS)
    bands = [Band(amplitude, low, high) for low, high in pairwise(edges)]
    return SeaParams(*bands, depth)


@inlined
def _wave_number(omega, depth):
    """Solve ω² = g k tanh(k h) for k by Newton's method."""
    deep = omega * omega / GRAVITY
    k = deep if deep * depth > 1.0 else np.sqrt(deep / depth)
    for _ in range(_NEWTON):
        q = math.exp(-2.0 * k * depth)
        tanh = (1.0 - q) / (1.0 + q)
        k -= (k * tanh - deep) / (tanh + k * depth * (1.0 - tanh * tanh))
    return k


@inlined
def _component(band, depth, direction, key, n):
    """Draw a component: frequency within its band, any phase."""
    share, turn = uniforms(key, n)
    omega = band.lowest + share * (band.highest - band.lowest)
    k = _wave_number(omega, depth)
    q = math.exp(-2.0 * k * depth)
    speed = band.amplitude * omega / (1.0 - q)
    phase = 2.0 * math.pi * turn
    return Component(band.amplitude, k, k * direction[0], k * direction[1], omega, phase, q, speed)


@inlined
def draw_sea(sea, direction, key, n):
    """Draw the waves of an episode, all running to `direction` (cosine, sine), from pairs n to n + 3 of a key."""
    return Sea(
        _component(sea.first, sea.depth, direction, key, n),
        _component(sea.second, sea.depth, direction, key, n + 1.0),
        _component(sea.third, sea.depth, direction, key, n + 2.0),
        _component(sea.fourth, sea.depth, direction, key, n + 3.0),
    )


@inlined
def add_wave(swell, wave, place, velocity, time):
    """Add one component at a place (x, y, z in m), seen from a vehicle with a velocity (x, y in m/s), at a time (s)."""
    sine, cosine = sincos(wave.kx * place[0] + wave.ky * place[1] - wave.omega * time + wave.phase)
    falling = exp(wave.k * (place[2] if place[2] < 0.0 else 0.0))
    rising = wave.q / falling
    level, upright = wave.speed * (falling + rising), wave.speed * (falling - rising)
    # along x and y, by the unit vector k/|k|
    x, y = wave.kx / wave.k, wave.ky / wave.k
    return Swell(
        swell.elevation + wave.amplitude * cosine,
        swell.rate + wave.amplitude * sine * (wave.omega - wave.kx * velocity[0] - wave.ky * velocity[1]),
        swell.u + level * cosine * x,
        swell.v + level * cosine * y,
        swell.w + upright * sine,
        swell.ax + level * wave.omega * sine * x,
        swell.ay + level * wave.omega * sine * y,
        swell.az - upright * wave.omega * cosine,
    )


@inlined
def calm():
    """Return a `Swell` without waves."""
    return Swell(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
