"""Kernels read numbers one after the other: whatever order and precision callers hand over, the numbers are theirs."""

import gymnasium as gym
import numpy as np
import pytest
from numba.core.errors import TypingError

import hydrone_gym  # noqa: F401
from hydrone_gym.simulation.rollout import Flock, Rollout
from hydrone_gym.simulation.simulation import Simulation, row_at, trajectory
from hydrone_gym.simulation.storage import LANES
from hydrone_gym.vehicle import HYDRONE
from hydrone_gym.world.world import World
from planners import CLRRT, Shield
from tests.test_memory import look

LAYOUTS = pytest.mark.parametrize("lay", [np.asfortranarray, lambda a: np.float32(a).T.copy().T, lambda a: a[::1, ::1]])
HERE = np.array([0.0, 0.0, 5.0, *np.zeros(9)])


def exact(shape, seed=0, spread=1.0):
    """Random numbers that single precision holds exactly."""
    return np.round(np.random.default_rng(seed).normal(0.0, spread, shape) * 64.0) / 64.0


def rows_env(count=3, **options):
    return gym.make_vec("HydroneGym/Mission-v0", num_envs=count, vectorization_mode="vector_entry_point", **options)


@LAYOUTS
def test_actions_and_filtered_references(lay):
    plain, other, filtered = rows_env(), rows_env(), rows_env()
    filtered.unwrapped.filter_references(lambda perceived, references, starting: lay(references))
    observations = [env.reset(seed=3)[0] for env in (plain, other, filtered)]
    for k in range(6):
        actions = np.float64(np.float32(observations[0]["reference"] + exact((3, 4), k)))
        actions[:, 3] = 0.5
        for i, (env, given) in enumerate([(plain, actions), (other, lay(actions)), (filtered, actions)]):
            observations[i] = env.step(given)[0]
        for seen in observations[1:]:
            np.testing.assert_array_equal(seen["state"], observations[0]["state"])


def test_a_filter_that_returns_nonsense_is_refused():
    env = rows_env()
    env.unwrapped.filter_references(lambda perceived, references, starting: references * np.nan)
    observation, _ = env.reset(seed=0)
    with pytest.raises(ValueError, match="must be finite"):
        env.step(observation["reference"])


@LAYOUTS
def test_planners_and_shield(lay):
    env = rows_env()
    observation, _ = env.reset(seed=5)
    other = {key: np.asfortranarray(value) for key, value in observation.items()}
    planner, shield = CLRRT.for_env(env), Shield.for_env(None, env)
    np.testing.assert_array_equal(planner.predict(other)[0], planner.predict(observation)[0])
    proposed, held = np.float64(np.float32(observation["reference"])) + exact((3, 4), 1), observation["reference"]
    held = np.float64(np.float32(held))
    for ours, plain in zip(shield.check(other, lay(proposed), lay(held)), shield.check(observation, proposed, held)):
        np.testing.assert_array_equal(ours, plain)


@LAYOUTS
def test_simulations_and_rollouts(lay):
    one, many = Simulation(HYDRONE, World()), Simulation(HYDRONE, World(), lanes=LANES)
    references, spheres = HERE[[0, 1, 2, 5]] + exact((20, 4), 2), exact((5, 4), 3, 4.0) + [0, 0, 5, 6]
    played = [trajectory(one, row_at(HERE), given)[1] for given in (references, lay(references))]
    np.testing.assert_array_equal(*played)
    flocks = [Flock(many, row_at(HERE), 20, given) for given in (spheres, lay(spheres))]
    for flock, given in zip(flocks, (references, lay(references)), strict=True):
        flock.fly(given)
    assert flocks[0].rows.tobytes() == flocks[1].rows.tobytes()
    rows = [row_at(HERE), row_at(HERE)]
    flown = [
        Rollout(one, s).fly(row, r[4])
        for row, s, r in zip(rows, (spheres, lay(spheres)), (references, lay(references)))
    ]
    assert flown[0] == flown[1]


def test_kernels_refuse_what_they_would_misread():
    with pytest.raises(TypingError):
        look(np.zeros(20, np.float32), 3)
    with pytest.raises(TypingError):
        look(np.zeros(40)[::2], 3)


def test_rollouts_need_as_many_lanes_as_they_fly():
    with pytest.raises(ValueError, match="the simulation must have 1 lanes, got 16"):
        Rollout(Simulation(HYDRONE, World(), lanes=16), np.zeros((0, 4)))
    with pytest.raises(ValueError, match="the simulation must have 16 lanes, got 1"):
        Flock(Simulation(HYDRONE, World()), row_at(HERE), 3, np.zeros((0, 4)))
