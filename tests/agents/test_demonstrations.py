"""Recorded flights: what is written is what was flown, comes back bit for bit, and flies again to the same numbers."""

import hashlib
import json

import gymnasium as gym
import h5py
import minari
import numpy as np
import pytest

from agents.demonstrations import REFERENCE_FLIGHTS, Recording, demonstrate, find_datasets, load_demonstrations, record
from hydrone_gym.cli import main
from hydrone_gym.evaluation import HELD_OUT, fly
from hydrone_gym.evaluation.policies import find_policy

OPTIONS = {"num_obstacles": 4, "vehicle": "physical"}
MISSIONS = ("HydroneGym/Mission-v0", "HydroneGym/AirToWater-v0")
SEEDS = (7_000_000, 7_000_001, 7_000_002)
WILD = """
import numpy as np


class Wild:
    '''Asks for places outside the box, in float64; raises in the world of one seed.'''

    def __init__(self, env, seed):
        if seed == 13:
            raise RuntimeError("unlucky")

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        return np.array([1e3, -1e3, 20.0, 0.1]), state
"""


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demonstrations")
    recording = Recording(
        root=folder, policy="straight-line", missions=MISSIONS, flights=3, seed=SEEDS[0], options=OPTIONS
    )
    assert record(recording) == [
        folder / "HydroneGym" / f"{name}-straight-line-v0" for name in ("Mission", "AirToWater")
    ]
    return folder


@pytest.fixture
def dataset(root, tmp_path):
    """A copy that a test may damage."""
    source, copy = find_datasets(root)[0] / "data", tmp_path / "dataset" / "data"
    copy.mkdir(parents=True)
    for file in source.iterdir():
        (copy / file.name).write_bytes(file.read_bytes())
    return copy.parent


def same(first, second):
    assert first.shape == second.shape
    assert first.dtype == second.dtype
    assert first.tobytes() == second.tobytes()


def test_comes_back_bit_for_bit(root):
    for folder, env_id in zip(find_datasets(root), sorted(MISSIONS), strict=True):
        loaded = load_demonstrations(folder)
        assert (loaded.env_id, loaded.options, loaded.policy) == (env_id, OPTIONS, "straight-line")
        assert loaded.versions["minari"] == minari.__version__
        assert tuple(flight.seed for flight in loaded.flights) == SEEDS
        env = gym.make(env_id, **OPTIONS)
        for flight in loaded.flights:
            flown = demonstrate(env, find_policy("straight-line").make(env, 0), flight.seed)
            for key in ("actions", "rewards", "terminations", "truncations"):
                same(getattr(flight, key), getattr(flown, key))
            for part, again in ((flight.observations, flown.observations), (flight.infos, flown.infos)):
                assert part.keys() == again.keys()
                for key in part:
                    same(part[key], again[key])


def test_recorded_actions_give_the_recorded_flight(root):
    for folder in find_datasets(root):
        loaded = load_demonstrations(folder)
        env = loaded.make_env()
        for flight in loaded.flights:
            observation, info = env.reset(seed=flight.seed)
            for k in range(len(flight.actions) + 1):
                for key, value in observation.items():
                    same(flight.observations[key][k], value)
                assert (flight.infos["outcome"][k], flight.infos["energy"][k]) == (info["outcome"], info["energy"])
                if k < len(flight.actions):
                    observation, reward, terminated, truncated, info = env.step(flight.actions[k])
                    told = (flight.rewards[k], flight.terminations[k], flight.truncations[k])
                    assert told == (reward, terminated, truncated)
            assert flight.outcome is info["outcome"]


def test_minari_reads_it_and_makes_its_environment(root, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(root))
    dataset = minari.load_dataset("HydroneGym/AirToWater-straight-line-v0")
    env = dataset.recover_environment()
    assert env.unwrapped.options.num_obstacles == OPTIONS["num_obstacles"]
    assert dataset.total_episodes == 3
    own = load_demonstrations(root / "HydroneGym" / "AirToWater-straight-line-v0").flights
    for episode, flight in zip(dataset.iterate_episodes(), own, strict=True):
        same(episode.actions, flight.actions)
        assert all(action in env.action_space for action in episode.actions)


def test_scores_are_normalised_by_flights_of_held_out_worlds(root, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(root))
    dataset = minari.load_dataset("HydroneGym/AirToWater-straight-line-v0")
    env = dataset.recover_environment(eval_env=True)
    assert env.spec.id == "HydroneGym/AirToWater-v0"
    assert env.spec.kwargs.items() >= OPTIONS.items()
    planner, returns = find_policy("clrrt"), []
    for seed in range(HELD_OUT, HELD_OUT + REFERENCE_FLIGHTS):
        returns.append(fly(env, planner.make(env, 0), seed=seed).episode_return)
    assert minari.get_normalized_score(dataset, np.mean(returns)) == pytest.approx(1.0, abs=1e-12)
    recorded = np.array([episode.rewards.sum() for episode in dataset.iterate_episodes()])
    scores = minari.get_normalized_score(dataset, recorded)
    assert ((scores > 0.3) & (scores < 1.2)).all()  # they arrive, as the CL-RRT does
    env.action_space.seed(0)
    returns = []
    for seed in range(HELD_OUT, HELD_OUT + REFERENCE_FLIGHTS):
        env.reset(seed=seed)
        returns.append(0.0)
        done = False
        while not done:
            _, reward, terminated, truncated, _ = env.step(env.action_space.sample())
            returns[-1] += reward
            done = terminated or truncated
    assert minari.get_normalized_score(dataset, np.mean(returns)) == pytest.approx(0.0, abs=1e-12)


