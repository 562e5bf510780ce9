"""The other planners: what each promises, no more."""

import itertools
import pickle

import gymnasium as gym
import numpy as np
import pytest

from hydrone_gym import HYDRONE, Outcome, Scenario
from hydrone_gym.evaluation import fly
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.world.world import World
from planners.mppi import MPPI
from planners.open_loop_rrt import OpenLoopRRT, clearance
from planners.policy import known
from planners.potential_field import PotentialField
from planners.published import PublishedCLRRT

PLANNERS = (PotentialField, OpenLoopRRT, PublishedCLRRT, MPPI)
EXPERIMENTS = ("HydroneGym/AirToWater-v0", "HydroneGym/WaterToAir-v0")


def scenario(start, goal, obstacles):
    return Scenario(start=(*start, 0.0), goal=goal, obstacles=np.array(obstacles, dtype=float).reshape(-1, 4))


def snapshot(env, steps, policy, seed=0):
    """An observation from the middle of a flight, and the policy's memory there."""
    observation, _ = env.reset(seed=seed)
    state = None
    for k in range(steps):
        action, state = policy.predict(observation, state, np.array([k == 0]))
        observation, *_ = env.step(action)
    return observation, state


@pytest.mark.parametrize("vehicle", ["paper", "physical"])
@pytest.mark.parametrize("env_id", EXPERIMENTS)
@pytest.mark.parametrize("planner", PLANNERS)
def test_reaches_the_goal_smoothly_in_an_empty_world(planner, env_id, vehicle):
    env = gym.make(env_id, num_obstacles=0, vehicle=vehicle)
    flight = fly(env, planner.for_env(env), seed=0)
    assert flight.outcome is Outcome.GOAL
    assert flight.time < 60.0
    for crossing in flight.transitions:
        assert crossing["lateral_speed"] <= 0.1
        assert np.degrees(crossing["tilt"]) <= 2.0


AHEAD = {
    "air": ((-6.0, 0.0, 4.0), (6.0, 0.0, 4.0), [(0.0, 0.0, 4.0, 1.2)]),
    "water": ((-6.0, 0.0, -3.0), (6.0, 0.0, -3.0), [(0.0, 0.0, -3.0, 0.8)]),
    "over the goal": ((-6.0, 0.0, 4.0), (6.0, 0.0, -3.5), [(6.0, 0.0, 0.5, 1.0)]),
    "over the start": ((-6.0, 0.0, -3.5), (6.0, 0.0, 4.0), [(-6.0, 0.0, 0.5, 1.0)]),
}


@pytest.mark.parametrize("place", AHEAD)
@pytest.mark.parametrize("planner", PLANNERS)
def test_flies_round_a_sphere_in_its_way(planner, place):
    env = gym.make("HydroneGym/Mission-v0", num_obstacles=1)
    flight = fly(env, planner.for_env(env), scenario=scenario(*AHEAD[place]))
    assert flight.outcome is Outcome.GOAL
    assert flight.clearance > 0.0


@pytest.mark.parametrize("planner", PLANNERS)
def test_same_seed_same_references(planner):
    env = gym.make(EXPERIMENTS[0])
    first, again = (fly(env, planner.for_env(env), seed=3) for _ in range(2))
    np.testing.assert_array_equal(first.references, again.references)


@pytest.mark.parametrize("planner", [OpenLoopRRT, PublishedCLRRT, MPPI])
def test_another_seed_other_references(planner):
    env = gym.make(EXPERIMENTS[0])
    first, other = (fly(env, planner.for_env(env, seed=seed), seed=3) for seed in (0, 1))
    assert not np.array_equal(first.references[:10], other.references[:10])


@pytest.mark.parametrize("planner", PLANNERS)
def test_predict_never_changes_its_state(planner):
    env = gym.make(EXPERIMENTS[0])
    policy = planner.for_env(env)
    observation, state = snapshot(env, 12, policy, seed=2)
    frozen = pickle.dumps(state)
    first, _ = policy.predict(observation, state)
    second, _ = policy.predict(observation, pickle.loads(frozen))
    np.testing.assert_array_equal(first, second)
    assert pickle.dumps(state) == frozen


