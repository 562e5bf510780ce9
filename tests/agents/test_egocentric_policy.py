"""Models of other libraries, trained on the egocentric interface, fly as policies on the raw one."""

import functools
import json
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
import torch
from sb3_contrib import QRDQN, RecurrentPPO
from stable_baselines3 import A2C, PPO, SAC
from stable_baselines3.common.vec_env import VecNormalize

from agents import EgocentricPolicy
from agents.vec_env import HydroneVecEnv
from hydrone_gym.cli import main
from hydrone_gym.evaluation import Suite, evaluate, fly, fly_worlds
from hydrone_gym.evaluation.policies import find_policy
from hydrone_gym.vehicle import HYDRONE
from planners import StraightLine
from planners.shield import Shield

ID = "HydroneGym/Mission-v0"
SHORT = {"time_limit": 8.0}


@pytest.fixture(autouse=True)
def one_thread():
    torch.set_num_threads(1)


def made(kind, **policy):
    name = "MlpLstmPolicy" if kind is RecurrentPPO else "MlpPolicy"
    return kind(name, HydroneVecEnv(ID, 2), device="cpu", seed=3, policy_kwargs={"net_arch": [8], **policy})


def module(dtype=torch.float32):
    torch.manual_seed(0)
    return torch.nn.Sequential(
        torch.nn.Linear(68, 8), torch.nn.Dropout(0.5), torch.nn.Linear(8, 3), torch.nn.Tanh()
    ).to(dtype)


def both_ways(policy, choose, **options):
    """Fly the raw interface by the policy and the egocentric one by the model itself; states must be equal."""
    raw, flat = gym.make(ID, **SHORT, **options), gym.make(ID, interface="egocentric", **SHORT, **options)
    observation, seen, memory, held, start = raw.reset(seed=4)[0], flat.reset(seed=4)[0], None, None, np.array([True])
    done = False
    while not done:
        action, memory = policy.predict(observation, memory, start)
        own, held = choose(seen, held, start)
        observation, _, terminated, truncated, _ = raw.step(action)
        seen, done = flat.step(own)[0], terminated or truncated
        np.testing.assert_array_equal(observation["state"], flat.unwrapped._core.episodes.rows["state"][0])
        start = np.array([False])


@pytest.mark.parametrize("kind", [PPO, A2C, SAC, RecurrentPPO])
def test_a_model_flies_as_it_learnt(kind):
    model = made(kind)
    both_ways(EgocentricPolicy(model), lambda seen, held, start: model.predict(seen, held, start, deterministic=True))


def test_a_model_sees_through_its_normalisation():
    rows = VecNormalize(HydroneVecEnv(ID, 2))
    model = PPO("MlpPolicy", rows, n_steps=4, batch_size=8, device="cpu", seed=3)
    model.learn(8)

    def choose(seen, held, start):
        return model.predict(rows.normalize_obs(seen[None])[0], deterministic=True)

    both_ways(EgocentricPolicy(model), choose)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_a_torch_module_flies(dtype):
    network = module(dtype)

    def choose(seen, held, start):
        with torch.no_grad():
            return network(torch.from_numpy(seen[None]).to(dtype)).float().numpy()[0], None

    both_ways(EgocentricPolicy(network), choose)
    assert not network.training


@pytest.mark.parametrize("kind", [PPO, RecurrentPPO, "module"])
def test_a_flight_does_not_depend_on_those_beside_it(kind):
    """Also where rows end, and where an episode begins in the middle of the batch."""
    policy = EgocentricPolicy(module() if kind == "module" else made(kind))
    rows = gym.make_vec(ID, 5, vectorization_mode="vector_entry_point", **SHORT)
    for row, ending in enumerate(fly_worlds(rows, policy, seed=20)):
        alone = fly(gym.make(ID, **SHORT), policy, seed=20 + row)
        assert (ending.outcome, ending.time, ending.energy) == (alone.outcome, alone.time, alone.energy)
    observation = rows.reset(seed=0)[0]
    memory = policy.predict(observation)[1]
    observation = rows.step(observation["reference"].astype(np.float32))[0]
    again = policy.predict(observation, memory, np.array([False, True, False, False, True]))[0]
    fresh, on = policy.predict(observation)[0], policy.predict(observation, memory)[0]
    np.testing.assert_array_equal(again[[1, 4]], fresh[[1, 4]])
    np.testing.assert_array_equal(again[[0, 2, 3]], on[[0, 2, 3]])


