"""Gymnasium's and Stable-Baselines3's rules: checkers, spaces, fresh memory, vectorisation, registration."""

import json
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_sb3
from stable_baselines3.common.vec_env import DummyVecEnv

from hydrone_gym.envs.task import settle
from tests.envs.missions import IDS, VEHICLES, make

WORLD_ACTIONS = "symmetric and normalized"  # references are metres in the world, on purpose


@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("name", IDS)
def test_gymnasium_check_env(name, vehicle):
    env = gym.make(name, vehicle=vehicle).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=f".*{WORLD_ACTIONS}")
        check_env(env)


@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("name", IDS)
def test_sb3_check_env(name, vehicle):
    env = gym.make(name, vehicle=vehicle).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=f".*{WORLD_ACTIONS}")
        # SB3 says this of every two-dimensional Box; its MultiInputPolicy flattens the list of spheres.
        warnings.filterwarnings("ignore", message="Your observation obstacles has an unconventional shape")
        check_env_sb3(env)


@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("name", IDS)
def test_egocentric_interface_passes_both_checkers_without_a_warning(name, vehicle):
    env = gym.make(name, vehicle=vehicle, interface="egocentric").unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env)
        check_env_sb3(env)


def test_no_obstacles_at_all():
    env = make(num_obstacles=0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=f".*{WORLD_ACTIONS}")
        check_env(env)
    observation, info = env.reset(seed=4)
    assert observation["obstacles"].shape == (0, 4)
    assert info["clearance"] == np.inf


@pytest.mark.parametrize(
    ("vehicle", "options"),
    [("paper", {}), ("physical", {}), ("paper", {"vertical_mode": False, "rough_transition": "count", "period": 0.25})],
)
def test_every_observation_is_new_and_inside_its_space(vehicle, options):
    env = make(vehicle=vehicle, **options)
    spaces = env.observation_space.spaces
    rng = np.random.default_rng(1)
    observation, _ = env.reset(seed=2)
    # a reference is flown to for a while, so that flights get far and fast
    for _ in range(34_000 // 4):
        action = rng.uniform(env.action_space.low, env.action_space.high).astype(np.float32)
        for _ in range(4):
            last = observation
            observation, reward, terminated, truncated, _ = env.step(action)
            for key, array in observation.items():
                box = spaces[key]
                assert array.shape == box.shape
                assert array.dtype == np.float64
                assert (array >= box.low).all(), (key, array)
                assert (array <= box.high).all(), (key, array)
                assert not np.shares_memory(array, last[key])
            assert np.isfinite(reward)
            if terminated or truncated:
                observation, _ = env.reset()
    assert env.observation_space.contains(observation)


def test_observation_shares_no_memory_with_the_environment():
    env = make("AirToWater")
    observation, _ = env.reset(seed=0)
    before = {key: array.copy() for key, array in observation.items()}
    for array in observation.values():
        array[...] = 1e9
    repeated, _ = make("AirToWater").reset(seed=0)
    for key, array in env._core.observation_of(0).items():
        np.testing.assert_array_equal(array, before[key])
        np.testing.assert_array_equal(array, repeated[key])


@pytest.mark.parametrize("name", IDS)
def test_registered_without_a_step_limit_and_with_plain_options(name):
    spec = gym.make(name, vehicle="physical", num_obstacles=3).spec
    assert spec.max_episode_steps is None
    assert json.loads(spec.to_json())["kwargs"]["vehicle"] == "physical"
    again = gym.make(gym.envs.registration.EnvSpec.from_json(spec.to_json()))
    assert again.unwrapped.options.num_obstacles == 3


def test_vectorises():
    sync = gym.make_vec(IDS[2], num_envs=2, vectorization_mode="sync")
    sync.reset(seed=1)
    observations, rewards, *_, infos = sync.step(sync.action_space.sample())
    assert observations["obstacles"].shape == (2, 20, 4)
    assert infos["reward_terms"]["progress"].shape == rewards.shape == (2,)
    dummy = DummyVecEnv([lambda: gym.make(IDS[0])] * 2)
    assert dummy.reset()["state"].shape == (2, 12)


def test_one_compiled_version():
    """Shapes and the number of obstacles must not compile the task again; a second version costs seconds."""
    for options in ({}, {"num_obstacles": 0}, {"num_obstacles": 1, "sensor_range": 100}):
        env = make(**options)
        env.reset(seed=0)
        env.step(env.action_space.low)
    assert len(settle.signatures) == 1