@pytest.mark.parametrize("planner", PLANNERS)
def test_batch_equals_single(planner):
    envs = [gym.make(EXPERIMENTS[0]) for _ in range(3)]
    policy = planner.for_env(envs[0])
    pairs = [snapshot(env, 8, policy, seed) for seed, env in enumerate(envs)]
    batch = {key: np.stack([o[key] for o, _ in pairs]) for key in pairs[0][0]}
    together, states = policy.predict(batch, [state[0] for _, state in pairs], np.zeros(3, bool))
    assert together.shape == (3, 4)
    assert together.dtype == np.float32
    assert len(states) == 3
    for k, (observation, state) in enumerate(pairs):
        np.testing.assert_array_equal(policy.predict(observation, state)[0], together[k])


@pytest.mark.parametrize("planner", PLANNERS)
def test_sees_only_what_was_detected(planner):
    """A sphere beyond sensing changes nothing."""
    env = gym.make("HydroneGym/Mission-v0", num_obstacles=1)
    policy = planner.for_env(env)
    actions = []
    for sphere in ((0.0, 0.0, 4.0, 0.8), (0.0, 0.0, -4.0, 0.8)):
        world = scenario((-6.0, 0.0, 4.0), (6.0, 0.0, 4.0), [sphere])
        observation, _ = env.reset(options={"scenario": world})
        actions.append(policy.predict(observation)[0])
    np.testing.assert_array_equal(*actions)


def dense_clearance(path, spheres):
    """Clearance of a path from spheres by points 1 cm apart: nothing in common with the planner's check."""
    points = [a + t * (b - a) for a, b in itertools.pairwise(path) for t in np.linspace(0.0, 1.0, 2000)]
    apart = np.linalg.norm(np.array(points)[:, None] - spheres[None, :, :3], axis=2) - spheres[:, 3]
    return apart.min()


@pytest.mark.parametrize("env_id", EXPERIMENTS)
def test_open_loop_path_is_free_and_keeps_the_rules(env_id):
    env = gym.make(env_id, num_obstacles=40, obstacle_radius=(0.8, 1.5))
    policy = OpenLoopRRT.for_env(env)
    found = 0
    for seed in range(20):
        observation, _ = env.reset(seed=seed)
        spheres = env.unwrapped.scenario.obstacles
        path = policy.plan(known({**observation, "obstacles": spheres}), np.random.default_rng(seed))
        if not len(path):
            continue
        found += 1
        np.testing.assert_array_equal(path[0], observation["state"][:3])
        np.testing.assert_array_equal(path[-1], observation["goal"])
        assert dense_clearance(path, spheres) >= HYDRONE.radius + policy.margin - 1e-9
        crossings = 0
        for a, b in itertools.pairwise(path):
            if (a[2] > 0.0) != (b[2] > 0.0):
                crossings += 1
                np.testing.assert_array_equal(a[:2], b[:2])
            assert min(abs(a[2]), abs(b[2])) > World().zone
        assert crossings == 1
    assert found >= 15


def test_open_loop_path_of_every_cycle_is_free_of_the_known():
    env = gym.make(EXPERIMENTS[0])
    policy = OpenLoopRRT.for_env(env)
    observation, _ = env.reset(seed=5)
    state, done, before = None, False, None
    while not done:
        action, state = policy.predict(observation, state)
        spheres = observation["obstacles"][observation["obstacles"][:, 3] > 0.0]
        path = state[0].path
        if path is not before and len(path) and len(spheres):  # planned in this cycle
            assert dense_clearance(path, spheres) > HYDRONE.radius
        before = path
        observation, _, terminated, truncated, _ = env.step(action)
        done = terminated or truncated


def test_clearance_of_an_edge():
    spheres = np.array([[0.0, 2.0, 0.0, 0.5], [9.0, 0.0, 0.0, 1.0]])
    assert clearance(np.array([-1.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]), spheres) == pytest.approx(1.5)
    assert clearance(np.zeros(3), np.array([7.0, 0.0, 0.0]), spheres) == pytest.approx(1.0)
    assert clearance(np.zeros(3), np.zeros(3), spheres) == pytest.approx(1.5)
    assert clearance(np.zeros(3), np.ones(3), np.zeros((0, 4))) == np.inf


