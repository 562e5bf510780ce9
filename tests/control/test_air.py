"""The laws in air: eqs. 5-8 where no limit binds, and what the limits do."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hydrone_gym.physics.dynamics import state_derivative
from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL
from tests.control.instant import rotor_speeds, state_at

VEHICLES = pytest.mark.parametrize("vehicle", [HYDRONE, HYDRONE_PHYSICAL], ids=lambda vehicle: vehicle.name)
MIX = np.array([[1, 0, -1, 1], [1, 1, 0, -1], [1, 0, 1, 1], [1, -1, 0, -1]])  # eq. 5


@VEHICLES
@pytest.mark.parametrize("psi", [0.0, 2.0, -3.0])
def test_hovers_at_the_reference(vehicle, psi):
    speeds, memory = rotor_speeds(vehicle, state_at(5.0, angles=(0, 0, psi)), (0, 0, 5, psi))
    np.testing.assert_allclose(speeds, vehicle.hover_speed, rtol=1e-12)
    np.testing.assert_array_equal(memory, 0.0)


@VEHICLES
def test_printed_laws_where_no_limit_binds(vehicle):
    """Eqs. 6 to 8 written out: PD in altitude and attitude, tilt from position, mixed by eq. 5."""
    g = vehicle.air_gains
    phi, theta, psi = 0.02, -0.03, 0.7
    velocity, rates = np.array([0.1, -0.05, 0.02]), np.array([0.01, 0.02, -0.03])
    error, error_psi = np.array([0.2, -0.1, 0.05]), 0.1
    state = state_at(5.0, angles=(phi, theta, psi), velocity=velocity, rates=rates)
    speeds, memory = rotor_speeds(vehicle, state, (*(state[:3] + error), psi + error_psi))

    correction = g.altitude_p * error[2] - g.altitude_d * velocity[2] + g.altitude_i * error[2] * 0.01
    lift = correction / (np.cos(phi) * np.cos(theta)) + vehicle.hover_speed
    to_tilt = np.array([[np.sin(psi), -np.cos(psi)], [np.cos(psi), np.sin(psi)]])  # E11
    tilt = to_tilt @ (g.position_p * error[:2] - g.position_d * velocity[:2])
    euler = state_derivative(state, np.zeros(4), vehicle)[3:6]
    roll = g.roll_p * (tilt[0] - phi) - g.roll_d * euler[0]
    pitch = g.pitch_p * (tilt[1] - theta) - g.pitch_d * euler[1]
    yaw = g.yaw_p * error_psi - g.yaw_d * euler[2]
    np.testing.assert_allclose(speeds, MIX @ [lift, roll, pitch, yaw], rtol=1e-12)
    assert memory[0] == pytest.approx(g.altitude_i * error[2] * 0.01)


@VEHICLES
@settings(max_examples=200, deadline=None)
@given(psi=st.floats(-np.pi, np.pi), bearing=st.floats(-np.pi, np.pi), distance=st.floats(0.05, 50.0))
def test_tilts_towards_the_reference_at_any_heading(vehicle, psi, bearing, distance):
    """E11: the first thing the rotors do is turn the thrust towards the reference."""
    aim = np.array([np.cos(bearing), np.sin(bearing)])
    state = state_at(5.0, angles=(0, 0, psi))
    speeds, _ = rotor_speeds(vehicle, state, (*(distance * aim), 5.0, psi))
    mean = np.full(4, speeds.mean())
    turning = state_derivative(state, speeds, vehicle)[9:11] - state_derivative(state, mean, vehicle)[9:11]
    # pitching forward tips the thrust along +x of the body, rolling left along +y
    tipped = np.array([turning[1] / vehicle.air_gains.pitch_p, -turning[0] / vehicle.air_gains.roll_p])
    tipped *= np.array(vehicle.inertia)[[1, 0]]
    towards = np.array([[np.cos(psi), -np.sin(psi)], [np.sin(psi), np.cos(psi)]]) @ tipped
    assert towards @ aim / np.linalg.norm(towards) > np.cos(np.radians(2.0))


def eigenvalues(to_tilt, psi, vehicle):
    """The position loop with attitude at its reference: world acceleration g Rz [theta, -phi], tilt = to_tilt (PD)."""
    turn = np.array([[np.cos(psi), -np.sin(psi)], [np.sin(psi), np.cos(psi)]])
    push = vehicle.gravity * turn @ np.array([[0.0, 1.0], [-1.0, 0.0]]) @ to_tilt
    gains = vehicle.air_gains
    system = np.block([[np.zeros((2, 2)), np.eye(2)], [-gains.position_p * push, -gains.position_d * push]])
    return np.linalg.eigvals(system)


@pytest.mark.parametrize("psi", [0.0, -0.8, 2.0, 3.1])
def test_e11_printed_position_law_is_unstable(psi):
    """As printed, at zero heading roll answers x and pitch answers y, and the vehicle spirals away."""
    printed = np.array([[np.cos(psi), -np.sin(psi)], [np.sin(psi), np.cos(psi)]])
    built = np.array([[np.sin(psi), -np.cos(psi)], [np.cos(psi), np.sin(psi)]])
    assert eigenvalues(printed, psi, HYDRONE).real.max() > 0.2
    assert eigenvalues(built, psi, HYDRONE).real.max() < -0.2


@VEHICLES
@settings(max_examples=200, deadline=None)
@given(values=st.lists(st.floats(-100, 100, allow_nan=False), min_size=16, max_size=16), vertical=st.booleans())
def test_rotor_limits_hold_and_memory_is_bounded(vehicle, values, vertical):
    state = np.array([*values[:2], abs(values[2]) + 0.01, *np.clip(values[3:5], -1.2, 1.2), 0.3, *values[5:11]])
    speeds, memory = rotor_speeds(vehicle, state, (*values[11:14], values[14] / 40), vertical=vertical)
    assert np.isfinite(speeds).all()
    assert speeds.min() >= 0.0
    assert speeds.max() <= vehicle.rotor_limit_air
    assert abs(memory[0]) <= vehicle.air_gains.altitude_i_limit
    assert np.abs(memory[1:]).max() <= vehicle.air_gains.attitude_i_limit


def test_memory_waits_while_a_rotor_saturates():
    """Anti-windup: with the integral gain as it is, one free and one saturated instant."""
    free = rotor_speeds(HYDRONE, state_at(5.0), (0, 0, 5.1, 0))[1]
    bound = rotor_speeds(HYDRONE, state_at(5.0, rates=(30.0, 0, 0)), (0, 0, 5.1, 0))
    assert free[0] > 0.0
    assert bound[0].max() == HYDRONE.rotor_limit_air
    assert bound[1][0] == 0.0


def test_memory_waits_while_the_speed_limit_binds():
    assert rotor_speeds(HYDRONE, state_at(5.0), (0, 0, 9.0, 0))[1][0] == 0.0


def test_memory_is_clamped():
    limit = HYDRONE.air_gains.altitude_i_limit
    assert rotor_speeds(HYDRONE, state_at(5.0), (0, 0, 5.1, 0), integral=(limit, 0, 0, 0))[1][0] == limit


@pytest.mark.parametrize("lateral", [0.0, 0.04, 0.075, 0.2, 2.0])
def test_waits_above_the_water_until_still(lateral):
    """Vertical mode lets the vehicle descend only as it comes to rest; climbing is always allowed."""
    gains = HYDRONE.air_gains
    state = state_at(0.5, velocity=(lateral, 0, 0))
    still = rotor_speeds(HYDRONE, state, (0, 0, 0.5, 0), vertical=True)[0].mean()
    down = rotor_speeds(HYDRONE, state, (0, 0, -3.0, 0), vertical=True)[0].mean()
    up = rotor_speeds(HYDRONE, state, (0, 0, 3.0, 0), vertical=True)[0].mean()
    share = np.clip(2 - lateral / gains.zone_lateral_speed, 0, 1)
    assert still - down == pytest.approx(share * gains.zone_speed_limit * gains.altitude_d, abs=1e-9)
    assert up - still == pytest.approx(gains.zone_speed_limit * gains.altitude_d, rel=1e-9)


def test_vertical_mode_ignores_where_the_reference_is():
    state = state_at(0.5, velocity=(0.1, -0.2, 0.0))
    near = rotor_speeds(HYDRONE, state, (0, 0, 1, 0), vertical=True)[0]
    far = rotor_speeds(HYDRONE, state, (5, -7, 1, 0), velocity=(2, 2, 0), vertical=True)[0]
    np.testing.assert_array_equal(near, far)


def test_a_far_reference_asks_for_no_more_than_the_speed_limit():
    """At 2 m/s towards a reference 20 m away nothing pulls any more."""
    limit = HYDRONE.air_gains.speed_limit
    speeds, _ = rotor_speeds(HYDRONE, state_at(5.0, velocity=(limit, 0, 0)), (20, 0, 5, 0))
    np.testing.assert_allclose(speeds, HYDRONE.hover_speed, rtol=1e-12)


@pytest.mark.parametrize("turn", [3.0, -3.0])
def test_yaw_takes_the_short_way(turn):
    state = state_at(5.0, angles=(0, 0, turn))
    speeds, _ = rotor_speeds(HYDRONE, state, (0, 0, 5, -turn))
    assert np.sign(state_derivative(state, speeds, HYDRONE)[11]) == np.sign(turn)


def test_gains_are_checked():
    with pytest.raises(ValueError, match=r"AirGains\.roll_p must be positive \(rpm/rad\), got -1\.0"):
        dataclasses.replace(HYDRONE.air_gains, roll_p=-1.0)
