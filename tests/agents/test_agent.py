"""Agents on the raw interface: equal to the model they come from, and safe to load."""

import pickle

import gymnasium as gym
import numpy as np
import pytest
import torch
import yaml
from sb3_contrib import TQC
from stable_baselines3 import A2C, PPO, SAC, TD3
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import DummyVecEnv

from agents import load_agent, shipped_agents
from agents.agent import PRETRAINED
from agents.agent_file import TENSORS, TEXT, AgentFile, read_agent, save_agent
from agents.algorithms import export_agent
from agents.network import Network
from agents.vec_env import HydroneVecEnv
from hydrone_gym.evaluation import HELD_OUT, MISSIONS, Suite, evaluate, fly_worlds

ID = MISSIONS[0]


def exported(folder, algorithm=PPO, **policy):
    model = algorithm("MlpPolicy", HydroneVecEnv(ID, 4), device="cpu", seed=3, policy_kwargs=policy or None)
    save_agent(export_agent(model, "test", ID, {"steps": 0}), folder)
    return model


@pytest.fixture
def folder(tmp_path):
    exported(tmp_path / "agent")
    return tmp_path / "agent"


def rewrite(folder, **changes):
    text = folder / TEXT
    text.write_text(yaml.safe_dump({**yaml.safe_load(text.read_text()), **changes}))


@pytest.mark.parametrize(
    ("algorithm", "policy"),
    [
        (PPO, {}),
        (PPO, {"activation_fn": torch.nn.ReLU, "net_arch": [128, 128]}),
        (SAC, {}),
        (SAC, {"activation_fn": torch.nn.Tanh, "net_arch": [32]}),
        (TD3, {}),
        (TQC, {"net_arch": {"pi": [48, 32], "qf": [16]}}),
    ],
)
def test_actions_are_those_of_the_model(tmp_path, algorithm, policy):
    model = exported(tmp_path / "agent", algorithm, **policy)
    agent = load_agent(tmp_path / "agent")
    seen = np.random.default_rng(0).uniform(-2.0, 2.0, (500, 68)).astype(np.float32)
    np.testing.assert_allclose(agent.relative_action(seen), model.predict(seen, deterministic=True)[0], atol=1e-5)


def test_models_that_cannot_be_exported():
    rows = HydroneVecEnv(ID, 2)
    with pytest.raises(ValueError, match="must be one of PPO, SAC, TD3, TQC, got A2C"):
        export_agent(A2C("MlpPolicy", rows, device="cpu"), "test", ID)
    with pytest.raises(ValueError, match="only multilayer perceptrons with one kind of activation"):
        export_agent(SAC("MlpPolicy", rows, device="cpu", policy_kwargs={"activation_fn": torch.nn.ELU}), "test", ID)


def test_a_flight_is_the_same_on_both_interfaces(folder):
    """The agent on raw observations flies as its network does on egocentric ones, bit for bit, alone or in a batch."""
    agent = load_agent(folder)
    raw, flat = gym.make(ID), gym.make(ID, interface="egocentric")
    rows = gym.make_vec(ID, num_envs=3, vectorization_mode="vector_entry_point")
    observation, seen, many = raw.reset(seed=4)[0], flat.reset(seed=4)[0], rows.reset(seed=3)[0]
    memory, memories, start, done = None, None, np.array([True]), False
    while not done:
        action, memory = agent.predict(observation, memory, start)
        actions, memories = agent.predict(many, memories)
        np.testing.assert_array_equal(actions[1], action)
        observation, _, terminated, truncated, _ = raw.step(action)
        seen = flat.step(agent.relative_action(seen[None])[0])[0]
        many = rows.step(actions)[0]
        np.testing.assert_array_equal(observation["state"], flat.unwrapped._core.episodes.rows["state"][0])
        start, done = np.array([False]), terminated or truncated


def test_three_ways_of_evaluating_agree(folder):
    """Stable-Baselines3's evaluate_policy, a loop by hand, and `fly_worlds` on the same worlds."""
    agent, options, by_hand, lengths = load_agent(folder), {"time_limit": 20.0}, [], []
    for seed in range(50, 54):
        env = gym.make(ID, **options)
        observation, memory, done, total = env.reset(seed=seed)[0], None, False, 0.0
        while not done:
            action, memory = agent.predict(observation, memory)
            observation, reward, terminated, truncated, info = env.step(action)
            done, total = terminated or truncated, total + reward
        by_hand.append(info["outcome"])
        lengths.append(total)
        single = DummyVecEnv([lambda: gym.make(ID, **options)])
        single.seed(seed)
        returns, _ = evaluate_policy(agent, single, n_eval_episodes=1, return_episode_rewards=True, warn=False)
        assert returns[0] == pytest.approx(total, abs=1e-5)
    rows = gym.make_vec(ID, num_envs=4, vectorization_mode="vector_entry_point", **options)
    endings = fly_worlds(rows, agent, seed=50)
    assert [ending.outcome for ending in endings] == by_hand
    assert [ending.episode_return for ending in endings] == lengths