def test_open_loop_holds_still_without_a_path():
    env = gym.make("HydroneGym/Mission-v0")
    observation, _ = env.reset(seed=0)
    state, goal = np.zeros(12), np.array([6.0, 0.0, 4.0])
    state[:3], state[6] = (-6.0, 0.0, 4.0), 1.0
    wall = np.array([(0.0, y, z, 2.0) for y in range(-10, 11, 2) for z in range(-5, 12, 2)])
    action, _ = OpenLoopRRT.for_env(env, samples=100).predict(
        {**observation, "state": state, "goal": goal, "obstacles": wall}
    )
    np.testing.assert_allclose(action[:3], [-5.8, 0.0, 4.0], atol=1e-6)


def test_potential_field_stays_in_a_local_minimum():
    """What its description admits: before a wall of spheres it waits until time is out, and touches nothing."""
    wall = [(0.0, y, z, 1.5) for y in (-4, -2, 0, 2, 4) for z in (2, 4, 6)]
    env = gym.make("HydroneGym/Mission-v0", num_obstacles=len(wall), time_limit=40.0)
    flight = fly(env, PotentialField.for_env(env), scenario=scenario((-8, 0, 4), (7.0, 0.0, 4.0), wall))
    assert flight.outcome is Outcome.TIMEOUT
    assert flight.clearance > 0.0


@pytest.mark.parametrize("env_id", EXPERIMENTS)
@pytest.mark.parametrize("planner", PLANNERS)
def test_most_random_worlds(planner, env_id):
    """A floor under what the comparison of planners reports."""
    env = gym.make(env_id)
    policy = planner.for_env(env)
    outcomes = [fly(env, policy, seed=seed).outcome for seed in range(1000, 1008)]
    assert outcomes.count(Outcome.GOAL) >= 6


@pytest.mark.parametrize(
    ("planner", "options", "message"),
    [
        (PotentialField, {"influence": 0.0}, r"influence must be positive \(m\), got 0.0"),
        (PotentialField, {"gain": float("nan")}, r"gain must be positive \(m\^3\), got nan"),
        (OpenLoopRRT, {"samples": 0}, "samples must be a whole number of at least 1, got 0"),
        (OpenLoopRRT, {"margin": -0.1}, r"margin must be finite and not negative \(m\), got -0.1"),
        (OpenLoopRRT, {"lead": 0.3}, "lead must be more than 0.5 m, got 0.3"),
        (OpenLoopRRT, {"seed": 1.5}, "seed must be a whole number of at least 0, got 1.5"),
        (PublishedCLRRT, {"iterations": True}, "iterations must be a whole number of at least 1, got True"),
        (PublishedCLRRT, {"seed": -1}, "seed must be a whole number of at least 0, got -1"),
        (MPPI, {"samples": 8}, "samples must be a whole number of at least 16, got 8"),
        (MPPI, {"horizon": 1}, "horizon must be a whole number of at least 2, got 1"),
    ],
)
def test_bad_options(planner, options, message):
    with pytest.raises(ValueError, match=message):
        planner(Simulation(HYDRONE, World()), **options)


@pytest.mark.parametrize("planner", PLANNERS)
def test_bad_input(planner):
    env = gym.make(EXPERIMENTS[0])
    policy = planner.for_env(env)
    observation, _ = env.reset(seed=0)
    with pytest.raises(ValueError, match=r"observation\['goal'\] must be finite"):
        policy.predict({**observation, "goal": np.full(3, np.nan)})
    with pytest.raises(ValueError, match="observation lacks obstacles"):
        policy.predict({key: value for key, value in observation.items() if key != "obstacles"})
    with pytest.raises(TypeError, match="for_env needs a HyDrone environment"):
        planner.for_env(object())
    with pytest.raises(TypeError, match="unknown"):
        planner.for_env(env, unknown=1)
