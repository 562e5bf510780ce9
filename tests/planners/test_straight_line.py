"""The straight line: what an empty world asks for, and nothing more."""

import gymnasium as gym
import numpy as np
import pytest

from hydrone_gym.evaluation import fly
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.time_to_go import GATE
from hydrone_gym.world.scenario import Scenario
from planners import StraightLine
from planners.straight_line import BRAKING, SWIM_LEAD

EXPERIMENTS = ("HydroneGym/AirToWater-v0", "HydroneGym/WaterToAir-v0")


def observation(position, goal, obstacles=((0.0, 0.0, 0.0, 0.0),)):
    state = np.zeros(12)
    state[:3] = position
    return {
        "state": state,
        "integral": np.zeros(4),
        "reference": np.array([*position, 0.3]),
        "goal": np.array(goal, dtype=float),
        "obstacles": np.array(obstacles),
    }


def assert_smooth(flight):
    for crossing in flight.transitions:
        assert crossing["lateral_speed"] <= 0.1
        assert np.degrees(crossing["tilt"]) <= 2.0


@pytest.mark.parametrize("vehicle", ["paper", "physical"])
@pytest.mark.parametrize("env_id", EXPERIMENTS)
def test_both_experiments_in_an_empty_world(env_id, vehicle):
    env = gym.make(env_id, num_obstacles=0, vehicle=vehicle)
    flight = fly(env, StraightLine.for_env(env), seed=0)
    assert flight.outcome is Outcome.GOAL
    assert flight.time < 22.5
    assert len(flight.transitions) == 1
    assert_smooth(flight)


@pytest.mark.parametrize("env_id", EXPERIMENTS)
def test_crossings_are_smooth_without_vertical_mode_too(env_id):
    env = gym.make(env_id, num_obstacles=0, vertical_mode=False)
    flight = fly(env, StraightLine.for_env(env), seed=0)
    assert flight.outcome is Outcome.GOAL
    assert len(flight.transitions) == 1
    assert_smooth(flight)


def test_any_ends_in_an_empty_world():
    rng = np.random.default_rng(7)
    for number in range(60):
        env = gym.make("HydroneGym/Mission-v0", num_obstacles=0, vehicle=("paper", "physical")[number % 2])
        flight = fly(env, StraightLine.for_env(env), seed=int(rng.integers(1 << 30)))
        start, goal = flight.scenario.media
        assert flight.outcome is Outcome.GOAL, flight.scenario
        assert len(flight.transitions) == (start != goal), flight.scenario
        assert_smooth(flight)


@pytest.mark.parametrize(("z", "goal_z"), [(0.81, -0.81), (-0.81, 0.81), (0.81, -4.5), (-4.5, 0.81)])
def test_ends_just_outside_the_transition_zone(z, goal_z):
    env = gym.make("HydroneGym/Mission-v0", num_obstacles=0)
    scenario = Scenario(start=(0.0, 0.0, z, 1.0), goal=(4.0, 3.0, goal_z), obstacles=())
    flight = fly(env, StraightLine.for_env(env), scenario=scenario)
    assert flight.outcome is Outcome.GOAL
    assert_smooth(flight)


def test_the_leg_in_air_is_straight():
    env = gym.make(EXPERIMENTS[0], num_obstacles=0)
    flight = fly(env, StraightLine.for_env(env), seed=0)
    start, gate = np.array(flight.scenario.start[:3]), np.array([*flight.scenario.goal[:2], GATE])
    along = (gate - start) / np.linalg.norm(gate - start)
    offset = flight.trace.states[:, :3] - start
    aside = np.linalg.norm(offset - np.outer(offset @ along, along), axis=1)
    leg = offset @ along < np.linalg.norm(gate - start) - BRAKING
    assert leg.sum() > 100
    assert aside[leg].max() < 0.65  # over 26 m: it is slow to gain speed sideways, quick to sink
    # it neither overshoots the column nor cuts the corner
    dive = flight.trace.states[flight.trace.states[:, 2] < GATE - 0.2]
    assert np.abs(dive[:, :2] - gate[:2]).max() < 0.25


def test_references_never_run_away():
    env = gym.make("HydroneGym/Mission-v0", num_obstacles=0)
    for seed in range(10):
        flight = fly(env, StraightLine.for_env(env), seed=seed)
        ahead = np.linalg.norm(flight.references[:, :3] - flight.states[:-1, :3], axis=1)
        wet = flight.states[:-1, 2] <= 0.0
        vertical = np.linalg.norm(flight.references[:, :2] - flight.states[:-1, :2], axis=1) < 0.5
        assert ahead[~vertical].max(initial=0.0) <= BRAKING + 1e-6
        assert ahead[wet & ~vertical].max(initial=0.0) <= SWIM_LEAD + 1e-6


def test_references_by_hand():
    env = gym.make(EXPERIMENTS[0], num_obstacles=1)
    policy = StraightLine.for_env(env)
    level, _ = policy.predict(observation((-5.0, 0.0, 4.0), (5.0, 0.0, 4.0)))
    np.testing.assert_allclose(level, [-4.0, 0.0, 4.0, 0.3], atol=1e-6)  # 2 m/s for 0.5 s
    climb, _ = policy.predict(observation((0.0, 0.0, 2.0), (0.0, 0.0, 9.0)))
    np.testing.assert_allclose(climb, [0.0, 0.0, 2.75, 0.3], atol=1e-6)  # 1.5 m/s for 0.5 s
    rise, _ = policy.predict(observation((1.0, 2.0, -3.0), (5.0, 0.0, 4.0)))
    np.testing.assert_allclose(rise, [1.0, 2.0, GATE, 0.0], atol=1e-6)
    swim, _ = policy.predict(observation((0.0, 0.0, -3.0), (0.0, 8.0, -3.0)))
    np.testing.assert_allclose(swim, [0.0, SWIM_LEAD, -3.0, 0.0], atol=1e-6)


def test_a_dive_waits_for_the_column_and_for_rest():
    policy = StraightLine.for_env(gym.make(EXPERIMENTS[0], num_obstacles=1))
    gate, below = [5.0, 0.0, GATE, 0.3], [5.0, 0.0, -GATE, 0.3]
    over = observation((5.0, 0.1, GATE), (5.0, 0.0, -3.0))
    np.testing.assert_allclose(policy.predict(over)[0], below, atol=1e-6)
    aside = observation((5.0, 0.5, GATE), (5.0, 0.0, -3.0))
    np.testing.assert_allclose(policy.predict(aside)[0], gate, atol=1e-6)
    over["state"][6] = 0.2  # m/s
    np.testing.assert_allclose(policy.predict(over)[0], gate, atol=1e-6)


def test_obstacles_change_nothing():
    env = gym.make(EXPERIMENTS[0])
    policy = StraightLine.for_env(env)
    free, _ = policy.predict(observation((-5.0, 0.0, 4.0), (5.0, 0.0, 4.0)))
    blocked, _ = policy.predict(observation((-5.0, 0.0, 4.0), (5.0, 0.0, 4.0), [(-3.0, 0.0, 4.0, 1.0)]))
    np.testing.assert_array_equal(free, blocked)


def test_needs_a_hydrone_environment():
    with pytest.raises(TypeError, match="for_env needs a HyDrone environment"):
        StraightLine.for_env(gym.make("CartPole-v1"))