def test_actions_are_those_flown(tmp_path):
    (tmp_path / "wild.py").write_text(WILD)
    recording = Recording(root=tmp_path, policy=f"w={tmp_path}/wild.py:Wild", missions=MISSIONS[:1], flights=2, seed=5)
    flight = load_demonstrations(record(recording)[0]).flights[0]
    assert flight.actions[0].tolist() == [10.0, -10.0, 10.0, np.float32(0.1)]
    same(flight.observations["reference"][1:], flight.actions.astype(np.float64))


def test_what_stops_leaves_nothing(tmp_path):
    (tmp_path / "wild.py").write_text(WILD)
    root = tmp_path / "root"
    with pytest.raises(ValueError, match="unlucky"):
        record(Recording(root=root, policy=f"{tmp_path}/wild.py:Wild", missions=MISSIONS[:1], flights=2, seed=12))
    assert [path for path in root.rglob("*") if path.is_file()] == []
    with pytest.raises(FileNotFoundError, match="hydrone demonstrate"):
        find_datasets(root)


def test_bad_recordings(root, tmp_path):
    with pytest.raises(ValueError, match="held out"):
        Recording(root=tmp_path, flights=2, seed=HELD_OUT - 1)
    with pytest.raises(ValueError, match="at least 1"):
        Recording(root=tmp_path, flights=0)
    with pytest.raises(ValueError, match="world"):
        Recording(root=tmp_path, options={"interface": "egocentric"})
    with pytest.raises(ValueError, match="plain data"):
        Recording(root=tmp_path, options={"vehicle": object()})
    with pytest.raises(ValueError, match="no policy 'nobody'"):
        record(Recording(root=tmp_path, policy="nobody"))
    with pytest.raises(ValueError, match="at least 1 obstacle"):
        record(Recording(root=tmp_path, policy="straight-line", options={"num_obstacles": 0}))
    with pytest.raises(FileExistsError, match="Mission-straight-line-v0 exists already"):
        record(Recording(root=root, policy="straight-line", missions=MISSIONS[:1], flights=1))


def test_damaged_data(dataset):
    file = dataset / "data" / "main_data.hdf5"
    whole = file.read_bytes()
    for broken in (whole[:-100], bytes([whole[0] ^ 1]) + whole[1:], b""):
        file.write_bytes(broken)
        with pytest.raises(ValueError, match=r"dataset: .*SHA-256"):
            load_demonstrations(dataset)
    file.unlink()
    with pytest.raises(FileNotFoundError, match=r"main_data\.hdf5 does not exist"):
        load_demonstrations(dataset)


def change(dataset, changes):
    """Write other metadata, with the hash of the data as it is."""
    file = dataset / "data" / "metadata.json"
    content = json.loads(file.read_text())
    content["sha256"] = hashlib.sha256((dataset / "data" / "main_data.hdf5").read_bytes()).hexdigest()
    changes(content)
    file.write_text(json.dumps(content))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (lambda content: content.pop("hydrone_gym"), "no demonstrations of this project"),
        (lambda content: content["hydrone_gym"].update(format=2), "format 1"),
        (lambda content: content["hydrone_gym"].pop("options"), "lacks options"),
        (lambda content: content["hydrone_gym"].update(env_id="CartPole-v1"), "not registered here"),
        (
            lambda content: content["hydrone_gym"].update(options={"num_obstacles": 5}),
            "episode 0 does not fit the spaces of HydroneGym/",
        ),
        (lambda content: content.update(total_episodes=4), "episode_3"),
    ],
)
def test_foreign_metadata(dataset, changes, message):
    change(dataset, changes)
    with pytest.raises(ValueError, match=rf"dataset: .*{message}"):
        load_demonstrations(dataset)


@pytest.mark.parametrize("text", ["", "[1]", "{", "\x00\x01"])
def test_metadata_that_is_none(dataset, text):
    (dataset / "data" / "metadata.json").write_text(text)
    with pytest.raises(ValueError, match="dataset: "):
        load_demonstrations(dataset)


def _replace(flight, key, values):
    del flight[key]
    flight[key] = values


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda flight: _replace(flight, "actions", np.zeros((2, 3), np.float32)), "equally long"),
        (
            lambda flight: _replace(flight, "actions", flight["actions"][:].astype(np.float64)),
            "does not fit the spaces",
        ),
        (lambda flight: flight["rewards"].__setitem__(0, np.nan), "does not fit the spaces"),
        (lambda flight: flight["terminations"].__setitem__(0, True), "must end once"),
        (lambda flight: flight["observations"].pop("goal"), "does not fit the spaces"),
        (lambda flight: flight.pop("infos"), "NoneType"),
        (lambda flight: flight.attrs.pop("seed"), "seed"),
    ],
)
def test_flights_that_do_not_fit(dataset, damage, message):
    with h5py.File(dataset / "data" / "main_data.hdf5", "a") as file:
        damage(file["episode_1"])
    change(dataset, lambda content: None)
    with pytest.raises(ValueError, match=rf"dataset: .*{message}"):
        load_demonstrations(dataset)


def test_command(tmp_path, capsys):
    arguments = ["demonstrate", "straight-line", "--out", str(tmp_path / "out"), "--missions", "water-to-air"]
    assert main([*arguments, "--flights", "2", "--obstacles", "1", "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert (row["flights"], row["arrived"]) == (2, 2)
    assert load_demonstrations(row["folder"]).options == {"num_obstacles": 1, "vehicle": "paper"}
    assert main(arguments) == 2
    assert "exists already" in capsys.readouterr().err
    assert main(["demonstrate", "--seed", str(HELD_OUT)]) == 2
    assert "held out" in capsys.readouterr().err
