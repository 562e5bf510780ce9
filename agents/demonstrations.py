"""Demonstrations: flights of any policy on training worlds, as datasets of Minari, a mission each.

docs/demonstrations.md has the format: `<root>/HydroneGym/<mission>-<policy>-v0/data/` with `metadata.json` and
`main_data.hdf5`. Nothing in them is code. The same seed, options and actions give the same observations again, bit for
bit.
"""

import hashlib
import json
import os
import re
import shutil
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym
import minari
import numpy as np
from gymnasium.envs.registration import registry
from minari.data_collector import EpisodeBuffer
from minari.dataset.minari_storage import MinariStorage
from numpy.typing import NDArray
from tqdm import tqdm

import hydrone_gym
from hydrone_gym.evaluation import provenance
from hydrone_gym.evaluation.flight import fly
from hydrone_gym.evaluation.policies import Policy, PolicySource, find_policy
from hydrone_gym.evaluation.suites import HELD_OUT, MISSIONS
from hydrone_gym.simulation.outcome import Outcome

FIRST_SEED = 6_000_000  # above the worlds that training draws, below those held out
METADATA, DATA = "metadata.json", "main_data.hdf5"
OWN, FORMAT, SHA = "hydrone_gym", 1, "sha256"
EXPERT, REFERENCE_FLIGHTS = "clrrt", 20  # what flies the reference scores, and in how many of the worlds held out
INFOS = {"outcome": np.int64, "time": np.float64, "energy": np.float64, "clearance": np.float64}  # as stored
_PACKAGES = (*provenance.PACKAGES, "minari")
_KEYS = ("env_id", "options", "policy", "versions")


@dataclass(frozen=True, kw_only=True)
class Recording:
    """What is flown and where it is written.

    Raises ValueError for no flights, seeds that are held out for evaluation, or an option that cannot be recorded.
    """

    root: Path  # folder of the datasets, made if missing
    policy: str = "clrrt"  # what `hydrone_gym.evaluation.policies.find_policy` takes
    missions: tuple[str, ...] = MISSIONS  # environment ids, a dataset each
    flights: int = 400  # a mission, each in a world of its own
    seed: int = FIRST_SEED  # of the first world; flight k is in the world that the environment draws from ``seed + k``
    options: dict[str, Any] = field(default_factory=dict)  # keyword options of the environments, plain data
    progress: bool = False  # show a bar on stderr

    def __post_init__(self) -> None:
        """Check the numbers."""
        if self.flights < 1 or not self.missions:
            raise ValueError(f"flights must be at least 1 on some mission, got {self.flights} on {self.missions}")
        if not 0 <= self.seed <= HELD_OUT - self.flights:
            raise ValueError(
                f"seeds must lie between 0 and {HELD_OUT - 1}, those above are held out for evaluation; "
                f"got {self.seed} to {self.seed + self.flights - 1}"
            )
        if self.options.get("interface", "world") != "world":
            raise ValueError(f'demonstrations need interface="world", got {self.options["interface"]!r}')
        try:
            json.dumps(self.options)
        except TypeError as error:
            raise ValueError(f"options must be plain data, so that they can be recorded: {error}") from None


@dataclass(frozen=True, kw_only=True, eq=False)
class Demonstration:
    """One recorded flight of T periods; shapes and types are those of the table in docs/demonstrations.md."""

    seed: int
    observations: dict[str, NDArray[np.float64]]
    actions: NDArray[np.float32]
    rewards: NDArray[np.float64]
    terminations: NDArray[np.bool_]
    truncations: NDArray[np.bool_]
    infos: dict[str, NDArray]

    @property
    def outcome(self) -> Outcome:
        """How it ended."""
        return Outcome(int(self.infos["outcome"][-1]))


@dataclass(frozen=True, kw_only=True, eq=False)
class Demonstrations:
    """A dataset: flights of one policy on one mission."""

    env_id: str  # of the environment
    options: dict[str, Any]  # its keyword options
    policy: str  # what flew
    versions: dict[str, str]  # of the packages it was recorded with
    sha256: str  # of the data
    flights: tuple[Demonstration, ...]  # in order of their seeds

    def make_env(self) -> gym.Env:
        """Make the environment that was flown."""
        return gym.make(self.env_id, disable_env_checker=True, **self.options)