def test_loading_unpickles_nothing(folder, monkeypatch):
    def refuse(*_, **__):
        raise AssertionError("something was unpickled")

    for module, name in ((pickle, "load"), (pickle, "loads"), (pickle, "Unpickler"), (torch, "load")):
        monkeypatch.setattr(module, name, refuse)
    load_agent(folder)
    for name in shipped_agents():
        load_agent(name)


def test_pickled_arrays_are_refused(folder):
    import hashlib

    arrays = {"weight_0": np.array([{"a": 1}], dtype=object), "bias_0": np.zeros(3, np.float32)}
    np.savez(folder / TENSORS, **arrays)
    digest = hashlib.sha256((folder / TENSORS).read_bytes()).hexdigest()
    network = {"sizes": [68, 3], "activation": "tanh", "output": "linear"}
    rewrite(folder, tensors={"file": TENSORS, "sha256": digest}, network=network)
    with pytest.raises(ValueError, match=r"weight_0.npy must be float32 \(68, 3\), got object \(1,\)"):
        load_agent(folder)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"format": "x"}, "not an agent"),
        ({"version": 2}, '"version" must be 1, got 2'),
        ({"environment": "HydroneGym/Mission-v9"}, "'HydroneGym/Mission-v9', an environment that is not registered"),
        ({"environment": "CartPole-v1"}, "not registered here"),
        ({"observation": "0"}, "another layout"),
        ({"network": {"sizes": [68, 3], "activation": "tanh", "output": "linear"}}, "were noted"),
        (
            {"network": {"sizes": [68, 64, 64, 3], "activation": "gelu", "output": "linear"}},
            "unknown activation 'gelu'",
        ),
        ({"tensors": {"file": "other.npz", "sha256": ""}}, "other.npz are missing"),
        ({"tensors": 3}, '"tensors" must be a mapping, got 3'),
    ],
)
def test_foreign_files(folder, changes, message):
    rewrite(folder, **changes)
    with pytest.raises(ValueError, match=message):
        load_agent(folder)


def test_damaged_and_missing_files(folder, tmp_path):
    data = bytearray((folder / TENSORS).read_bytes())
    data[500] ^= 1
    (folder / TENSORS).write_bytes(data)
    with pytest.raises(ValueError, match="damaged or another one"):
        load_agent(folder)
    (folder / TEXT).write_text("a: [")
    with pytest.raises(ValueError, match=r"agent\.yaml"):
        load_agent(folder)
    (folder / TEXT).write_text("format: hydrone_gym agent\nversion: 1\n")
    with pytest.raises(ValueError, match="missing key algorithm"):
        load_agent(folder)
    with pytest.raises(FileNotFoundError, match=r"no agent 'nobody': shipped are"):
        load_agent("nobody")
    with pytest.raises(FileNotFoundError, match="does not exist"):
        load_agent(tmp_path)


def test_networks_that_do_not_fit(folder):
    good = read_agent(folder).network
    wrong = np.zeros((68, 2), np.float32)
    with pytest.raises(ValueError, match="layer 1 does not fit"):
        Network(
            weights=(wrong, *good.weights[1:]),
            biases=(np.zeros(2, np.float32), *good.biases[1:]),
            activation="tanh",
            output="linear",
        )
    with pytest.raises(ValueError, match="not finite"):
        Network(weights=(wrong * np.nan,), biases=(np.zeros(2, np.float32),), activation="tanh", output="linear")
    small = Network(weights=(wrong,), biases=(np.zeros(2, np.float32),), activation="tanh", output="linear")
    save_agent(AgentFile(name="small", algorithm="PPO", environment=ID, network=small), folder)
    with pytest.raises(ValueError, match="68 inputs and 2 outputs"):
        load_agent(folder)


def test_bad_observations(folder):
    agent = load_agent(folder)
    with pytest.raises(ValueError, match="interface='world'"):
        agent.predict({"state": np.zeros(12)})
    with pytest.raises(TypeError, match="HyDrone"):
        load_agent(folder, env=gym.make("CartPole-v1"))


HOME = {"ppo-weather": {"controller": "robust", "weather": 2}}  # what an agent is for, where that is not the default


@pytest.mark.parametrize("name", shipped_agents())
def test_shipped_agents(name):
    """Each is small, has a card, and arrives in most of a few held-out worlds of the kind it is for."""
    folder = PRETRAINED / name
    assert sum(file.stat().st_size for file in folder.iterdir()) < 2_000_000
    assert "## Success on held-out worlds" in (folder / "README.md").read_text(encoding="utf-8")
    worlds = Suite.drawn(ID, range(HELD_OUT, HELD_OUT + 100), HOME.get(name))
    records = evaluate(worlds, {name: lambda env: load_agent(name, env)}, worlds=100)
    assert sum(record.success for record in records) > 90
