"""The robust law in an instant: mixing against the wrench of the rotors, profile, observer, symmetries."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hydrone_gym._jit import kernel
from hydrone_gym.control import robust
from hydrone_gym.control.mixing import mix_air, mix_water
from hydrone_gym.physics.parameters import vehicle_params
from hydrone_gym.physics.rotors import rotor_thrusts, rotor_wrench
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL
from hydrone_gym.world.world import World
from tests.control.instant import rotor_speeds, state_at
from tests.simulation.batches import play, random_references, random_rows
from tests.simulation.closed_loop import step_once

VEHICLES = pytest.mark.parametrize("vehicle", [HYDRONE, HYDRONE_PHYSICAL], ids=lambda vehicle: vehicle.name)
OPEN = World(lower=(-1e3, -1e3, -1e3), upper=(1e3, 1e3, 1e3), rough_transition="count")


@kernel
def profile(distance, gain, braking):
    return robust.profile(distance, gain, braking)


@kernel
def _wrench(air, speeds, vehicle, out):
    four = speeds[0], speeds[1], speeds[2], speeds[3]
    wrench = rotor_wrench(vehicle, air, rotor_thrusts(vehicle.air if air else vehicle.water, four))
    for i, value in enumerate(wrench):
        out[i] = value


@kernel
def _mix(air, first, second, third, yaw, vehicle, out):
    if air:
        speeds = mix_air(first, second, third, yaw, vehicle, vehicle.air)
    else:
        speeds = mix_water(first, second, third, yaw, vehicle, vehicle.water)
    for i in range(4):
        out[i] = speeds[i]


def wrench(vehicle, air, speeds):
    """The wrench of the rotors at four speeds (rpm): fx, fz in N, mx, my, mz in N m."""
    out = np.empty(5)
    _wrench(air, speeds, vehicle_params(vehicle), out)
    return out


def mixed(air, first, second, third, yaw, vehicle):
    """Rotor speeds (rpm), and the wrench they make."""
    speeds = np.empty(4)
    _mix(air, float(first), float(second), float(third), float(yaw), vehicle_params(vehicle), speeds)
    return speeds, wrench(vehicle, air, speeds)


def limits(vehicle, air):
    """Greatest thrust of a rotor (N) and moment of two about the centre (N m)."""
    medium = vehicle_params(vehicle).air if air else vehicle_params(vehicle).water
    most = medium.thrust * medium.rotor_max**2
    return most, vehicle.arm * most


shares = st.floats(-1.0, 1.0)


@VEHICLES
@settings(max_examples=200, deadline=None)
@given(height=st.floats(0.0, 1.0), roll=shares, pitch=shares, yaw=shares)
def test_air_gives_what_the_rotors_have_room_for(vehicle, height, roll, pitch, yaw):
    """Any lift that leaves room for roll and pitch, and any yaw that leaves room for all three, is given exactly."""
    most, moment = limits(vehicle, air=True)
    roll, pitch = roll * moment, pitch * moment
    uneven = max(abs(roll), abs(pitch)) / (2.0 * vehicle.arm)
    each = uneven + height * (most - 2.0 * uneven)
    yaw *= 4.0 * vehicle.yaw_arm_air * (min(each, most - each) - uneven)
    speeds, wrench = mixed(True, 4.0 * each, roll, pitch, yaw, vehicle)
    np.testing.assert_allclose(wrench, [0.0, 4.0 * each, roll, pitch, yaw], rtol=1e-9, atol=1e-9 * most)
    assert 0.0 <= speeds.min() <= speeds.max() <= vehicle.rotor_limit_air


@VEHICLES
@settings(max_examples=300, deadline=None)
@given(lift=st.floats(-3.0, 3.0), roll=st.floats(-3.0, 3.0), pitch=st.floats(-3.0, 3.0), yaw=st.floats(-9.0, 9.0))
def test_air_gives_up_yaw_before_lift_and_lift_before_roll_and_pitch(vehicle, lift, roll, pitch, yaw):
    most, moment = limits(vehicle, air=True)
    lift, roll, pitch, yaw = 4.0 * lift * most, roll * moment, pitch * moment, yaw * vehicle.yaw_arm_air
    speeds, (_, up, mx, my, mz) = mixed(True, lift, roll, pitch, yaw, vehicle)
    assert 0.0 <= speeds.min() <= speeds.max() <= vehicle.rotor_limit_air
    tight = {"rel": 1e-9, "abs": 1e-9 * most}
    assert mx == pytest.approx(np.clip(roll, -moment, moment), **tight)
    assert my == pytest.approx(np.clip(pitch, -moment, moment), **tight)
    uneven = max(abs(mx), abs(my)) / (2.0 * vehicle.arm)
    assert up == pytest.approx(np.clip(lift, 4.0 * uneven, 4.0 * (most - uneven)), **tight)
    room = 4.0 * vehicle.yaw_arm_air * max(min(up / 4.0, most - up / 4.0) - uneven, 0.0)
    assert mz == pytest.approx(np.clip(yaw, -room, room), rel=1e-6, abs=1e-8 * most)


@VEHICLES
@settings(max_examples=300, deadline=None)
@given(lift=st.floats(-4.0, 4.0), pitch=st.floats(-2.0, 2.0), push=st.floats(-4.0, 4.0), yaw=st.floats(-3.0, 3.0))
def test_water_gives_up_surge_before_heading_and_depth_before_level(vehicle, lift, pitch, push, yaw):
    most, moment = limits(vehicle, air=False)
    lift, pitch, push, yaw = lift * most, pitch * moment, push * most, yaw * 2.0 * moment
    speeds, (ahead, up, _, my, mz) = mixed(False, lift, pitch, push, yaw, vehicle)
    assert np.abs(speeds).max() <= vehicle.rotor_limit_water
    tight = {"rel": 1e-9, "abs": 1e-9 * most}
    assert mz == pytest.approx(np.clip(yaw, -2.0 * moment, 2.0 * moment), **tight)
    assert my == pytest.approx(np.clip(pitch, -0.6 * moment, 0.6 * moment), **tight)
    room = 2.0 * most - abs(mz) / vehicle.arm
    assert ahead == pytest.approx(np.clip(push, -room, room), **tight)
    room = 2.0 * most - abs(my) / vehicle.arm
    assert up == pytest.approx(np.clip(lift, -room, room), **tight)


@settings(max_examples=100, deadline=None)
@given(distance=st.floats(0.0, 30.0), gain=st.floats(0.5, 5.0), braking=st.floats(0.5, 10.0))
def test_who_follows_the_profile_comes_to_rest_at_the_end(distance, gain, braking):
    """Heun's method in steps that are short beside 1 / gain; the deceleration is the given one, or less nearby."""
    left, dt, seconds = distance, 0.02 / gain, 0.0
    while left > 1e-3 * max(distance, 1e-9) and seconds < 100.0:
        speed, slope = profile(left, gain, braking)
        assert 0.0 <= slope * speed <= braking * (1.0 + 1e-12)
        ahead, _ = profile(max(left - dt * speed, 0.0), gain, braking)
        left, seconds = left - 0.5 * dt * (speed + ahead), seconds + dt
        assert left >= 0.0
    assert seconds < np.sqrt(2.0 * distance / braking) + 9.0 / gain
    assert profile(0.0, gain, braking) == (0.0, gain)


