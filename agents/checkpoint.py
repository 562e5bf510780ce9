"""Checkpoints: everything a training needs to go on as if it had never stopped, bit for bit.

A checkpoint is taken between an update and the next rollout, in a folder of its own that appears under its name only
once it is complete: a run killed at any moment leaves a usable one. It is for going on with your own runs: unlike an
agent's files it holds pickles, so do not open one that somebody else gave you.
"""

import os
import pickle
import random
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm

KEPT = 2  # latest checkpoints of a run
MODEL = "model.zip"
_REST = "rest.pkl"


def save_checkpoint(model: BaseAlgorithm, folder: Path, extra: dict[str, Any]) -> Path:
    """Write a checkpoint into a folder of them and delete all but the latest `KEPT`; return its path."""
    final = folder / f"step_{model.num_timesteps:010d}"
    if final.exists():
        return final
    unfinished = folder / "unfinished"
    shutil.rmtree(unfinished, ignore_errors=True)
    unfinished.mkdir(parents=True)
    model.save(unfinished / MODEL)
    rest = {
        "environment": model.env,
        "torch": torch.get_rng_state(),
        "numpy": np.random.get_state(),  # noqa: NPY002  (the stream that Stable-Baselines3 draws from)
        "python": random.getstate(),
        "extra": extra,
    }
    with (unfinished / _REST).open("wb") as stream:
        pickle.dump(rest, stream)
    os.replace(unfinished, final)
    for old in checkpoints(folder)[:-KEPT]:
        shutil.rmtree(old)
    return final


def checkpoints(folder: Path) -> list[Path]:
    """Return the complete checkpoints of a folder, oldest first."""
    return sorted(path for path in folder.glob("step_*") if path.is_dir())


def load_checkpoint(path: Path, algorithm: type[BaseAlgorithm]) -> tuple[BaseAlgorithm, dict[str, Any]]:
    """Return the model, its environment in mid-flight, and what else was saved; sets the global random streams."""
    with (path / _REST).open("rb") as stream:
        rest = pickle.load(stream)
    # force_reset would throw away the episodes under way
    model = algorithm.load(path / MODEL, env=rest["environment"], device="cpu", force_reset=False)
    torch.set_rng_state(rest["torch"])
    np.random.set_state(rest["numpy"])  # noqa: NPY002
    random.setstate(rest["python"])
    return model, rest["extra"]
