"""Symmetries of the model: turning about the vertical, and the vehicle's two planes of symmetry."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hydrone_gym.physics.dynamics import state_derivative
from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL

VEHICLES = pytest.mark.parametrize("vehicle", [HYDRONE, HYDRONE_PHYSICAL], ids=lambda vehicle: vehicle.name)
#                      x  y  z φ  θ  ψ  vx vy vz p  q  r
LEFT_RIGHT = np.array([1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1])
FRONT_BACK = np.array([-1, 1, 1, 1, -1, -1, -1, 1, 1, 1, -1, -1])


def vectors(count, limit):
    return st.lists(st.floats(-limit, limit, allow_nan=False), min_size=count, max_size=count).map(np.array)


@st.composite
def states(draw, *, water):
    height = draw(st.floats(-5.0, 0.0) if water else st.floats(1e-3, 10.0))
    return np.concatenate(
        [
            draw(vectors(2, 10.0)),
            [height],
            draw(vectors(2, 1.2)),
            draw(vectors(1, np.pi)),
            draw(vectors(3, 5.0)),
            draw(vectors(3, 5.0)),
        ]
    )


speeds = vectors(4, 5000.0)


def close(got, expected):
    np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-12 * (1.0 + np.abs(expected).max()))


@VEHICLES
@settings(max_examples=150, deadline=None)
@given(state=st.one_of(states(water=False), states(water=True)), rpm=speeds, turn=st.floats(-7.0, 7.0))
def test_no_heading_is_special(vehicle, state, rpm, turn):
    matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])

    def turned(vector):
        out = vector.copy()
        out[:2], out[6:8] = matrix @ vector[:2], matrix @ vector[6:8]
        return out

    start = turned(state)
    start[5] += turn
    close(state_derivative(start, rpm, vehicle), turned(state_derivative(state, rpm, vehicle)))


@VEHICLES
@settings(max_examples=150, deadline=None)
@given(state=states(water=True), rpm=speeds)
def test_water_left_is_right(vehicle, state, rpm):
    """Rotors 2 and 4 swap; the yaw moment is differential thrust, so it mirrors too."""
    mirrored = state_derivative(LEFT_RIGHT * state, rpm[[0, 3, 2, 1]], vehicle)
    close(mirrored, LEFT_RIGHT * state_derivative(state, rpm, vehicle))


@VEHICLES
@settings(max_examples=150, deadline=None)
@given(state=states(water=True), rpm=speeds)
def test_water_front_is_back(vehicle, state, rpm):
    """Rotors 1 and 3 swap and the thrusters reverse: thrust is signed (E9)."""
    mirrored = state_derivative(FRONT_BACK * state, np.array([rpm[2], -rpm[1], rpm[0], -rpm[3]]), vehicle)
    close(mirrored, FRONT_BACK * state_derivative(state, rpm, vehicle))


@VEHICLES
@settings(max_examples=150, deadline=None)
@given(state=states(water=False), a=st.floats(0.0, 5000.0), b=st.floats(0.0, 5000.0))
def test_air_left_is_right(vehicle, state, a, b):
    """Reaction torque has a handedness that a mirror reverses: compare where the four torques cancel."""
    rpm = np.array([a, a, b, b])
    mirrored = state_derivative(LEFT_RIGHT * state, rpm[[0, 3, 2, 1]], vehicle)
    close(mirrored, LEFT_RIGHT * state_derivative(state, rpm, vehicle))
    mirrored = state_derivative(FRONT_BACK * state, rpm[[2, 1, 0, 3]], vehicle)
    close(mirrored, FRONT_BACK * state_derivative(state, rpm, vehicle))


@VEHICLES
@settings(max_examples=150, deadline=None)
@given(state=st.one_of(states(water=False), states(water=True)), rpm=speeds, shift=vectors(2, 100.0))
def test_no_place_is_special(vehicle, state, rpm, shift):
    moved = state.copy()
    moved[:2] += shift
    np.testing.assert_array_equal(state_derivative(moved, rpm, vehicle), state_derivative(state, rpm, vehicle))
