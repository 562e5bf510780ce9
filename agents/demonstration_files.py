"""Reading demonstrations back: what `agents.demonstrations` wrote, checked before anything is made of it."""

import hashlib
import json
import os
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import registry
from minari.dataset.minari_storage import MinariStorage

from agents.demonstrations import DATA, FORMAT, INFOS, METADATA, OWN, SHA, Demonstration, Demonstrations

_KEYS = ("env_id", "options", "policy", "versions")


def find_datasets(path: str | os.PathLike[str]) -> list[Path]:
    """Return the folders of the datasets at or below a path, in order; raises FileNotFoundError if there are none."""
    found = sorted(text.parent.parent for text in Path(path).glob(f"**/data/{METADATA}"))
    found = [folder for folder in found if not folder.name.startswith(".")]
    if not found:
        raise FileNotFoundError(f"no demonstrations at {os.fspath(path)}: record some with `hydrone demonstrate`")
    return found


def load_demonstrations(path: str | os.PathLike[str]) -> Demonstrations:
    """Read a dataset, in memory as a whole.

    Args:
        path: folder of one dataset, the one that holds `data/`.

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
