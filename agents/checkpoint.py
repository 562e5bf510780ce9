"""Checkpoints: everything a training needs to go on as if it had never stopped, bit for bit.

A checkpoint is taken between an update and the next rollout, in a folder of its own that appears under its name only
once it is complete: a run killed at any moment leaves a usable one. It holds the SHA-256 of its files, so one that was
damaged later is told from a whole one, and the one before it is used. It is for going on with your own runs: unlike an
agent's files it holds pickles, so do not open one that somebody else gave you.
"""

import hashlib
import json
import os
import pickle
import random
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

KEPT = 2  # latest checkpoints of a run; one if they hold a replay buffer, which is large
MODEL = "model.zip"
_REST = "rest.pkl"
_BUFFER = "replay.npz"
_SUMS = "sha256.json"
_PLAIN = ("observations", "actions", "rewards", "dones", "timeouts")  # what is written of a buffer as it is


def save_checkpoint(model: BaseAlgorithm, folder: Path, extra: dict[str, Any]) -> Path:
    """Write a checkpoint into a folder of them, replay buffer included, and delete old ones; return its path."""
    final = folder / f"step_{model.num_timesteps:010d}"
    unfinished = folder / "unfinished"
    shutil.rmtree(unfinished, ignore_errors=True)
    unfinished.mkdir(parents=True)
    model.save(unfinished / MODEL)
    if isinstance(model, OffPolicyAlgorithm):
        save_buffer(model.replay_buffer, unfinished / _BUFFER)
    rest = {
        "environment": model.env,
        "actions": model.action_space.np_random.bit_generator.state,
        "torch": torch.get_rng_state(),
        "numpy": np.random.get_state(),  # noqa: NPY002  (the stream that Stable-Baselines3 draws from)
        "python": random.getstate(),
        "extra": extra,
    }
    with (unfinished / _REST).open("wb") as stream:
        pickle.dump(rest, stream)
    (unfinished / _SUMS).write_text(json.dumps(_sums(unfinished)), encoding="utf-8")
    shutil.rmtree(final, ignore_errors=True)
    os.replace(unfinished, final)
    kept = 1 if (final / _BUFFER).exists() else KEPT
    saved = checkpoints(folder)
    here = saved.index(final) + 1  # those beyond it were found damaged, and the run went on from one before them
    for other in saved[: max(here - kept, 0)] + saved[here:]:
        shutil.rmtree(other)
    return final


def checkpoints(folder: Path) -> list[Path]:
    """Return the checkpoints of a folder, oldest first."""
    return sorted(path for path in folder.glob("step_*") if path.is_dir())


def latest_checkpoint(folder: Path) -> Path:
    """Return the latest checkpoint whose files are those that were written; say on stderr which are not.

    Raises FileNotFoundError if there is none.
    """
    for path in reversed(checkpoints(folder)):
        try:
            if json.loads((path / _SUMS).read_text(encoding="utf-8")) == _sums(path):
                return path
        except (OSError, ValueError):
            pass
        print(f"hydrone: {path} is damaged: the checkpoint before it is tried", file=sys.stderr)
    raise FileNotFoundError(f"{folder.parent} holds no checkpoint that is whole")


def _sums(path: Path) -> dict[str, str]:
    """Return the SHA-256 of each file of a checkpoint."""
    sums = {}
    for file in sorted(path.iterdir()):
        if file.name != _SUMS:
            with file.open("rb") as stream:
                sums[file.name] = hashlib.file_digest(stream, "sha256").hexdigest()
    return sums


def load_checkpoint(path: Path, algorithm: type[BaseAlgorithm]) -> tuple[BaseAlgorithm, dict[str, Any]]:
    """Return the model, its environment in mid-flight, and what else was saved; sets the global random streams."""
    with (path / _REST).open("rb") as stream:
        rest = pickle.load(stream)
    # force_reset would throw away the episodes under way; a class noted for the replay buffer would be taken for one
    # of the user, which SB3 warns about
    changes = {"replay_buffer_class": None} if issubclass(algorithm, OffPolicyAlgorithm) else {}
    model = algorithm.load(path / MODEL, env=rest["environment"], device="cpu", force_reset=False, **changes)
    if isinstance(model, OffPolicyAlgorithm):
        load_buffer(model.replay_buffer, path / _BUFFER)
    model.action_space.np_random.bit_generator.state = rest["actions"]
    torch.set_rng_state(rest["torch"])
    np.random.set_state(rest["numpy"])  # noqa: NPY002
    random.setstate(rest["python"])
    return model, rest["extra"]


def save_buffer(buffer: ReplayBuffer, path: Path) -> None:
    """Write a replay buffer of flat observations to an NPZ file, only what it holds, and every observation once.

    The observation after a transition is nearly always the one before the next transition of the same row. Only the
    others, those that end an episode and the newest, are written beside them: half the size.
    """
    held = buffer.buffer_size if buffer.full else buffer.pos
    after = buffer.next_observations[:held]
    other = (after != np.roll(buffer.observations[:held], -1, axis=0)).any(axis=-1)  # the buffer is a ring in time
    arrays = {name: getattr(buffer, name)[:held] for name in _PLAIN}
    np.savez(path, pos=buffer.pos, full=buffer.full, other=other, after=after[other], **arrays)


def load_buffer(buffer: ReplayBuffer, path: Path) -> None:
    """Fill a new buffer of the same shape with what `save_buffer` wrote."""
    with np.load(path, allow_pickle=False) as saved:
        held = len(saved["rewards"])
        for name in _PLAIN:
            getattr(buffer, name)[:held] = saved[name]
        after = buffer.next_observations[:held]
        after[:] = np.roll(buffer.observations[:held], -1, axis=0)
        after[saved["other"]] = saved["after"]
        buffer.pos, buffer.full = int(saved["pos"]), bool(saved["full"])
