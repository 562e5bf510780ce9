"""The shield in the training loop is the shield around a policy."""

import gymnasium as gym
import numpy as np

from agents.recipe import load_recipe
from agents.vec_env import INTERVENTION, HydroneVecEnv
from hydrone_gym import Outcome
from hydrone_gym.evaluation import MISSIONS
from hydrone_gym.perception.egocentric import Egocentric
from planners.shield import Shield

ID = MISSIONS[0]


class Relative:
    """Relative actions drawn beforehand, on raw observations."""

    def __init__(self, env, actions):
        self.egocentric, self.actions = Egocentric(env.unwrapped.simulation), actions

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        memory, k = (None, 0) if state is None else state
        memory = self.egocentric.observe(observation, memory)[1]
        return self.egocentric.reference(self.actions[k], observation, memory), (memory, k + 1)


def test_a_shielded_row_flies_as_a_shielded_policy():
    actions = np.random.default_rng(1).uniform(-1.0, 1.0, (60, 4, 3)).astype(np.float32)
    rows = HydroneVecEnv(ID, 4, shield=True)
    rows.seed(20)
    rows.reset()
    env = gym.make(ID)
    shield = Shield.for_env(Relative(env, actions[:, 2]), env)
    observation, state, intervened = env.reset(seed=22)[0], None, 0
    for k in range(60):
        _, rewards, done, _ = rows.step(actions[k])
        action, state = shield.predict(observation, state)
        observation, reward, terminated, truncated, _ = env.step(action)
        assert rows.shields[0].choice[2] == state.choice[0]
        assert rewards[2] == np.float32(np.float32(reward) + np.float32(INTERVENTION * (state.choice[0] != 0)))
        intervened += state.choice[0] != 0
        assert done[2] == (terminated or truncated)
        if done[2]:
            break
        np.testing.assert_array_equal(observation["state"], rows.env._core.episodes.rows["state"][2])
    assert intervened > 0


def test_random_actions_are_kept_safe_where_they_are_not_without():
    def failures(shield):
        rows, rng, found = HydroneVecEnv(ID, 32, shield=shield), np.random.default_rng(0), []
        rows.seed(5)
        rows.reset()
        for _ in range(120):
            _, _, _, infos = rows.step(rng.uniform(-1.0, 1.0, (32, 3)).astype(np.float32))
            found += [info["outcome"] for info in infos if info and info["outcome"] not in (1, 5)]
        return found

    assert Outcome.COLLISION in failures(False)
    assert failures(True) == []


def test_the_packaged_recipes():
    bare, shielded = load_recipe("ppo"), load_recipe("ppo-shield")
    assert (bare.shield, shielded.shield) == (False, True)
    assert shielded.missions == bare.missions
    assert shielded.settings["policy_kwargs"] == bare.settings["policy_kwargs"]
