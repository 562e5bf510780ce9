"""Wind against MIL-F-8785C and against exact stochastic calculus, at any time step."""

from itertools import pairwise

import numpy as np
import pytest
from scipy import signal, stats
from scipy.linalg import expm

from benchmarks.dryden import blow
from hydrone_gym._jit import kernel
from hydrone_gym.weather import wind as winds
from hydrone_gym.weather.noise import Key, kicks
from hydrone_gym.weather.wind import Gusts, dryden, filter_of, wind_params

STEPS = [(0.001, 100.0), (0.005, 20.0), (0.010, 12.0), (0.020, 8.0), (0.050, 3.0)]  # s, m/s
STATIONARY = np.diag([1.0, 1.0, 0.5, 1.0, 0.5])
STATIONARY[[1, 2, 3, 4], [2, 1, 4, 3]] = 0.5
DIRECTION = (0.6, -0.8)


@kernel
def gusts_after(wind, steps, out):
    """States (5, streams) of the filters after so many steps."""
    for i in range(out.shape[1]):
        key = Key(float(i), 2.0)
        gusts = winds.first_gusts(key, 7.0)
        for j in range(steps):
            a, b = kicks(key, 10.0 + 3.0 * j)
            c, d = kicks(key, 11.0 + 3.0 * j)
            e, _ = kicks(key, 12.0 + 3.0 * j)
            gusts = winds.next_gusts(gusts, wind, (a, b, c, d, e))
        out[0, i], out[1, i], out[2, i], out[3, i], out[4, i] = gusts


@kernel
def velocity_of(gusts, wind, direction, profile):
    return winds.velocity(gusts, wind, direction, profile)


@kernel
def stepped(gusts, wind, noise):
    return winds.next_gusts(gusts, wind, noise)


@kernel
def profile_at(z, shear):
    return winds.shear_profile(z, shear)


def along_across_up(velocities, direction):
    x, y, z = velocities
    return np.array([x * direction[0] + y * direction[1], y * direction[0] - x * direction[1], z])


def specification(feet, speed):
    """σ_u, σ_w in the unit of the speed, and L_u, L_w in feet, as MIL-F-8785C has them below 1000 ft."""
    rise = 0.177 + 0.000823 * feet
    return 0.1 * speed / rise**0.4, 0.1 * speed, feet / rise**1.2, feet


def times(speed):
    """Time constants along, across and upwards in s."""
    _, _, length, rising = dryden(speed)
    return np.array([length, length, rising]) / speed


@pytest.fixture(scope="module", params=STEPS, ids="dt = {0[0]} s".format)
def blown(request):
    """Mean speed, velocities over 14,000 of the longest time constants, and the time between them."""
    dt, speed = request.param
    every = round(times(speed)[2] / 20.0 / dt)  # 20 samples in the shortest
    out = np.empty((3, 100, 20_000))
    blow(wind_params(speed, 1.0, False, dt), DIRECTION, every, out)
    return speed, along_across_up(out, DIRECTION), every * dt


def test_intensities_and_lengths():
    np.testing.assert_allclose(specification(8.0 / 0.3048, 1.0)[0], 0.19, atol=2e-3)
    np.testing.assert_allclose(specification(8.0 / 0.3048, 1.0)[2] * 0.3048, 55.7, atol=0.05)
    along, up, length, rising = dryden(7.0)
    expected = specification(20.0, 7.0)
    np.testing.assert_allclose([along, up, length / 0.3048, rising / 0.3048], expected, rtol=1e-12)


