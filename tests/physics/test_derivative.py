"""`state_derivative` against the slow oracle, and its errors."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hydrone_gym.physics.dynamics import state_derivative
from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL
from tests.physics import oracle

VEHICLES = pytest.mark.parametrize("vehicle", [HYDRONE, HYDRONE_PHYSICAL], ids=lambda vehicle: vehicle.name)
MEDIA = pytest.mark.parametrize("water", [False, True], ids=["air", "water"])


def random_state(rng, *, water):
    height = -rng.uniform(0.0, 5.0) if water else rng.uniform(1e-9, 10.0)
    position = [*rng.uniform(-10.0, 10.0, 2), height]
    angles = [*rng.uniform(-1.3, 1.3, 2), rng.uniform(-np.pi, np.pi)]
    return np.array([*position, *angles, *rng.normal(0.0, 3.0, 3), *rng.normal(0.0, 3.0, 3)])


def test_rotation_is_zxy():
    rng = np.random.default_rng(0)
    for phi, theta, psi in rng.uniform(-1.5, 1.5, (100, 3)):
        expected = Rotation.from_euler("ZXY", [psi, phi, theta]).as_matrix()
        np.testing.assert_allclose(oracle.rotation(phi, theta, psi), expected, rtol=0, atol=1e-15)


@VEHICLES
@MEDIA
def test_equals_the_oracle(vehicle, water):
    rng = np.random.default_rng(1)
    worst = 0.0
    for _ in range(10_000):
        state, rpm = random_state(rng, water=water), rng.uniform(-5500.0, 5500.0, 4)
        expected = oracle.state_derivative(state, rpm, vehicle)
        got = state_derivative(state, rpm, vehicle)
        for part in (slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)):
            error = np.abs(got[part] - expected[part]).max() / np.linalg.norm(expected[part])
            worst = max(worst, error)
    assert worst < 1e-9


def test_surface_belongs_to_the_water():
    state = np.zeros(12)
    assert state_derivative(state, np.zeros(4))[8] > 0.0  # buoyant
    state[2] = 1e-12
    assert state_derivative(state, np.zeros(4))[8] < -9.7  # falling


@pytest.mark.parametrize(
    ("state", "rpm", "vehicle", "message"),
    [
        (np.zeros(11), np.zeros(4), "paper", r"state must have shape \(12,\), got \(11,\)"),
        (np.zeros(12), np.zeros(3), "paper", r"rotor_speed must have shape \(4,\), got \(3,\)"),
        (np.full(12, np.nan), np.zeros(4), "paper", "state must be finite"),
        (np.zeros(12), np.full(4, np.inf), "paper", "rotor_speed must be finite"),
        (
            np.zeros(12),
            np.zeros(4),
            "boat",
            "vehicle must be one of 'paper', 'physical', 'hydrone-2021', 'hydrone-agile' or a Vehicle, got 'boat'",
        ),
    ],
)
def test_bad_input_is_named(state, rpm, vehicle, message):
    with pytest.raises(ValueError, match=message):
        state_derivative(state, rpm, vehicle)


def test_integers_and_lists_are_accepted():
    got = state_derivative([0] * 12, [1000] * 4, "paper")
    np.testing.assert_array_equal(got, state_derivative(np.zeros(12), np.full(4, 1000.0), HYDRONE))
