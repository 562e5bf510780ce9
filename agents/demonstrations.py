"""Demonstrations: flights of any policy on training worlds, as datasets of Minari, a mission each.

A root folder holds one Minari dataset a mission, `<root>/HydroneGym/<mission>-<policy>-v0/data/`, with two files.
Minari finds it by the id `HydroneGym/<mission>-<policy>-v0` when `MINARI_DATASETS_PATH` names the root.

`metadata.json`: Minari's keys, among them `env_spec` (id and options of the environment), and

| key | content |
|---|---|
| `sha256` | of `main_data.hdf5`, checked when it is read |
| `hydrone_gym` | `format` 1, `env_id`, `options`, `policy`, `origin` of the policy, `versions`, `commit` |

`main_data.hdf5`: a group `episode_<k>` a flight of T periods, its attribute `seed` that of the world, and

| dataset | shape, type |
|---|---|
| `observations/<key>` | (T + 1, ...) float64, raw, as `interface="world"` gives them, the first and the last included |
| `actions` | (T, 4) float32 references in m, m, m, rad: those flown |
| `rewards` | (T,) float64 |
| `terminations`, `truncations` | (T,) bool, True at the end only |
| `infos/outcome` | (T + 1,) int64, values of `Outcome` |
| `infos/time`, `energy`, `clearance` | (T + 1,) float64: s, J, m |

Nothing in them is code. The same seed, options and actions give the same observations again, bit for bit.
"""

import hashlib
import json
import re
import shutil
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym
import minari
import numpy as np
from minari.data_collector import EpisodeBuffer
from minari.dataset.minari_storage import MinariStorage
from numpy.typing import NDArray
from tqdm import tqdm

import hydrone_gym
from agents.evaluation import HELD_OUT, MISSIONS
from hydrone_gym.evaluation import provenance
from hydrone_gym.evaluation.policies import PolicySource, find_policy
from hydrone_gym.evaluation.policies import Policy
from hydrone_gym.simulation.outcome import Outcome

FIRST_SEED = 6_000_000  # above the worlds that training draws, below those held out
METADATA, DATA = "metadata.json", "main_data.hdf5"
OWN, FORMAT, SHA = "hydrone_gym", 1, "sha256"
INFOS = ("outcome", "time", "energy", "clearance")
_PACKAGES = (*provenance.PACKAGES, "minari")


@dataclass(frozen=True, kw_only=True)
class Recording:
    """What is flown and where it is written.

    Attributes:
        root: folder of the datasets, made if missing.
        policy: what `hydrone_gym.evaluation.policies.find_policy` takes.
        missions: environment ids, a dataset each.
        flights: a mission, each in a world of its own.
        seed: of the first world; flight k is in the world that the environment draws from ``seed + k``.
        options: keyword options of the environments, plain data.
        progress: show a bar on stderr.

    Raises:
        ValueError: no flights, seeds that are held out for evaluation, or an option that cannot be recorded.
    """

    root: Path
    policy: str = "clrrt"
    missions: tuple[str, ...] = MISSIONS
    flights: int = 400
    seed: int = FIRST_SEED
    options: dict[str, Any] = field(default_factory=dict)
    progress: bool = False

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
    """One recorded flight of T periods; shapes and types are those of the module's table."""

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
    """A dataset: flights of one policy on one mission.

    Attributes:
        env_id: of the environment.
        options: its keyword options.
        policy: what flew.
        versions: of the packages it was recorded with.
        sha256: of the data.
        flights: in order of their seeds.
    """

    env_id: str
    options: dict[str, Any]
    policy: str
    versions: dict[str, str]
    sha256: str
    flights: tuple[Demonstration, ...]

    def make_env(self) -> gym.Env:
        """Make the environment that was flown."""
        return gym.make(self.env_id, disable_env_checker=True, **self.options)