@pytest.mark.parametrize("share", [1e-5, 1e-3, 0.05, 0.5, 2.0])
@pytest.mark.parametrize("time", [0.3, 14.6])
def test_filter_is_exact(share, time):
    """Against van Loan's matrix exponential of ẋ₁ = (−x₁ + √(2τ) n) / τ, ẋ₂ = (x₁ − x₂) / τ."""
    dt = share * time
    drift = np.array([[-1.0, 0.0], [1.0, -1.0]]) / time
    noise = np.diag([2.0 / time, 0.0])
    both = expm(np.block([[-drift, noise], [np.zeros((2, 2)), drift.T]]) * dt)
    transition = both[2:, 2:].T
    f = filter_of(time, dt)
    kick = np.array([[f.kick_11, 0.0], [f.kick_21, f.kick_22]])
    np.testing.assert_allclose([[f.keep, 0.0], [f.pass_on, f.keep]], transition, rtol=0, atol=1e-12)
    np.testing.assert_allclose(kick @ kick.T, transition @ both[:2, 2:], rtol=0, atol=1e-12)


@pytest.mark.parametrize(("dt", "speed"), STEPS)
def test_a_step_keeps_what_the_first_draw_has(dt, speed):
    """Φ P Φᵀ + K Kᵀ = P, with the matrices read off the step itself."""
    wind = wind_params(speed, 1.0, False, dt)
    still, none = (0.0,) * 5, np.eye(5)
    keep = np.array([stepped(Gusts(*row), wind, still) for row in none]).T
    kick = np.array([stepped(Gusts(*still), wind, tuple(row)) for row in none]).T
    np.testing.assert_allclose(keep @ STATIONARY @ keep.T + kick @ kick.T, STATIONARY, rtol=0, atol=1e-12)