@settings(max_examples=100, deadline=None)
@given(gain=st.floats(0.5, 5.0), braking=st.floats(0.5, 10.0), share=st.floats(0.01, 5.0))
def test_profile_is_continuous_with_a_continuous_slope(gain, braking, share):
    near = braking / gain**2
    below, above = profile(near * (1.0 - 1e-9), gain, braking), profile(near * (1.0 + 1e-9), gain, braking)
    np.testing.assert_allclose(below, above, rtol=1e-8)
    at, step = share * near, 1e-6 * near
    rise = (profile(at + step, gain, braking)[0] - profile(at - step, gain, braking)[0]) / (2.0 * step)
    assert profile(at, gain, braking)[1] == pytest.approx(rise, rel=1e-5)


MOVING = [6, 7, 8, 11]  # of a state: velocity and yaw rate


@VEHICLES
@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), periods=st.integers(1, 12))
def test_in_still_weather_the_observer_sees_nothing_bit_for_bit(vehicle, seed, periods):
    """What it predicted is what came, whatever is asked for and in both media; at a crossing its memory is empty."""
    rng = np.random.default_rng(seed)
    rows = random_rows(rng, 16, World())
    references = [random_references(rng, 16, World()) for _ in range(periods)]
    rows, _ = play(Simulation(vehicle, OPEN, lanes=16, law="robust"), rows, references)
    empty = (rows["integral"] == 0.0).all(axis=1)
    np.testing.assert_array_equal(rows["integral"][~empty], rows["state"][~empty][:, MOVING])
    assert empty.sum() <= 2


