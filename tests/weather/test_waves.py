"""Waves against Airy's linear theory, its equations taken by differences, and against the JONSWAP spectrum."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from hydrone_gym._jit import kernel
from hydrone_gym.vehicle import HYDRONE
from hydrone_gym.weather import waves
from hydrone_gym.weather.noise import Key
from hydrone_gym.weather.waves import COMPONENTS, GRAVITY, draw_sea, sea_params, wave_number

DEPTH = 5.0
SEAS = 20_000
KEY, DIRECTION = Key(123.0, 456.0), (0.6, 0.8)


@kernel
def drawn(params, direction, key, n):
    return draw_sea(params, direction, key, n)


@kernel
def many_drawn(params, out):
    """Amplitudes, frequencies, phases (3, COMPONENTS, seas) of the first sea of as many keys."""
    for i in range(out.shape[2]):
        sea = draw_sea(params, (1.0, 0.0), Key(float(i), 5.0), 14.0)
        for j, wave in enumerate((sea.first, sea.second, sea.third, sea.fourth)):
            out[0, j, i], out[1, j, i], out[2, j, i] = wave.amplitude, wave.omega, wave.phase


@kernel
def swell_of(sea, place, velocity, time):
    swell = waves.add_wave(waves.calm(), sea.first, place, velocity, time)
    swell = waves.add_wave(swell, sea.second, place, velocity, time)
    swell = waves.add_wave(swell, sea.third, place, velocity, time)
    return waves.add_wave(swell, sea.fourth, place, velocity, time)


@kernel
def carried_by(swell, velocity):
    return waves.carried(swell, velocity)


def swell_at(sea, x, y, z, t, velocity=(0.0, 0.0)):
    return swell_of(sea, (float(x), float(y), float(z)), velocity, float(t))


def water_at(sea, x, y, z, t):
    swell = swell_at(sea, x, y, z, t)
    return np.array([swell.u, swell.v, swell.w])


def derivatives(function, at, step=1e-4):
    """Of a function of (x, y, z, t) by each of them, by differences of fourth order."""

    def along(axis):
        near, far = np.zeros(4), np.zeros(4)
        near[axis], far[axis] = step, 2.0 * step
        ahead = 8.0 * (function(*(at + near)) - function(*(at - near)))
        return (ahead - (function(*(at + far)) - function(*(at - far)))) / (12.0 * step)

    return [along(axis) for axis in range(4)]


@pytest.fixture(params=["regular", "irregular", "shallow"])
def sea(request):
    depth = 0.8 if request.param == "shallow" else DEPTH
    return drawn(sea_params(0.3, 2.0, request.param != "regular", depth), DIRECTION, KEY, 3.0), depth


def places(depth, count=40):
    rng = np.random.default_rng(4)
    low, high = [-10.0, -10.0, -0.95 * depth, 0.0], [10.0, 10.0, -0.01, 30.0]
    return rng.uniform(low, high, (count, 4))


@pytest.mark.parametrize("depth", [0.1, 0.5, 5.0, 40.0])
@pytest.mark.parametrize("period", [0.3, 1.0, 2.0, 5.0, 20.0])
def test_dispersion(depth, period):
    omega = 2.0 * np.pi / period
    k = wave_number(omega, depth)
    solved = brentq(lambda k: GRAVITY * k * np.tanh(k * depth) - omega**2, 1e-6, 1e4, xtol=1e-300, rtol=1e-15)
    np.testing.assert_allclose(k, solved, rtol=1e-14)
    drawn_wave = drawn(sea_params(0.01, period, False, depth), DIRECTION, KEY, 0.0).first
    np.testing.assert_allclose([drawn_wave.omega, drawn_wave.k], [omega, k], rtol=1e-14)
    np.testing.assert_allclose([drawn_wave.x, drawn_wave.y], DIRECTION, rtol=1e-14)


def test_gravity_is_that_of_the_vehicle():
    assert HYDRONE.gravity == GRAVITY


def test_water_is_neither_made_nor_turned(sea):
    """Continuity, ∂u/∂x + ∂v/∂y + ∂w/∂z = 0, and no vorticity."""
    sea, depth = sea
    for at in places(depth):
        by_x, by_y, by_z, _ = derivatives(lambda *where: water_at(sea, *where), at)
        scale = np.abs([by_x, by_y, by_z]).max()
        assert abs(by_x[0] + by_y[1] + by_z[2]) < 1e-8 * scale
        for turned in (by_y[2] - by_z[1], by_z[0] - by_x[2], by_x[1] - by_y[0]):
            assert abs(turned) < 1e-8 * scale


def test_acceleration_is_the_rate_at_a_place(sea):
    sea, depth = sea
    for at in places(depth):
        swell = swell_at(sea, *at)
        *_, by_t = derivatives(lambda *where: water_at(sea, *where), at)
        np.testing.assert_allclose([swell.ax, swell.ay, swell.az], by_t, rtol=0, atol=1e-8)


def test_surface_moves_with_its_water(sea):
    """∂η/∂t = w at z = 0."""
    sea, depth = sea
    for x, y, _, t in places(depth):
        swell = swell_at(sea, x, y, 0.0, t)
        *_, rate = derivatives(lambda *where: swell_at(sea, *where).elevation, np.array([x, y, 0.0, t]))
        np.testing.assert_allclose([swell.w, swell.rate], rate, rtol=0, atol=1e-8)


def test_pressure_is_even_on_the_surface(sea):
    """∂φ/∂t + g η = 0 at z = 0 (Bernoulli, linear); by x and y, as φ is not told: ∂u/∂t + g ∂η/∂x = 0."""
    sea, depth = sea
    for x, y, _, t in places(depth):
        swell = swell_at(sea, x, y, 0.0, t)
        slope = derivatives(lambda *where: swell_at(sea, *where).elevation, np.array([x, y, 0.0, t]))
        np.testing.assert_allclose([swell.ax, swell.ay], -GRAVITY * np.array(slope[:2]), rtol=0, atol=1e-8)


def test_nothing_flows_through_the_bottom(sea):
    sea, depth = sea
    for x, y, _, t in places(depth):
        swell = swell_at(sea, x, y, -depth, t)
        np.testing.assert_allclose([swell.w, swell.az], 0.0, rtol=0, atol=1e-15)


def test_elevation_seen_on_the_move(sea):
    sea, depth = sea
    for at, velocity in zip(places(depth), np.random.default_rng(5).uniform(-2, 2, (40, 2)), strict=True):
        swell = swell_at(sea, *at, tuple(velocity))
        by_x, by_y, _, by_t = derivatives(lambda *where: swell_at(sea, *where).elevation, at)
        np.testing.assert_allclose(swell.rate, by_t + by_x * velocity[0] + by_y * velocity[1], rtol=0, atol=1e-8)


def test_waves_on_moving_water(sea):
    """Its velocity is added to that of the waves, and to nothing else."""
    swell = swell_at(sea[0], 1.0, 2.0, -0.3, 4.0)
    more = np.subtract(carried_by(swell, (0.3, -0.4, 0.1)), swell)
    np.testing.assert_allclose(more, [0.0, 0.0, 0.3, -0.4, 0.1, 0.0, 0.0, 0.0], rtol=0, atol=1e-15)


def test_crests_run_to_the_direction():
    """Surface water moves with a crest, and the crest is further on a moment later."""
    wave = drawn(sea_params(0.2, 2.0, False, DEPTH), DIRECTION, KEY, 0.0)
    speed = wave.first.omega / wave.first.k
    for t in (0.0, 1.0, 7.3):
        way = (wave.first.omega * t - wave.first.phase) / wave.first.k
        swell = swell_at(wave, way * DIRECTION[0], way * DIRECTION[1], 0.0, t)
        np.testing.assert_allclose(swell.elevation, 0.1, rtol=1e-12)
        assert swell.u * DIRECTION[0] + swell.v * DIRECTION[1] > 0.1
        on = swell_at(wave, (way + speed) * DIRECTION[0], (way + speed) * DIRECTION[1], 0.0, t + 1.0)
        np.testing.assert_allclose(on.elevation, 0.1, rtol=1e-12)


def test_water_above_the_mean_surface_moves_as_at_it(sea):
    sea, _ = sea
    np.testing.assert_array_equal(water_at(sea, 1.0, 2.0, 0.4, 3.0), water_at(sea, 1.0, 2.0, 0.0, 3.0))


@pytest.mark.parametrize(
    ("height", "period", "speeds"),
    [(0.1, 1.5, (0.21, 0.035, 0.001)), (0.2, 2.0, (0.31, 0.115, 0.016)), (0.5, 3.0, (0.534, 0.34, 0.155))],
)
def test_orbital_speeds(height, period, speeds):
    """Largest speed along in 5 m of water, at the surface, 1 m and 3 m below."""
    sea = drawn(sea_params(height, period, False, DEPTH), (1.0, 0.0), KEY, 0.0)
    times = np.linspace(0.0, period, 400)
    for z, speed in zip((0.0, -1.0, -3.0), speeds, strict=True):
        largest = max(abs(water_at(sea, 0.0, 0.0, z, t)[0]) for t in times)
        np.testing.assert_allclose(largest, speed, rtol=0.02, atol=0.001)


def jonswap(omega, peak):
    """g² α ω⁻⁵ exp(−5/4 (ω_p/ω)⁴) γ^exp(−½((ω/ω_p − 1)/s)²) over α g²."""
    width = 0.07 if omega <= peak else 0.09
    return omega**-5 * np.exp(-1.25 * (peak / omega) ** 4) * 3.3 ** np.exp(-(((omega / peak - 1) / width) ** 2) / 2)


@pytest.fixture(scope="module")
def seas():
    """Many drawn seas of 0.4 m significant height and 2 s peak period."""
    out = np.empty((3, COMPONENTS, SEAS))
    many_drawn(sea_params(0.4, 2.0, True, DEPTH), out)
    return out


def test_height_of_seas(seas):
    amplitudes, _, phases = seas
    # 4 √m₀ in every sea, by time; and over seas, at one place and time
    np.testing.assert_allclose(4.0 * np.sqrt(0.5 * (amplitudes**2).sum(0)), 0.4, rtol=1e-12)
    np.testing.assert_allclose(4.0 * (amplitudes * np.cos(phases)).sum(0).std(), 0.4, rtol=0.02)
    regular = drawn(sea_params(0.4, 2.0, False, DEPTH), DIRECTION, KEY, 0.0)
    assert [wave.amplitude for wave in regular] == [0.2, 0.0, 0.0, 0.0]
    for wave in drawn(sea_params(0.0, 2.0, True, DEPTH), DIRECTION, KEY, 0.0):
        assert wave.amplitude == wave.speed == 0.0


def test_spectrum_of_seas(seas):
    """Energy in bands finer than those that components are drawn from."""
    amplitudes, omegas, _ = seas
    edges = np.pi * np.array([0.5, 0.8, 0.9, 0.95, 1.0, 1.05, 1.1, 1.2, 1.35, 1.55, 1.8, 2.2, 3.0])
    energy, _ = np.histogram(omegas, edges, weights=0.5 * amplitudes**2)
    expected = [quad(jonswap, low, high, args=(np.pi,))[0] for low, high in pairwise(edges)]
    np.testing.assert_allclose(energy / energy.sum(), expected / np.sum(expected), rtol=0.05)
    fine, places = np.histogram(omegas, np.pi * np.arange(0.51, 2.0, 0.02), weights=amplitudes**2)
    np.testing.assert_allclose(places[np.argmax(fine)] / np.pi, 0.99, atol=0.021)


def test_orbital_speed_of_seas(seas):
    """Mean square of ω a cos θ against ∫ ω² S dω."""
    amplitudes, omegas, _ = seas
    whole = quad(jonswap, 0.5 * np.pi, 3.0 * np.pi, args=(np.pi,), points=[np.pi])[0]
    weighed = quad(lambda omega: omega**2 * jonswap(omega, np.pi), 0.5 * np.pi, 3.0 * np.pi, points=[np.pi])[0]
    found = 0.5 * (amplitudes**2 * omegas**2).sum(0).mean()
    np.testing.assert_allclose(found, 0.1**2 * weighed / whole, rtol=0.01)


def test_phases_are_any(seas):
    _, omegas, phases = seas
    np.testing.assert_array_less(phases, 2.0 * np.pi)
    assert abs(np.exp(1j * phases).mean(1)).max() < 4.5 / np.sqrt(SEAS)
    assert abs(np.corrcoef(np.concatenate([omegas, phases])) - np.eye(2 * COMPONENTS)).max() < 4.5 / np.sqrt(SEAS)


@pytest.mark.parametrize("period", [0.3, 20.0])
def test_shortest_and_longest(period):
    """Short waves leave the deep still; long ones take all the water along."""
    sea = drawn(sea_params(0.01, period, True, DEPTH), DIRECTION, KEY, 0.0)
    for z in (0.0, -0.5, -2.0, -DEPTH, -2.0 * DEPTH):
        water = water_at(sea, 1.0, 2.0, z, 3.0)
        assert np.isfinite(water).all()
        assert (np.abs(water).max() < 1e-9) == (period == 0.3 and z < 0.0)