def test_transfer_functions():
    """Of unit white noise: σ √(2τ) / (1 + τ s) along, σ √τ (1 + √3 τ s) / (1 + τ s)² across and upwards."""
    wind = wind_params(5.0, 1.0, False, 0.01)
    along, up, *_ = dryden(5.0)
    outputs = np.array([velocity_of(Gusts(*row), wind, (1.0, 0.0), 0.0) for row in np.eye(5)]).T
    np.testing.assert_array_equal(outputs[0], [along, 0, 0, 0, 0])
    for sigma, time, read in ((along, times(5.0)[1], outputs[1, 1:3]), (up, times(5.0)[2], outputs[2, 3:])):
        system = np.array([[-1.0, 0.0], [1.0, -1.0]]) / time, np.array([[np.sqrt(2.0 / time)], [0.0]])
        numerator, denominator = signal.ss2tf(*system, read[None], np.zeros((1, 1)))
        expected = sigma * np.sqrt(time) * np.array([0.0, np.sqrt(3.0) * time, 1.0])
        np.testing.assert_allclose(numerator[0] * time**2, expected, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(denominator * time**2, [time**2, 2.0 * time, 1.0], rtol=1e-12)


def test_mean_and_deviation(blown):
    speed, series, _ = blown
    along, up, *_ = dryden(speed)
    deviations = np.array([along, along, up])
    np.testing.assert_allclose(series.std((1, 2)), deviations, rtol=0.02)
    np.testing.assert_allclose((series.mean((1, 2)) - [speed, 0, 0]) / deviations, 0.0, atol=0.03)
    correlation = np.corrcoef(series.reshape(3, -1))
    np.testing.assert_allclose(correlation, np.eye(3), atol=0.02)


def test_autocorrelation(blown):
    """e^(−t/τ) along; e^(−t/τ) (1 − t / 2τ) across and upwards."""
    speed, series, between = blown
    series = series - series.mean((1, 2), keepdims=True)
    for gust, time, turn in zip(series, times(speed), (0.0, 0.5, 0.5), strict=True):
        lags = np.round(np.geomspace(0.1, 4.0, 8) * time / between).astype(int)
        found = [np.mean(gust[:, :-lag] * gust[:, lag:]) for lag in lags] / gust.var()
        passed = lags * between / time
        np.testing.assert_allclose(found, np.exp(-passed) * (1.0 - turn * passed), rtol=0, atol=0.025)


def test_spectrum(blown):
    """Welch's estimate against Dryden's densities, up to a twentieth of the sampling rate, where nothing folds back."""
    speed, series, between = blown
    mean = np.array([speed, 0.0, 0.0])[:, None, None]
    frequencies, density = signal.welch(series - mean, 1.0 / between, nperseg=5_000, detrend=False)
    density = density.mean(1)
    along, up, *_ = dryden(speed)
    edges = np.geomspace(8.0 * frequencies[1], 0.05 / between, 6)
    for k, (sigma, time) in enumerate(zip((along, along, up), times(speed), strict=True)):
        x = 2.0 * np.pi * frequencies * time
        shape = 2.0 / (1.0 + x**2) if k == 0 else (1.0 + 3.0 * x**2) / (1.0 + x**2) ** 2
        expected = 2.0 * sigma**2 * time * shape
        for low, high in pairwise(edges):
            band = (frequencies >= low) & (frequencies < high)
            np.testing.assert_allclose(density[k, band].mean(), expected[band].mean(), rtol=0.05)


@pytest.mark.parametrize("steps", [0, 1, 50])
def test_first_draw_is_as_any_later_one(steps):
    out = np.empty((5, 40_000))
    gusts_after(wind_params(12.0, 1.0, False, 0.05), steps, out)
    np.testing.assert_allclose(np.cov(out), STATIONARY, rtol=0, atol=0.025)
    np.testing.assert_allclose(out.mean(1), 0.0, atol=0.025)
    np.testing.assert_allclose(stats.kurtosis(out, axis=1), 0.0, atol=0.12)


def test_direction_turns_the_wind():
    wind, gusts = wind_params(6.0, 0.7, False, 0.05), Gusts(0.3, -1.2, 0.4, 0.9, -0.5)
    x, y, z = velocity_of(gusts, wind, (1.0, 0.0), 0.9)
    assert abs(y) > 0.1
    for angle in np.linspace(-3.0, 3.0, 7):
        cosine, sine = np.cos(angle), np.sin(angle)
        expected = [x * cosine - y * sine, x * sine + y * cosine, z]
        np.testing.assert_allclose(velocity_of(gusts, wind, (cosine, sine), 0.9), expected, rtol=0, atol=1e-14)


def test_profile_scales_the_mean_alone():
    wind, gusts = wind_params(6.0, 1.0, True, 0.05), Gusts(0.3, -1.2, 0.4, 0.9, -0.5)
    whole, part = (np.array(velocity_of(gusts, wind, DIRECTION, profile)) for profile in (1.0, 0.25))
    np.testing.assert_allclose(whole - part, [4.5 * 0.6, 4.5 * -0.8, 0.0], rtol=0, atol=1e-14)


def test_shear_is_logarithmic():
    """MIL-F-8785C, category C: ln(h / 0.15 ft) / ln(20 ft / 0.15 ft) from 3 ft on."""
    for feet in (3.0, 10.0, 20.0, 30.0):
        expected = np.log(feet / 0.15) / np.log(20.0 / 0.15)
        np.testing.assert_allclose(profile_at(feet * 0.3048, 1.0), expected, rtol=1e-14)
        assert profile_at(feet * 0.3048, 0.0) == 1.0
    assert profile_at(-2.0, 1.0) == profile_at(0.5, 1.0) == profile_at(3.0 * 0.3048, 1.0)


def test_share_of_turbulence():
    full, half, none = (wind_params(9.0, share, False, 0.05) for share in (1.0, 0.5, 0.0))
    gusts = Gusts(0.3, -1.2, 0.4, 0.9, -0.5)
    strong, weak = (np.array(velocity_of(gusts, wind, DIRECTION, 0.0)) for wind in (full, half))
    np.testing.assert_allclose(weak, 0.5 * strong, rtol=1e-14)
    assert velocity_of(gusts, none, (1.0, 0.0), 1.0) == (9.0, 0.0, 0.0)


def test_still_air_is_still():
    wind = wind_params(0.0, 1.0, True, 0.05)
    gusts = stepped(Gusts(0.3, -1.2, 0.4, 0.9, -0.5), wind, (1.0, 1.0, 1.0, 1.0, 1.0))
    np.testing.assert_array_equal(velocity_of(gusts, wind, (1.0, 0.0), 1.0), 0.0)