@VEHICLES
@pytest.mark.parametrize("height", [5.0, -3.0])
def test_an_empty_memory_tells_of_no_disturbance(vehicle, height):
    """At speed, as if the memory had been right; and one that is wrong does tell."""
    state = state_at(height, velocity=(0.7, -0.4, 0.2), rates=(0.1, 0.2, 0.3))
    empty, _ = rotor_speeds(vehicle, state, (1, 1, height, 0), law="robust")
    right, _ = rotor_speeds(vehicle, state, (1, 1, height, 0), law="robust", integral=state[MOVING])
    wrong, _ = rotor_speeds(vehicle, state, (1, 1, height, 0), law="robust", integral=state[MOVING] + 0.1)
    np.testing.assert_array_equal(empty, right)
    assert np.abs(wrong - right).max() > 10.0


@pytest.mark.parametrize("height", [5.0, -3.0])
def test_the_disturbance_is_the_error_over_the_time_constant(height):
    """What is left of it in the memory after an instant, from the nominal velocity then."""
    state = state_at(height)
    error = np.array([0.03, -0.02, 0.05, 0.04])
    speeds, memory = rotor_speeds(HYDRONE, state, (0, 0, height, 0), law="robust", integral=-error)
    after = state.copy()
    step_once(vehicle_params(HYDRONE), after, speeds, height > 0.0, 0.01)
    left = (after[MOVING] - memory) / (1.0 - 0.01 / HYDRONE.robust_gains.observer_time)
    np.testing.assert_allclose(left, error, rtol=1e-9)


@VEHICLES
@pytest.mark.parametrize("height", [5.0, -3.0])
def test_holds_still_at_the_reference(vehicle, height):
    speeds, memory = rotor_speeds(vehicle, state_at(height, angles=(0, 0, 2.0)), (0, 0, height, 2.0), law="robust")
    neutral = [vehicle.hover_speed] * 4 if height > 0.0 else [vehicle.neutral_speed, 0.0] * 2
    np.testing.assert_allclose(speeds, neutral, rtol=1e-12)
    np.testing.assert_allclose(memory, 0.0, atol=1e-13)


def scene_of(seed):
    """A state, a memory near it, a reference and its velocity: nothing exactly abeam, where the law turns one way."""
    rng = np.random.default_rng(seed)
    height, near = rng.choice([1.0, -1.0]) * rng.uniform(0.05, 4.0), rng.uniform
    angles = (*near(-0.4, 0.4, 2), near(-3.0, 3.0))
    state = state_at(height, angles=angles, velocity=near(-2.0, 2.0, 3), rates=near(-1.0, 1.0, 3))
    reference = np.array([*near(-6.0, 6.0, 2), height + near(-3.0, 3.0), near(-3.0, 3.0)])
    return state, state[MOVING] + near(-0.3, 0.3, 4), reference, near(-2.0, 2.0, 3)


scenes = st.integers(0, 2**32 - 1).map(scene_of)


def wrench_of(scene, vertical):
    """What the rotors are asked for, as a wrench: a mirror swaps rotors, and reverses the torque of each."""
    state, memory, reference, velocity = scene
    speeds, _ = rotor_speeds(
        HYDRONE, state, reference, velocity=velocity, vertical=vertical, integral=memory, law="robust"
    )
    return wrench(HYDRONE, bool(state[2] > 0.0), speeds), speeds


@settings(max_examples=300, deadline=None)
@given(scene=scenes, turn=st.floats(-3.0, 3.0), vertical=st.booleans())
def test_no_heading_is_special(scene, turn, vertical):
    state, memory, reference, velocity = (values.copy() for values in scene)
    matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    for values in (state[:2], state[6:8], memory[:2], reference[:2], velocity[:2]):
        values[:] = matrix @ values
    for angle in (state[5:6], reference[3:4]):
        angle[:] = (angle + turn + np.pi) % (2.0 * np.pi) - np.pi
    _, speeds = wrench_of(scene, vertical)
    _, turned = wrench_of((state, memory, reference, velocity), vertical)
    np.testing.assert_allclose(turned, speeds, rtol=1e-6, atol=1e-3)


@settings(max_examples=300, deadline=None)
@given(scene=scenes, vertical=st.booleans())
def test_left_is_right(scene, vertical):
    state, memory, reference, velocity = scene
    mirrored = (
        state * [1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1],
        memory * [1, -1, 1, -1],
        reference * [1, -1, 1, -1],
        velocity * [1, -1, 1],
    )
    expected = wrench_of(scene, vertical)[0] * [1, 1, -1, 1, -1]
    np.testing.assert_allclose(wrench_of(mirrored, vertical)[0], expected, rtol=1e-6, atol=1e-6)
