"""Behaviour cloning: the pairs say what was flown, a small set is learnt by heart, and the agent flies."""

import dataclasses
import json
import pickle

import gymnasium as gym
import numpy as np
import pytest
import torch

from agents import load_agent
from agents.agent_file import TENSORS
from agents.cloning import Cloning, clone, fit, pairs_of, relative_actions
from agents.demonstration_files import find_datasets, load_demonstrations
from agents.demonstrations import Recording, record
from hydrone_gym.cli import main
from hydrone_gym.evaluation import fly
from hydrone_gym.evaluation.policies import find_policy
from hydrone_gym.perception.egocentric import Egocentric
from hydrone_gym.simulation.outcome import Outcome

OPTIONS = {"num_obstacles": 20, "vehicle": "paper"}


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demonstrations")
    missions = ("HydroneGym/Mission-v0", "HydroneGym/AirToWater-v0")
    record(Recording(root=folder, policy="straight-line", missions=missions, flights=6, options=OPTIONS))
    return folder


@pytest.fixture(scope="module")
def datasets(root):
    return [load_demonstrations(folder) for folder in find_datasets(root)]


@pytest.fixture(scope="module")
def cloned(root, tmp_path_factory):
    out = tmp_path_factory.mktemp("agents") / "mine"
    return clone(Cloning(data=root, out=out, epochs=3, batch=64)), out


def egocentric_of(dataset):
    return Egocentric(dataset.make_env().get_wrapper_attr("simulation"))


def test_relative_actions_undo_references(datasets):
    flight = datasets[0].flights[0]
    egocentric = egocentric_of(datasets[0])
    rng = np.random.default_rng(3)
    memory = None
    for k in range(len(flight.actions)):
        raw = {key: values[k] for key, values in flight.observations.items()}
        _, memory = egocentric.observe(raw, memory)
        action = rng.uniform(-0.05, 0.05, 3)  # small: the box clips none
        reference = egocentric.reference(action, raw, memory)
        found = relative_actions(reference[None], raw["state"][None], memory.start, raw["goal"])[0]
        assert found == pytest.approx(np.float32(action), abs=1e-6)


def test_a_goal_straight_above_leaves_the_axes_of_the_world():
    states = np.zeros((1, 12))
    found = relative_actions(np.array([[1.0, 0.5, 3.0, 0.0]]), states, np.zeros(3), np.array([0.0, 0.0, 2.0]))
    assert found.tolist() == [[0.5, 0.25, 2.0]]


def test_pairs_are_what_the_environment_shows(datasets):
    dataset = next(each for each in datasets if each.env_id == "HydroneGym/AirToWater-v0")
    flight = dataset.flights[0]
    pairs = pairs_of([flight], egocentric_of(dataset))
    env = gym.make(dataset.env_id, interface="egocentric", **dataset.options)
    seen, _ = env.reset(seed=flight.seed)
    assert seen.tobytes() == pairs.observations[0].tobytes()
    assert pairs.observations.shape == (len(flight.actions), 68)
    beyond = relative_actions(
        flight.actions, flight.observations["state"][:-1], flight.observations["state"][0, :3],
        flight.observations["goal"][0],
    )  # fmt: skip
    assert pairs.clipped == sum(np.abs(beyond).max(axis=1) > 1.0)
    assert np.abs(pairs.actions - beyond)[np.abs(beyond) <= 1.0].max() < 1e-6
    assert np.abs(pairs.actions).max() <= 1.0


def test_a_small_set_is_learnt_by_heart(datasets, tmp_path):
    flights = [flight for flight in datasets[0].flights if flight.outcome is Outcome.GOAL][:1]
    pairs = pairs_of(flights, egocentric_of(datasets[0]))
    layers, losses = fit(pairs, Cloning(data=tmp_path, out=tmp_path, epochs=300, batch=16, learning_rate=3e-3))
    assert losses[-1] < 0.01 * losses[0]
    found = layers(torch.from_numpy(pairs.observations)).detach().numpy()
    assert np.abs(found - pairs.actions).max() < 0.15


