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
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hydrone_gym._jit import inlined
from hydrone_gym.physics.exponentials import exp
from hydrone_gym.physics.trigonometry import sincos
from hydrone_gym.weather.noise import uniforms

COMPONENTS = 4  # of a sea
GRAVITY = 9.78  # m/s^2, Table 1
STEEPEST = 0.142  # height over length at which a wave in deep water breaks (Michell 1893)
_PEAKEDNESS = 3.3  # γ of JONSWAP
_STILL = 300.0  # k times the depth from where on a wave moves nothing
_PARTS = 256  # that the energy of its spectrum is cut into, to draw from it
_NEWTON = 4  # steps to the wave number, from that of deep or of shallow water: within 1e-14


class Component(NamedTuple):
    """One wave."""

    amplitude: float  # a, m
    k: float  # 1/m
    x: float  # the way it runs, a unit vector
    y: float
    omega: float  # rad/s
    phase: float  # ε, rad
    q: float  # e^(-2 k h)
    speed: float  # a ω / (1 - q), m/s


class Sea(NamedTuple):
    """The components of a sea."""

    first: Component
    second: Component
    third: Component
    fourth: Component


class SeaParams(NamedTuple):
    """What the components of a sea are drawn from."""

    first: float  # amplitude of the first component, m
    others: float  # amplitude of each other one, m
    peak: float  # rad/s
    irregular: float  # 1 or 0
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


def _quantiles() -> NDArray[np.float64]:
    """Frequencies over the peak's that cut a JONSWAP spectrum, from 0.5 to 3, into parts of equal energy."""
    grid = np.linspace(0.5, 3.0, 20001)
    energy = np.cumsum(jonswap(grid, 1.0))
    return np.interp(np.linspace(energy[0], energy[-1], _PARTS + 1), energy, grid)


_QUANTILES = _quantiles()


def sea_params(height: float, period: float, irregular: bool, depth: float) -> SeaParams:
    """Return a sea of a height (m; significant, if irregular) and a (peak) period (s) over a depth (m).

    A regular sea is one component of half the height. An irregular one has four of equal energy, each from its quarter
    of the energy of the spectrum between 0.5 and 3 times its peak: 4 √m₀ is the height in every sea, and the mean
    spectrum of many is JONSWAP's.
    """
    even = height / 4.0 * math.sqrt(2.0 / COMPONENTS)
    amplitudes = (even, even) if irregular else (0.5 * height, 0.0)
    return SeaParams(*amplitudes, 2.0 * math.pi / period, float(irregular), depth)


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
def _frequency(share):
    """The frequency over the peak's below which lies a share, below 1, of the energy of an irregular sea."""
    place = share * _PARTS
    part = int(place)
    low = _QUANTILES[part]
    return low + (place - part) * (_QUANTILES[part + 1] - low)


@inlined
def _component(sea, amplitude, quarter, direction, key, n):
    """Draw a component: frequency within its quarter of the energy, any phase."""
    share, turn = uniforms(key, n + quarter)
    omega = sea.peak * (1.0 + sea.irregular * (_frequency((quarter + share) / COMPONENTS) - 1.0))
    k = _wave_number(omega, sea.depth)
    q = math.exp(-2.0 * k * sea.depth)
    speed = amplitude * omega / (1.0 - q)
    return Component(amplitude, k, direction[0], direction[1], omega, 2.0 * math.pi * turn, q, speed)


@inlined
def draw_sea(sea, direction, key, n):
    """Draw the waves of an episode, all running to `direction` (cosine, sine), from pairs n to n + 3 of a key."""
    if sea.others == 0.0:
        one = _component(sea, sea.first, 0.0, direction, key, n)
        none = Component(0.0, one.k, one.x, one.y, one.omega, one.phase, one.q, 0.0)
        return Sea(one, none, none, none)
    return Sea(
        _component(sea, sea.first, 0.0, direction, key, n),
        _component(sea, sea.others, 1.0, direction, key, n),
        _component(sea, sea.others, 2.0, direction, key, n),
        _component(sea, sea.others, 3.0, direction, key, n),
    )


@inlined
def add_wave(swell, wave, place, velocity, time):
    """Add one component at a place (x, y, z in m), seen from a vehicle with a velocity (x, y in m/s), at a time (s)."""
    along, speed = wave.x * place[0] + wave.y * place[1], wave.x * velocity[0] + wave.y * velocity[1]
    sine, cosine = sincos(wave.k * along - wave.omega * time + wave.phase)
    falling = exp(-min(max(-wave.k * place[2], 0.0), _STILL))
    rising = wave.q / falling
    level, upright = wave.speed * (falling + rising), wave.speed * (falling - rising)
    u, a = level * cosine, level * wave.omega * sine
    return Swell(
        swell.elevation + wave.amplitude * cosine,
        swell.rate + wave.amplitude * sine * (wave.omega - wave.k * speed),
        swell.u + u * wave.x,
        swell.v + u * wave.y,
        swell.w + upright * sine,
        swell.ax + a * wave.x,
        swell.ay + a * wave.y,
        swell.az - upright * wave.omega * cosine,
    )


def elevation(sea: Any, x: ArrayLike, y: ArrayLike, time: float) -> NDArray[np.float64]:
    """Return the elevation (m) of a `Sea` at places x, y (m) and a time (s), as the kernels have it; for pictures."""
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    waves = (w.amplitude * np.cos(w.k * (w.x * x + w.y * y) - w.omega * time + w.phase) for w in sea)
    return sum(waves, np.zeros(np.broadcast(x, y).shape))


@inlined
def carried(swell, velocity):
    """Let the water also move with a velocity (x, y, z in m/s)."""
    return Swell(
        swell.elevation,
        swell.rate,
        swell.u + velocity[0],
        swell.v + velocity[1],
        swell.w + velocity[2],
        swell.ax,
        swell.ay,
        swell.az,
    )


@inlined
def calm():
    """Return a `Swell` without waves."""
    return Swell(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
