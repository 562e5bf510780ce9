"""Demonstrations: flights of any policy on training worlds, as datasets of Minari, a mission each.

docs/demonstrations.md has the format: `<root>/HydroneGym/<mission>-<policy>-v0/data/` with `metadata.json` and
`main_data.hdf5`. Nothing in them is code. The same seed, options and actions give the same observations again, bit for
bit.
"""

import hashlib
import json
import re
import shutil
from collections.abc import Iterable
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
from hydrone_gym.evaluation import provenance
from hydrone_gym.evaluation.flight import fly
from hydrone_gym.evaluation.policies import Policy, PolicySource, find_policy
from hydrone_gym.evaluation.suites import HELD_OUT, MISSIONS
from hydrone_gym.simulation.outcome import Outcome

FIRST_SEED = 6_000_000  # above the worlds that training draws, below those held out
METADATA, DATA = "metadata.json", "main_data.hdf5"
OWN, FORMAT, SHA = "hydrone_gym", 1, "sha256"
INFOS = {"outcome": np.int64, "time": np.float64, "energy": np.float64, "clearance": np.float64}  # as stored
_PACKAGES = (*provenance.PACKAGES, "minari")


@dataclass(frozen=True, kw_only=True)
class Recording:
    """What is flown and where it is written.

    Raises:
        ValueError: no flights, seeds that are held out for evaluation, or an option that cannot be recorded.
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
        """Begin anew."""
        observation, info = self.env.reset(seed=seed, options=options)
        self.seen, self.infos, self.steps = [observation], [info], list[tuple[Any, ...]]()
        return observation, info

    def step(self, action: Any) -> Any:
        """Fly a period and note it down."""
        box: Any = self.env.action_space
        action = np.clip(np.asarray(action, np.float32), box.low, box.high)
        observation, reward, terminated, truncated, info = self.env.step(action)
        self.seen.append(observation)
        self.infos.append(info)
        self.steps.append((action, float(reward), terminated, truncated))
        return observation, reward, terminated, truncated, info


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
        spaces: Any = env.observation_space
        empty = [key for key, space in spaces.items() if 0 in space.shape]
        if empty:
            raise ValueError(f"Minari cannot describe empty arrays as in {', '.join(empty)}: fly at least 1 obstacle")
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
    flights = (demonstrate(env, source.make(env, seed), seed) for seed in seeds)
    storage.update_episodes(EpisodeBuffer(**vars(flight)) for flight in flights)
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
