"""The laws in water: eqs. 13-16 mixed in newtons, driving both ways, and holding still."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL
from tests.control.instant import rotor_speeds, state_at
from tests.physics import oracle

VEHICLES = pytest.mark.parametrize("vehicle", [HYDRONE, HYDRONE_PHYSICAL], ids=lambda vehicle: vehicle.name)
MIX = np.array([[1, 0, -1, 0], [0, 1, 0, 1], [1, 0, 1, 0], [0, 1, 0, -1]])  # eq. 13


def thrusts(vehicle, speeds):
    return 1000.0 * vehicle.thrust_water * speeds * np.abs(speeds)


@VEHICLES
@pytest.mark.parametrize("psi", [0.0, 2.0, -3.0])
def test_holds_neutral_at_the_reference(vehicle, psi):
    speeds, _ = rotor_speeds(vehicle, state_at(-3.0, angles=(0, 0, psi)), (0, 0, -3, psi))
    np.testing.assert_allclose(speeds, [vehicle.neutral_speed, 0, vehicle.neutral_speed, 0], rtol=1e-12)


@VEHICLES
def test_laws_where_no_limit_binds(vehicle):
    """Eqs. 14 to 16 with gains in newtons, mixed by eq. 13, then the signed root of each thrust (E12, E13)."""
    g = vehicle.water_gains
    phi, theta, psi = 0.02, -0.03, 0.4
    velocity = np.array([0.1, 0.05, 0.02])
    state = state_at(-3.0, angles=(phi, theta, psi), velocity=velocity)
    ahead, aside, error_z = 0.6, 0.03, 0.01
    turn = np.array([[np.cos(psi), -np.sin(psi)], [np.sin(psi), np.cos(psi)]])
    speeds, _ = rotor_speeds(vehicle, state, (*(turn @ [ahead, aside]), -3.0 + error_z, 0.0))

    m = oracle.medium(vehicle, water=True)
    climb = g.depth_p / g.depth_d * error_z
    drag = m.drag[2, 2] * climb * abs(climb) / 2
    lift = (g.depth_p * error_z - g.depth_d * velocity[2] + g.depth_i * error_z * 0.01 + drag) / (
        np.cos(phi) * np.cos(theta)
    ) - (m.displaced - m.dry_mass) * m.gravity / 2
    bearing = np.arctan2(aside, ahead)
    surge = min(g.surge_p * np.hypot(ahead, aside) + g.surge_misalignment * bearing**2, g.surge_limit)
    pitch = -g.pitch_p * theta
    np.testing.assert_allclose(
        thrusts(vehicle, speeds), MIX @ [lift, surge, pitch, g.yaw_p * bearing], rtol=1e-12, atol=1e-12
    )


@VEHICLES
def test_misalignment_slows_the_vehicle(vehicle):
    """E13: the gain is negative and the thrust never is, so the vehicle turns first and then swims."""
    forward = []
    for bearing in np.radians([0.0, 5.0, 10.0, 20.0, 40.0, 80.0]):
        speeds, _ = rotor_speeds(vehicle, state_at(-3.0), (0.8 * np.cos(bearing), 0.8 * np.sin(bearing), -3.0, 0.0))
        forward.append(thrusts(vehicle, speeds)[[1, 3]].sum())
    raw = vehicle.water_gains
    assert forward[0] == pytest.approx(2 * raw.surge_p * 0.8)
    assert np.all(np.diff(forward[:3]) < 0.0)
    limit = 1000.0 * vehicle.thrust_water * vehicle.rotor_limit_water**2
    assert max(forward) <= 2 * limit


def test_a_positive_misalignment_gain_is_refused():
    with pytest.raises(ValueError, match=r"WaterGains\.surge_misalignment must not be positive \(N/rad\^2\)"):
        dataclasses.replace(HYDRONE.water_gains, surge_misalignment=1.0)


@VEHICLES
@settings(max_examples=150, deadline=None)
@given(psi=st.floats(-np.pi, np.pi), bearing=st.floats(0.05, 1.5), distance=st.floats(0.6, 20.0), side=st.booleans())
def test_drives_both_ways(vehicle, psi, bearing, distance, side):
    """A reference behind is reached in reverse: same turn, opposite thrust; nothing else changes."""
    bearing = bearing if side else -bearing
    offset = distance * np.array([np.cos(psi + bearing), np.sin(psi + bearing)])
    state = state_at(-3.0, angles=(0, 0, psi))
    ahead = thrusts(vehicle, rotor_speeds(vehicle, state, (*offset, -3.0, 0.0))[0])
    behind = thrusts(vehicle, rotor_speeds(vehicle, state, (*-offset, -3.0, 0.0))[0])
    assert ahead[1] - ahead[3] == pytest.approx(behind[1] - behind[3], abs=1e-9)
    assert ahead[1] + ahead[3] == pytest.approx(-behind[1] - behind[3], abs=1e-9)
    assert np.sign(ahead[1] - ahead[3]) == np.sign(bearing)


@VEHICLES
@pytest.mark.parametrize("vertical", [False, True])
def test_holds_by_braking_surge_and_yaw(vehicle, vertical):
    """Within the hold radius, and anywhere in vertical mode, position no longer matters."""
    gains = vehicle.water_gains
    state = state_at(-0.5 if vertical else -3.0, velocity=(0.2, 0.1, 0.0))
    reference = (5.0, 4.0) if vertical else (0.9 * gains.hold_radius, 0.0)
    held = thrusts(vehicle, rotor_speeds(vehicle, state, (*reference, state[2], 0.0), vertical=vertical)[0])
    np.testing.assert_allclose(held[[1, 3]], -gains.surge_brake * 0.2, rtol=1e-12)


def test_just_outside_the_hold_radius_it_drives():
    gains = HYDRONE.water_gains
    speeds, _ = rotor_speeds(HYDRONE, state_at(-3.0), (gains.hold_radius + 1e-6, 0.0, -3.0, 0.0))
    assert thrusts(HYDRONE, speeds)[1] == pytest.approx(gains.surge_p * gains.hold_radius, rel=1e-4)


@VEHICLES
@settings(max_examples=150, deadline=None)
@given(values=st.lists(st.floats(-100, 100, allow_nan=False), min_size=16, max_size=16), vertical=st.booleans())
def test_rotor_limits_hold_and_memory_is_bounded(vehicle, values, vertical):
    state = np.array([*values[:2], -abs(values[2]), *np.clip(values[3:5], -1.2, 1.2), 0.3, *values[5:11]])
    speeds, memory = rotor_speeds(vehicle, state, (*values[11:14], values[14] / 40), vertical=vertical)
    assert np.isfinite(speeds).all()
    assert np.abs(speeds).max() <= vehicle.rotor_limit_water
    assert abs(memory[0]) <= vehicle.water_gains.depth_i_limit


def test_depth_law_is_steep_around_rest():
    """E12: thrust grows in proportion to the depth error, where a law linear in rpm would be flat."""
    lift = []
    for error in (-0.02, -0.01, 0.0, 0.01, 0.02):
        speeds, _ = rotor_speeds(HYDRONE, state_at(-3.0), (0, 0, -3 + error, 0))
        lift.append(thrusts(HYDRONE, speeds)[[0, 2]].sum())
    np.testing.assert_allclose(np.diff(lift), 2 * HYDRONE.water_gains.depth_p * 0.01, rtol=0.05)


def test_reference_straight_aside():
    """The line of sight at a right angle divides by zero nowhere and turns at full rate without driving."""
    speeds, _ = rotor_speeds(HYDRONE, state_at(-3.0), (0.0, 2.0, -3.0, 0.0))
    assert speeds[1] == -speeds[3] == HYDRONE.rotor_limit_water
