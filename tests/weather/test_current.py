"""Current: a stationary Gauss-Markov process about its mean, at any time step."""

import numpy as np
import pytest

from hydrone_gym._jit import kernel
from hydrone_gym.weather import current as currents
from hydrone_gym.weather.current import TIME, Eddies, current_params
from hydrone_gym.weather.noise import Key, kicks

SPEED, VARIATION, DIRECTION = 0.4, 0.3, (-0.28, 0.96)


@kernel
def flow(current, direction, every, out):
    """Velocities (2, streams, samples) of streams that begin as an episode does, a sample every so many steps."""
    _, streams, samples = out.shape
    for i in range(streams):
        key = Key(float(i), 1.0)
        eddies = currents.first_eddies(key, 0.0)
        n = 1.0
        for j in range(samples):
            out[0, i, j], out[1, i, j] = currents.velocity(eddies, current, direction)
            for _ in range(every):
                eddies = currents.next_eddies(eddies, current, kicks(key, n))
                n += 1.0


@kernel
def velocity_of(eddies, current, direction):
    return currents.velocity(eddies, current, direction)


def flown(dt, every, streams, samples):
    out = np.empty((2, streams, samples))
    flow(current_params(SPEED, VARIATION, dt), DIRECTION, every, out)
    return out - SPEED * np.array(DIRECTION)[:, None, None]


@pytest.mark.parametrize("dt", [0.05, 0.5, 5.0])
def test_mean_deviation_and_autocorrelation(dt):
    series = flown(dt, max(1, round(0.1 * TIME / dt)), 200, round(100 * TIME / max(dt, 0.1 * TIME)))
    between = max(dt, 0.1 * TIME)
    np.testing.assert_allclose(series.std((1, 2)), VARIATION * SPEED, rtol=0.02)
    np.testing.assert_allclose(series.mean((1, 2)) / (VARIATION * SPEED), 0.0, atol=0.04)
    assert abs(np.corrcoef(series.reshape(2, -1))[0, 1]) < 0.04
    for component in series:
        for lag in (1, 2, 5, 10, 20, 30):
            found = np.mean(component[:, :-lag] * component[:, lag:]) / component.var()
            np.testing.assert_allclose(found, np.exp(-lag * between / TIME), rtol=0, atol=0.03)


@pytest.mark.parametrize("dt", [0.05, 0.5, 5.0])
def test_a_step_keeps_the_variance(dt):
    current = current_params(SPEED, VARIATION, dt)
    np.testing.assert_allclose(current.keep**2 + current.kick**2, 1.0, rtol=0, atol=1e-15)
    np.testing.assert_allclose(current.keep, np.exp(-dt / 20.0), rtol=1e-15)


def test_first_draw_is_as_any_later_one():
    series = flown(0.05, 40, 50_000, 3)
    np.testing.assert_allclose(series.std(1), VARIATION * SPEED, rtol=0.02)
    np.testing.assert_allclose(series.mean(1) / (VARIATION * SPEED), 0.0, atol=0.02)
    assert max(abs(np.corrcoef(*series[:, :, k])[0, 1]) for k in range(3)) < 0.02


def test_mean_flows_to_its_direction():
    for angle in np.linspace(-3.0, 3.0, 7):
        direction = np.cos(angle), np.sin(angle)
        found = velocity_of(Eddies(0.0, 0.0), current_params(0.4, 0.5, 0.05), direction)
        np.testing.assert_allclose(found, 0.4 * np.array(direction), rtol=1e-15)


def test_eddies_are_of_the_water_not_of_the_mean():
    """As strong along x and y whatever the direction, a share of the mean speed, and nothing without it."""
    current = current_params(0.4, 0.5, 0.05)
    found = velocity_of(Eddies(1.5, -2.0), current, DIRECTION)
    np.testing.assert_allclose(found - 0.4 * np.array(DIRECTION), [0.3, -0.4], rtol=1e-14)
    assert velocity_of(Eddies(1.5, -2.0), current_params(0.0, 0.5, 0.05), DIRECTION) == (0.0, 0.0)