class _Notebook(gym.Wrapper):
    """Notes down an episode; actions are clipped and rounded as their space has them, then flown."""

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        observation, info = self.env.reset(seed=seed, options=options)
        self.seen, self.infos, self.steps = [observation], [info], list[tuple[Any, ...]]()
        return observation, info

    def step(self, action: Any) -> Any:
        box: Any = self.env.action_space
        action = np.clip(np.asarray(action, np.float32), box.low, box.high)
        step = observation, reward, terminated, truncated, info = self.env.step(action)
        self.seen.append(observation)
        self.infos.append(info)
        self.steps.append((action, float(reward), terminated, truncated))
        return step


def demonstrate(env: gym.Env, policy: Policy, seed: int) -> Demonstration:
    """Fly the world of a seed and record it."""
    notes = _Notebook(env)
    fly(notes, policy, seed=seed)
    actions, rewards, terminations, truncations = zip(*notes.steps, strict=True)
    return Demonstration(
        seed=seed,
        observations={key: np.array([each[key] for each in notes.seen]) for key in notes.seen[0]},
        actions=np.array(actions, np.float32),
        rewards=np.array(rewards),
        terminations=np.array(terminations, bool),
        truncations=np.array(truncations, bool),
        infos={key: np.array([each[key] for each in notes.infos], kind) for key, kind in INFOS.items()},
    )


class _Random:
    """Asks for places all over the box of references: the policy that Minari's least score is measured by."""

    def __init__(self, env: gym.Env) -> None:
        self._space = env.action_space
        self._space.seed(0)

    def predict(self, observation: Any, *_: Any, **__: Any) -> tuple[Any, None]:
        return self._space.sample(), None


def reference_scores(env: gym.Env) -> tuple[float, float]:
    """Return the mean returns of random references and of the CL-RRT in the first `REFERENCE_FLIGHTS` held-out worlds.

    They depend on the environment alone, so scores are comparable over all datasets of it.
    """
    seeds, random, expert = range(HELD_OUT, HELD_OUT + REFERENCE_FLIGHTS), _Random(env), find_policy(EXPERT)
    least = np.mean([fly(env, random, seed=seed).episode_return for seed in seeds])
    return float(least), float(np.mean([fly(env, expert.make(env, 0), seed=seed).episode_return for seed in seeds]))


def record(recording: Recording) -> list[Path]:
    """Fly and write a dataset a mission; return their folders. A dataset appears only when it is complete.

    Raises:
        FileExistsError: a dataset of the same policy and mission is there already.
        ValueError, TypeError: a policy that is not known, or an option that the environment refuses.
    """
    source = find_policy(recording.policy)
    label = re.sub(r"[^A-Za-z0-9_-]", "_", source.label)  # Minari's ids have no other letters, and end in a version
    ids = {f"HydroneGym/{name.rpartition('/')[2].rpartition('-v')[0]}-{label}-v0": name for name in recording.missions}
    folders = [recording.root / dataset_id for dataset_id in ids]
    for folder in folders:
        if folder.exists():
            raise FileExistsError(f"{folder} exists already: name another --out, or remove it")
    for folder, (dataset_id, env_id) in zip(folders, ids.items(), strict=True):
        env = gym.make(env_id, disable_env_checker=True, **recording.options)
        spaces: Any = env.observation_space
        empty = [key for key, space in spaces.items() if 0 in space.shape]
        if empty:
            raise ValueError(f"Minari cannot describe empty arrays as in {', '.join(empty)}: fly at least 1 obstacle")
        partial = folder.with_name(f".{folder.name}.partial")
        shutil.rmtree(partial, ignore_errors=True)
        (partial / "data").mkdir(parents=True)
        try:
            _write((partial / "data").resolve(), dataset_id, env, source, recording)
            partial.rename(folder)
        finally:
            shutil.rmtree(partial, ignore_errors=True)
            env.close()
    return folders


def _write(folder: Path, dataset_id: str, env: gym.Env, source: PolicySource, recording: Recording) -> None:
    """Fly one mission and write its two files; the folder must be absolute, or Minari does not find its own files."""
    assert env.spec is not None
    storage = MinariStorage.new(folder, env.observation_space, env.action_space, env_spec=env.spec, data_format="hdf5")
    seeds = range(recording.seed, recording.seed + recording.flights)
    bar = tqdm(seeds, desc=env.spec.id, unit="flight", disable=not recording.progress)
    storage.update_episodes(EpisodeBuffer(**vars(demonstrate(env, source.make(env, seed), seed))) for seed in bar)
    least, greatest = reference_scores(env)
    described = {
        "format": FORMAT,
        "env_id": env.spec.id,
        "options": recording.options,
        "policy": source.label,
        "origin": source.origin,
        "versions": provenance.versions(_PACKAGES),
        "commit": provenance.commit(),
    }
    storage.update_metadata(
        {
            "dataset_id": dataset_id,
            "minari_version": minari.__version__,
            "algorithm_name": source.label,
            "description": f"{recording.flights} flights of {source.label} on {env.spec.id}",
            "eval_env_spec": env.spec.to_json(),
            "ref_min_score": least,
            "ref_max_score": greatest,
            "requirements": [f"hydrone-gym=={hydrone_gym.__version__}"],
            OWN: described,
            SHA: hashlib.sha256((folder / DATA).read_bytes()).hexdigest(),
        }
    )