def demonstrate(env: gym.Env, policy: Policy, seed: int) -> Demonstration:
    """Fly the world of a seed and record it; actions are clipped and rounded as their space has them, then flown."""
    low, high = env.action_space.low, env.action_space.high  # type: ignore[attr-defined]
    observation, info = env.reset(seed=seed)
    observations, infos, actions, rewards = [observation], [info], [], []
    memory, start = None, np.array([True])
    ends: list[list[bool]] = []
    while not ends or not any(ends[-1]):
        action, memory = policy.predict(observation, state=memory, episode_start=start, deterministic=True)
        actions.append(np.clip(np.asarray(action, np.float32), low, high))
        observation, reward, *end, info = env.step(actions[-1])
        observations.append(observation)
        infos.append(info)
        rewards.append(float(reward))
        ends.append(end)
        start = np.array([False])
    terminations, truncations = np.array(ends, bool).T.copy()
    return Demonstration(
        seed=seed,
        observations={key: np.array([each[key] for each in observations]) for key in observation},
        actions=np.array(actions, np.float32),
        rewards=np.array(rewards),
        terminations=terminations,
        truncations=truncations,
        infos={key: np.array([each[key] for each in infos], type_of_info(key)) for key in INFOS},
    )


def type_of_info(info: str) -> type:
    """Return how an info is stored."""
    return np.int64 if info == "outcome" else np.float64


def record(recording: Recording) -> list[Path]:
    """Fly and write a dataset a mission; return their folders. A dataset appears only when it is complete.

    Raises:
        FileExistsError: a dataset of the same policy and mission is there already.
        ValueError, TypeError: a policy that is not known, or an option that the environment refuses.
    """
    source = find_policy(recording.policy)
    missions = {recording.root / _dataset_id(env_id, source.label): env_id for env_id in recording.missions}
    for folder in missions:
        if folder.exists():
            raise FileExistsError(f"{folder} exists already: name another --out, or remove it")
    for folder, env_id in missions.items():
        env = gym.make(env_id, disable_env_checker=True, **recording.options)
        _check_space(env)
        partial = folder.with_name(f".{folder.name}.partial")
        shutil.rmtree(partial, ignore_errors=True)
        (partial / "data").mkdir(parents=True)
        try:
            _write((partial / "data").resolve(), _dataset_id(env_id, source.label), env, source, recording)
            partial.rename(folder)
        finally:
            shutil.rmtree(partial, ignore_errors=True)
            env.close()
    return list(missions)


def _check_space(env: gym.Env) -> None:
    """Refuse an observation that Minari cannot describe: one without obstacles has an array without entries."""
    assert isinstance(env.observation_space, gym.spaces.Dict)
    empty = [key for key, space in env.observation_space.items() if 0 in (space.shape or ())]
    if empty:
        raise ValueError(f"Minari cannot describe empty arrays, and {', '.join(empty)} is one: fly at least 1 obstacle")


def _dataset_id(env_id: str, label: str) -> str:
    """Return Minari's id: letters, digits, "-" and "_", and a version."""
    mission = env_id.rpartition("/")[2].rpartition("-v")[0]
    return f"HydroneGym/{mission}-{re.sub(r'[^A-Za-z0-9_-]', '_', label)}-v0"


def _write(folder: Path, dataset_id: str, env: gym.Env, source: PolicySource, recording: Recording) -> None:
    """Fly one mission and write its two files; the folder must be absolute, or Minari does not find its own files."""
    assert env.spec is not None
    storage = MinariStorage.new(folder, env.observation_space, env.action_space, env_spec=env.spec, data_format="hdf5")
    seeds: Iterable[int] = range(recording.seed, recording.seed + recording.flights)
    seeds = tqdm(seeds, desc=env.spec.id, unit="flight", disable=not recording.progress)
    storage.update_episodes(_buffers(demonstrate(env, source.make(env, seed), seed) for seed in seeds))
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
            "requirements": [f"hydrone-gym=={hydrone_gym.__version__}"],
            OWN: described,
            SHA: hashlib.sha256((folder / DATA).read_bytes()).hexdigest(),
        }
    )


def _buffers(flights: Iterable[Demonstration]) -> Iterator[EpisodeBuffer]:
    for flight in flights:
        yield EpisodeBuffer(**vars(flight))