def test_a_recurrent_model_remembers():
    policy, env = EgocentricPolicy(made(RecurrentPPO)), gym.make(ID)
    observation, _ = env.reset(seed=0)
    first, memory = policy.predict(observation)
    second, _ = policy.predict(observation, memory)
    assert np.abs(first - second).max() > 1e-5


@pytest.mark.parametrize("kind", [PPO, RecurrentPPO])
def test_a_file_of_the_user_flies_by_every_command(tmp_path, monkeypatch, capsys, kind):
    monkeypatch.chdir(tmp_path)
    made(kind).save("mine.zip")
    library = "sb3_contrib" if kind is RecurrentPPO else "stable_baselines3"
    (tmp_path / "mine.py").write_text(
        f"from {library} import {kind.__name__}\nfrom agents import EgocentricPolicy\n\n\n"
        f'def policy(env):\n    return EgocentricPolicy({kind.__name__}.load("mine.zip"), env)\n'
    )
    options = ["--policies", "x=mine.py:policy", "y=mine.py:policy+shield", "--worlds", "1", "--jobs", "1", "--json"]
    assert main(["evaluate", "--suites", "paper-20", *options]) == 0
    missions = json.loads(capsys.readouterr().out)["missions"]
    assert {policy["policy"] for policy in missions[0]["policies"]} == {"x", "y"}
    assert main(["fly", "--policy", "mine.py:policy", "--mission", "air-to-water", "--no-figures", "--json"]) in (0, 1)
    env = gym.make(ID, **SHORT)
    assert isinstance(find_policy("mine.py:policy+shield").make(env, 0), Shield)


def test_it_believes_in_the_vehicle_of_the_environment():
    large = {"vehicle": replace(HYDRONE, radius=0.9), "num_obstacles": 60}  # rays begin at the hull
    model = made(PPO)
    choose = functools.partial(model.predict, deterministic=True)
    both_ways(EgocentricPolicy(model, gym.make(ID, **large)), choose, **large)
    with pytest.raises(AssertionError):
        both_ways(EgocentricPolicy(model), choose, **large)


def test_evaluate_takes_it_as_a_factory():
    model = made(A2C)
    records = evaluate(Suite.drawn(ID, range(3), SHORT), {"mine": lambda env: EgocentricPolicy(model, env)}, jobs=1)
    assert len(records) == 3


SEEN = r"Box\(-5.0, 5.0, \(68,\), float32\)"
CHOSEN = r"Box\(-1.0, 1.0, \(3,\), float32\)"


def test_models_that_do_not_fit():
    with pytest.raises(
        ValueError,
        match=rf"^PPO was trained on observations Dict\('goal.* … and actions Box.*.* {SEEN} and actions {CHOSEN}$",
    ):
        EgocentricPolicy(PPO("MultiInputPolicy", gym.make(ID), device="cpu"))
    with pytest.raises(ValueError, match=rf"^PPO was trained on observations Box\(.*\(4,\).* {SEEN} and .* {CHOSEN}"):
        EgocentricPolicy(PPO("MlpPolicy", "CartPole-v1", device="cpu"))
    with pytest.raises(ValueError, match=r"^QRDQN .* actions Discrete\(2\); .*discrete actions cannot choose a refer"):
        EgocentricPolicy(QRDQN("MlpPolicy", "CartPole-v1", device="cpu", buffer_size=10))
    with pytest.raises(
        ValueError, match=rf"^Linear refuses observations \(1, 68\): RuntimeError: .*{SEEN} and.*{CHOSEN}"
    ):
        EgocentricPolicy(torch.nn.Linear(67, 3))
    with pytest.raises(ValueError, match=r"^Linear turns observations \(1, 68\) into \(1, 4\), not \(1, 3\); the egoc"):
        EgocentricPolicy(torch.nn.Linear(68, 4))
    with pytest.raises(ValueError, match=r"^LSTM turns observations \(1, 68\) into tuple"):
        EgocentricPolicy(torch.nn.LSTM(68, 3))
    with pytest.raises(TypeError, match="must be one of Stable-Baselines3 or a torch module, got StraightLine"):
        EgocentricPolicy(StraightLine.for_env(gym.make(ID)))
    with pytest.raises(TypeError, match="HyDrone"):
        EgocentricPolicy(torch.nn.Linear(68, 3), gym.make("CartPole-v1"))


def test_an_action_that_is_no_number_is_refused():
    network = torch.nn.Linear(68, 3)
    torch.nn.init.constant_(network.bias, torch.nan)
    with pytest.raises(ValueError, match="action must be finite"):
        EgocentricPolicy(network).predict(gym.make(ID).reset(seed=0)[0])