def test_only_flights_that_arrived_are_learnt_from(datasets, cloned):
    arrived = [sum(flight.outcome is Outcome.GOAL for flight in dataset.flights) for dataset in datasets]
    assert 0 < sum(arrived) < 12
    result, out = cloned
    assert result.flights == (sum(count - count // 10 for count in arrived), sum(count // 10 for count in arrived))
    lengths = [len(each.actions) for dataset in datasets for each in dataset.flights if each.outcome is Outcome.GOAL]
    assert result.pairs == sum(lengths)
    report = json.loads((out / "cloning.json").read_text())
    assert report["pairs"] == result.pairs
    assert [each["sha256"] for each in report["demonstrations"]] == [dataset.sha256 for dataset in datasets]


def test_flights_held_back_are_measured(root, tmp_path):
    result = clone(Cloning(data=root, out=tmp_path, epochs=1, held_back=0.5))
    assert result.flights[1] > 0
    assert result.held_back_loss > 0.0
    assert "held back" in result.summary()


def test_one_seed_gives_the_same_weights(root, cloned, tmp_path):
    result, out = cloned
    torch.manual_seed(12345)
    stream = torch.get_rng_state()
    again = Cloning(data=root, out=tmp_path / "again", epochs=3, batch=64)
    assert clone(again).losses == result.losses
    assert (tmp_path / "again" / TENSORS).read_bytes() == (out / TENSORS).read_bytes()
    assert torch.equal(torch.get_rng_state(), stream)
    clone(dataclasses.replace(again, seed=1, out=tmp_path / "other"))
    assert (tmp_path / "other" / TENSORS).read_bytes() != (out / TENSORS).read_bytes()


def test_the_agent_loads_without_unpickling_and_flies(cloned, monkeypatch):
    def refuse(*_args, **_kwargs):
        raise AssertionError("something was unpickled")

    for module, name in ((pickle, "load"), (pickle, "loads"), (pickle, "Unpickler"), (torch, "load")):
        monkeypatch.setattr(module, name, refuse)
    env = gym.make("HydroneGym/Mission-v0", disable_env_checker=True, **OPTIONS)
    agent = load_agent(cloned[1], env)
    assert agent.file.algorithm == "behaviour cloning"
    flight = fly(env, agent, seed=3)
    assert fly(env, find_policy(str(cloned[1])).make(env, 0), seed=3).states.tobytes() == flight.states.tobytes()


def test_errors(root, cloned, tmp_path):
    with pytest.raises(FileExistsError, match="holds an agent already"):
        clone(Cloning(data=root, out=cloned[1]))
    with pytest.raises(FileNotFoundError, match="no demonstrations"):
        clone(Cloning(data=tmp_path / "nowhere", out=tmp_path))
    for change in ({"epochs": 0}, {"batch": 0}, {"learning_rate": 0.0}, {"learning_rate": np.nan}, {"held_back": 1.0}):
        with pytest.raises(ValueError, match=next(iter(change))):
            Cloning(data=root, out=tmp_path, **change)
    missions = ("HydroneGym/Mission-v0",)
    mixed = tmp_path / "mixed"
    for k, count in enumerate((3, 4)):
        options = {"num_obstacles": count}
        record(Recording(root=mixed / str(k), policy="straight-line", missions=missions, flights=1, options=options))
    with pytest.raises(ValueError, match="same options"):
        clone(Cloning(data=mixed, out=tmp_path))


def test_nothing_to_learn_from(tmp_path):
    (tmp_path / "still.py").write_text(
        "class Still:\n"
        "    def __init__(self, env): pass\n"
        "    def predict(self, observation, state=None, episode_start=None, deterministic=False):\n"
        "        return observation['reference'], state\n"
    )
    missions, options = ("HydroneGym/Mission-v0",), {"time_limit": 2.0}
    policy = f"still={tmp_path}/still.py:Still"
    record(Recording(root=tmp_path, policy=policy, missions=missions, flights=2, options=options))
    with pytest.raises(ValueError, match="no flight arrived"):
        clone(Cloning(data=tmp_path, out=tmp_path / "agent"))


def test_command(root, tmp_path, capsys):
    arguments = ["clone", str(root), "--out", str(tmp_path / "agent"), "--epochs", "2"]
    assert main([*arguments, "--evaluation-episodes", "3", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert len(document["cloning"]["losses"]) == 2
    assert [score["episodes"] for score in document["scores"]] == [3, 3, 3]
    assert load_agent(document["folder"]).file.notes["epochs"] == 2
    assert main(arguments) == 2
    assert "holds an agent already" in capsys.readouterr().err
