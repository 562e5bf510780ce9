"""The Stable-Baselines3 bridge: its conventions, its wrappers, and a short training run."""

import gymnasium as gym
import numpy as np
import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from agents.vec_env import HydroneVecEnv, MissionMix
from hydrone_gym import Outcome
from hydrone_gym.weather.weather import LEVELS

ID = "HydroneGym/Mission-v0"


def random_actions(rng, count):
    return rng.uniform(-1.0, 1.0, (count, 3)).astype(np.float32)


def test_rows_are_single_environments():
    """Row i, seeded with seed + i, earns what the single environment earns and ends where it ends."""
    rows = HydroneVecEnv(ID, 5)
    rows.seed(11)
    observation = rows.reset()
    singles = [gym.make(ID, interface="egocentric") for _ in range(5)]
    for k, env in enumerate(singles):
        np.testing.assert_array_equal(env.reset(seed=11 + k)[0], observation[k])
    rng, ended, earned = np.random.default_rng(0), 0, np.zeros(5)
    for _ in range(150):
        actions = random_actions(rng, 5)
        observation, rewards, done, infos = rows.step(actions)
        for k, env in enumerate(singles):
            last, reward, terminated, truncated, info = env.step(actions[k])
            earned[k] += reward
            assert rewards[k] == np.float32(reward)
            assert done[k] == (terminated or truncated)
            if not done[k]:
                assert infos[k] == {}
                continue
            ended += 1
            np.testing.assert_array_equal(infos[k]["terminal_observation"], last)
            assert infos[k]["TimeLimit.truncated"] == truncated
            assert infos[k]["is_success"] == info["is_success"]
            assert infos[k]["outcome"] == info["outcome"]
            assert infos[k]["episode"]["r"] == pytest.approx(earned[k])
            earned[k] = 0.0
            np.testing.assert_array_equal(env.reset()[0], observation[k])
    assert ended > 3


def test_rows_of_a_mission_share_kinds_of_weather():
    """Parts of a mission fly a kind each; a row is the single environment in that weather, seeded as ever."""
    rows = MissionMix({ID: 5, "HydroneGym/AirToWater-v0": 2}, {"weather": [0, 3], "controller": "robust"})
    assert [(part.num_envs, part.options.the_weather) for part in rows.parts] == [
        (2, LEVELS[0]),
        (3, LEVELS[3]),
        (1, LEVELS[0]),
        (1, LEVELS[3]),
    ]
    assert {part.options.controller for part in rows.parts} == {"robust"}
    rows.seed(11)
    rows.reset()
    env = gym.make(ID, interface="egocentric", weather=3, controller="robust")
    env.reset(seed=11 + 4)
    rng = np.random.default_rng(0)
    for _ in range(6):
        actions = random_actions(rng, 7)
        np.testing.assert_array_equal(rows.step(actions)[0][4], env.step(actions[4])[0])


@pytest.mark.parametrize("weather", [[], [0, 1, 2]])
def test_every_kind_of_weather_needs_a_row(weather):
    with pytest.raises(
        ValueError, match=f"weather lists {len(weather)} kinds for 2 rows of {ID}: each kind needs a row"
    ):
        MissionMix({ID: 2}, {"weather": weather})


def test_a_time_out_is_a_truncation():
    rows = HydroneVecEnv(ID, 3, time_limit=2.0)
    rows.seed(0)
    rows.reset()
    for _ in range(4):
        _, _, done, infos = rows.step(np.zeros((3, 3), np.float32))
    assert done.all()
    assert all(info["TimeLimit.truncated"] and info["outcome"] == Outcome.TIMEOUT for info in infos)
    assert [info["episode"]["l"] for info in infos] == [4, 4, 4]


def test_wrappers_of_stable_baselines():
    rows = VecNormalize(VecMonitor(HydroneVecEnv(ID, 8)), norm_obs=True)
    rows.seed(1)
    observation = rows.reset()
    rng, ended = np.random.default_rng(0), 0
    for _ in range(60):
        observation, rewards, _, infos = rows.step(random_actions(rng, 8))
        assert np.isfinite(observation).all()
        assert np.isfinite(rewards).all()
        ended += sum("episode" in info for info in infos)
    assert ended > 0


def weights_after_training(seed):
    torch.set_num_threads(1)
    rows = HydroneVecEnv(ID, 64)
    model = PPO("MlpPolicy", rows, n_steps=16, batch_size=512, n_epochs=2, seed=seed, device="cpu")
    model.learn(4096)
    assert len(model.ep_info_buffer) > 0
    return torch.cat([value.flatten() for value in model.policy.state_dict().values()]).numpy()


def test_training_repeats_bit_for_bit():
    first = weights_after_training(3)
    np.testing.assert_array_equal(first, weights_after_training(3))
    assert not np.array_equal(first, weights_after_training(4))


def test_bad_input():
    with pytest.raises(TypeError, match="no_such_option"):
        HydroneVecEnv(ID, 2, no_such_option=1)
    with pytest.raises(ValueError, match="num_envs must be a whole number of at least 1, got 0"):
        HydroneVecEnv(ID, 0)
    rows = HydroneVecEnv(ID, 2)
    rows.reset()
    with pytest.raises(ValueError, match=r"actions must have shape \(2, 3\)"):
        rows.step(np.zeros((3, 3), np.float32))
    with pytest.raises(ValueError, match=r"rows \[1\] are not"):
        rows.step(np.array([[0, 0, 0], [0, np.nan, 0]], np.float32))
    with pytest.raises(AttributeError, match="fixed when it is made"):
        rows.set_attr("period", 1.0)
