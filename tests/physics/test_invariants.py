"""What physics forbids: drag that adds energy, gyroscopic terms that do work, and equilibria that drift."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hydrone_gym.physics.dynamics import state_derivative
from hydrone_gym.physics.parameters import vehicle_params
from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL, Vehicle
from tests.physics import oracle

VEHICLES = pytest.mark.parametrize("vehicle", [HYDRONE, HYDRONE_PHYSICAL], ids=lambda vehicle: vehicle.name)
MEDIA = pytest.mark.parametrize("water", [False, True], ids=["air", "water"])
STILL = np.zeros(4)


def state(*, water, angles=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0), rates=(0.0, 0.0, 0.0)):
    return np.array([0.0, 0.0, -2.0 if water else 2.0, *angles, *velocity, *rates])


def numbers(limit):
    return st.floats(-limit, limit, allow_nan=False, width=64)


angles = st.tuples(numbers(1.4), numbers(1.4), numbers(np.pi))
velocities = st.tuples(numbers(20.0), numbers(20.0), numbers(20.0))
rates = st.tuples(numbers(30.0), numbers(30.0), numbers(30.0))


def without(vehicle: Vehicle, **changes) -> Vehicle:
    return dataclasses.replace(vehicle, name="custom", **changes)


@VEHICLES
@MEDIA
@settings(max_examples=150, deadline=None)
@given(angles=angles, velocity=velocities)
def test_translational_drag_takes_energy(vehicle, water, angles, velocity):
    """Kinetic energy with gravity's share taken out analytically: what is left is drag, at any attitude."""
    m = oracle.medium(vehicle, water=water)
    acceleration = state_derivative(state(water=water, angles=angles, velocity=velocity), STILL, vehicle)[6:9]
    weight = (m.dry_mass - m.displaced) * m.gravity
    power = m.total_mass * np.dot(velocity, acceleration) + weight * velocity[2]
    speed = np.linalg.norm(velocity)
    weakest = np.diag(m.drag).min()
    # the sum of cubes of the components is least when they are equal
    assert power <= -weakest * speed**3 / np.sqrt(3.0) * (1 - 1e-9) + 1e-9 * (1 + speed)


@VEHICLES
@MEDIA
@settings(max_examples=150, deadline=None)
@given(rates=rates)
def test_rotational_drag_takes_energy_and_gyroscopic_terms_do_no_work(vehicle, water, rates):
    """Upright there is no restoring moment, so the power of every moment is the power of drag."""
    m = oracle.medium(vehicle, water=water)
    omega = np.array(rates)
    acceleration = state_derivative(state(water=water, rates=rates), STILL, vehicle)[9:12]
    power = omega @ m.total_inertia @ acceleration
    drag = -np.sum(np.diag(m.rotational_drag) * np.abs(omega) ** 3)
    assert power <= 1e-9
    assert power == pytest.approx(drag, rel=1e-9, abs=1e-9 * (1 + np.sum(np.abs(omega) ** 3)))


@VEHICLES
@MEDIA
@settings(max_examples=150, deadline=None)
@given(rates=rates)
def test_free_rotation_conserves_energy(vehicle, water, rates):
    free = without(vehicle, rotational_drag=(0.0, 0.0, 0.0))
    m = oracle.medium(free, water=water)
    acceleration = state_derivative(state(water=water, rates=rates), STILL, free)[9:12]
    scale = m.total_inertia.max() * np.linalg.norm(rates) * np.linalg.norm(acceleration)
    assert abs(np.array(rates) @ m.total_inertia @ acceleration) <= 1e-13 * (1 + scale)


def test_gyroscopic_term_is_there():
    free = without(HYDRONE, rotational_drag=(0.0, 0.0, 0.0))
    acceleration = state_derivative(state(water=False, rates=(1.0, 2.0, 3.0)), STILL, free)[9:12]
    jx, jy, jz = HYDRONE.inertia
    total = np.diag(oracle.medium(HYDRONE, water=False).total_inertia)
    np.testing.assert_allclose(acceleration * total, [6 * (jy - jz), 3 * (jz - jx), 2 * (jx - jy)], rtol=1e-12)


@VEHICLES
def test_hover_is_a_fixed_point(vehicle):
    """E10: one density everywhere, 3150.5 rpm."""
    assert vehicle.hover_speed == pytest.approx(3150.5, abs=0.05)
    for yaw in (0.0, 1.0, -3.0):
        derivative = state_derivative(state(water=False, angles=(0, 0, yaw)), np.full(4, vehicle.hover_speed), vehicle)
        np.testing.assert_allclose(derivative, 0.0, atol=2e-15 * vehicle.gravity)


@pytest.mark.parametrize(("vehicle", "rpm"), [(HYDRONE, -972.7), (HYDRONE_PHYSICAL, -439.1)])
def test_neutral_is_a_fixed_point(vehicle, rpm):
    """E9: two rotors running backwards cancel net buoyancy."""
    assert vehicle.neutral_speed == pytest.approx(rpm, abs=0.05)
    speeds = np.array([vehicle.neutral_speed, 0.0, vehicle.neutral_speed, 0.0])
    derivative = state_derivative(state(water=True, angles=(0, 0, 2.0)), speeds, vehicle)
    np.testing.assert_allclose(derivative, 0.0, atol=1e-14)


@VEHICLES
def test_restoring_moment_rights_the_vehicle(vehicle):
    for roll, pitch in ((0.3, 0.0), (0.0, 0.3), (-0.2, 0.4)):
        turning = state_derivative(state(water=True, angles=(roll, pitch, 0.5)), STILL, vehicle)[9:12]
        assert roll * turning[0] + pitch * turning[1] < 0.0
        flying = state_derivative(state(water=False, angles=(roll, pitch, 0.5)), STILL, vehicle)[9:12]
        np.testing.assert_array_equal(flying, 0.0)


def test_published_numbers():
    air, water = vehicle_params(HYDRONE).air, vehicle_params(HYDRONE).water
    assert 1 / air.inverse_mass == pytest.approx(1.28683, abs=5e-6)
    assert 1 / water.inverse_mass == pytest.approx(1.9301, abs=5e-5)
    tabled = (1.5639e-2, 2.9992e-2, 1.6584e-2)
    got = (1 / water.inverse_inertia_x, 1 / water.inverse_inertia_y, 1 / water.inverse_inertia_z)
    np.testing.assert_allclose(got, tabled, rtol=0, atol=1e-16)
    assert air.thrust * HYDRONE.hover_speed**2 == pytest.approx(3.144, abs=5e-4)
    per_mass = np.array([water.drag_x, water.drag_y, water.drag_z])
    np.testing.assert_allclose(per_mass / water.inverse_mass, (12.5, 12.5, 49.9), rtol=1e-12)
