"""The polynomial sine, cosine and arctangent against extended precision."""

import numpy as np
import pytest

from hydrone_gym._jit import kernel
from hydrone_gym.physics.trigonometry import arctan, sincos, wrap


@kernel
def evaluate(angles, out):
    for i in range(angles.size):
        out[i, 0], out[i, 1] = sincos(angles[i])
        out[i, 2] = arctan(angles[i])
        out[i, 3] = wrap(angles[i])


def evaluated(angles):
    out = np.empty((angles.size, 4))
    evaluate(angles, out)
    return out.T


# Where long double is double the C library is the reference, and is itself only good to half a unit.
REFERENCE_ERROR = 0.0 if np.finfo(np.longdouble).eps < 1e-18 else 1.2e-16
BOUND = 4.5e-16 + REFERENCE_ERROR


def near_octants(span):
    """Angles where the polynomials meet and where the quadrant changes."""
    count = int(span / (np.pi / 4))
    octants = np.arange(-count, count + 1) * (np.pi / 4)
    return np.concatenate([octants + offset for offset in (-1e-6, -1e-12, 0.0, 1e-12, 1e-6)])


@pytest.mark.parametrize("span", [1.0, 10.0, 1e3, 99_999.0])
def test_sine_and_cosine(span):
    rng = np.random.default_rng(2)
    angles = np.concatenate([rng.uniform(-span, span, 400_000), near_octants(span)])
    sine, cosine, _, _ = evaluated(angles)
    exact = angles.astype(np.longdouble)
    assert np.abs(sine - np.sin(exact)).max() <= BOUND
    assert np.abs(cosine - np.cos(exact)).max() <= BOUND


def test_sine_keeps_small_angles():
    angles = 10.0 ** np.linspace(-300, -4, 1000)
    sine, cosine, arctangent, _ = evaluated(angles)
    np.testing.assert_allclose(sine, np.sin(angles), rtol=3e-16)
    np.testing.assert_allclose(arctangent, np.arctan(angles), rtol=3e-16)
    np.testing.assert_allclose(cosine, np.cos(angles), rtol=3e-16)


def test_arctangent():
    rng = np.random.default_rng(3)
    ratios = np.concatenate([rng.uniform(-3, 3, 400_000), np.tan(rng.uniform(-1.5707, 1.5707, 400_000))])
    ratios = np.concatenate([ratios, 10.0 ** rng.uniform(-20, 20, 100_000), [0.66, 2.414213562373095, 0.0]])
    _, _, arctangent, _ = evaluated(ratios)
    exact = np.arctan(ratios.astype(np.longdouble))
    assert np.abs(arctangent - exact).max() <= BOUND


def test_arctangent_of_infinity_and_nan():
    _, _, arctangent, _ = evaluated(np.array([np.inf, -np.inf, np.nan]))
    np.testing.assert_array_equal(arctangent, [np.pi / 2, -np.pi / 2, np.nan])


def test_wrap():
    angles = np.linspace(-3 * np.pi, 3 * np.pi, 10_001)
    *_, wrapped = evaluated(angles)
    assert np.abs(wrapped).max() <= np.pi
    np.testing.assert_allclose(np.sin(wrapped), np.sin(angles), rtol=0, atol=2e-15)
    np.testing.assert_allclose(np.cos(wrapped), np.cos(angles), rtol=0, atol=2e-15)