def find_datasets(path: str | os.PathLike[str]) -> list[Path]:
    """Return the folders of the datasets at or below a path, in order; raises FileNotFoundError if there are none."""
    found = sorted(text.parent.parent for text in Path(path).glob(f"**/data/{METADATA}"))
    found = [folder for folder in found if not folder.name.startswith(".")]
    if not found:
        raise FileNotFoundError(f"no demonstrations at {os.fspath(path)}: record some with `hydrone demonstrate`")
    return found


def load_demonstrations(path: str | os.PathLike[str]) -> Demonstrations:
    """Read a dataset, in memory as a whole, from its folder: the one that holds `data/`.

    Raises:
        FileNotFoundError: no dataset there.
        ValueError: naming the folder, for one that is foreign or damaged, or for an environment that is not this one's.
    """
    folder = Path(path)
    for name in (METADATA, DATA):
        if not (folder / "data" / name).is_file():
            raise FileNotFoundError(f"no demonstrations at {folder}: {folder / 'data' / name} does not exist")
    try:
        return _read(folder / "data")
    except (AssertionError, AttributeError, KeyError, OSError, RuntimeError, TypeError, ValueError) as error:
        raise ValueError(f"{folder}: {error}") from None


def _read(data: Path) -> Demonstrations:
    """Check and read; raises ValueError, or what Minari and HDF5 raise for files that are none of theirs."""
    metadata = json.loads((data / METADATA).read_text(encoding="utf-8"))
    own = metadata.get(OWN) if isinstance(metadata, dict) else None
    if not isinstance(own, dict) or own.get("format") != FORMAT:
        raise ValueError(f'no demonstrations of this project: "{OWN}" in {METADATA} must have the format {FORMAT}')
    missing = [key for key in _KEYS if key not in own]
    if missing:
        raise ValueError(f"{METADATA} lacks {', '.join(missing)}")
    sha256 = hashlib.sha256((data / DATA).read_bytes()).hexdigest()
    if sha256 != metadata.get(SHA):
        raise ValueError(f"{DATA} is damaged or another one: its SHA-256 differs from the one noted")
    if own["env_id"] not in registry or not str(own["env_id"]).startswith("HydroneGym/"):
        raise ValueError(f"flown on {own['env_id']!r}, an environment that is not registered here")
    storage = MinariStorage.read(data)
    env = gym.make(own["env_id"], disable_env_checker=True, **own["options"])
    indices = range(int(metadata["total_episodes"]))
    pairs = zip(storage.get_episodes(indices), storage.get_episode_metadata(indices), strict=True)
    flights = tuple(_flight(episode, int(about["seed"]), env) for episode, about in pairs)
    env.close()
    return Demonstrations(**{key: own[key] for key in _KEYS}, sha256=sha256, flights=flights)


def _flight(episode: dict[str, Any], seed: int, env: gym.Env) -> Demonstration:
    """Check one flight against the spaces of its environment; ValueError if it does not fit."""
    name = f"episode {episode['id']}"
    flight = Demonstration(seed=seed, **{key: value for key, value in episode.items() if key != "id"})
    ends, first = flight.terminations | flight.truncations, {key: seen[0] for key, seen in flight.observations.items()}
    lengths = {len(seen) - 1 for seen in (*flight.observations.values(), *(flight.infos[key] for key in INFOS))}
    lengths |= {len(flight.actions), len(flight.rewards), len(ends)}
    if len(lengths) > 1 or ends.sum() != 1 or not ends[-1]:
        raise ValueError(f"{name}: its arrays must be equally long, and it must end once, with its last period")
    fits = first in env.observation_space and all(action in env.action_space for action in flight.actions)
    if not fits or not np.isfinite(flight.rewards).all():
        raise ValueError(f"{name} does not fit the spaces of {env.spec and env.spec.id}")
    return flight
