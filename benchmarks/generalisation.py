"""How policies fare in worlds of another shape than agents train on: outcomes, Wilson intervals and time.

    python -m benchmarks.generalisation                     # every shape of `benchmarks.world_shapes`
    python -m benchmarks.generalisation --episodes 200 --policies ppo ppo-shield --shapes "60 spheres" --out /tmp/trial
    python -m benchmarks.results                            # tables and figure from what was measured

Every flight is one of `hydrone_gym.evaluation.fly_worlds`. All policies fly the same worlds, from seeds that neither
the training nor the choice of the shipped agents has seen.
"""

import shlex
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import tyro
from rich.console import Console

from benchmarks.generalisation_table import success_sheet
from benchmarks.timing import RESULTS, save
from benchmarks.world_shapes import SHAPED, SHAPES
from hydrone_gym.evaluation import fly_worlds
from hydrone_gym.evaluation.policies import PolicySource, find_policies
from hydrone_gym.evaluation.records import record_of
from hydrone_gym.evaluation.summary import scores_of

POLICIES = ("ppo", "ppo-shield", "sac", "sac-shield", "straight-line-shield", "clrrt")
YARDSTICK = "clrrt"  # plans row by row, so it flies fewer worlds
FIRST = 20_000_000  # seed of world 0: agents train below 10,000,000 and are chosen on the worlds from there on


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """What to fly, and where the figures go."""

    episodes: int = 1000
    """Worlds a shape."""
    yardstick_episodes: int = 150
    """Worlds a shape for clrrt, the first of the same."""
    policies: tuple[str, ...] = POLICIES
    """Policies that fly batches, named as for `hydrone evaluate`."""
    shapes: tuple[str, ...] = tuple(SHAPES)
    """Shapes by name."""
    seed: int = FIRST
    """Seed of the first world."""
    out: Path = RESULTS
    """Folder of generalisation.json."""


def fly_shape(name: str, source: PolicySource, episodes: int, seed: int) -> dict[str, Any]:
    """One cell: a policy in the worlds of a shape; `failures` by seed."""
    shape = SHAPES[name]
    env = gym.make("HydroneGym/Mission-v0", **shape.options)
    rows = gym.make_vec(SHAPED, num_envs=episodes, vectorization_mode="vector_entry_point", shape=name)
    endings = fly_worlds(rows, source.make(env, 0), seed=seed)
    records = [record_of((name, SHAPED, seed + k, source.label), ending) for k, ending in enumerate(endings)]
    (score,) = scores_of(records)
    del score["mission"]
    return {
        "shape": name,
        "group": shape.group,
        "reference": shape.reference,
        "policy": source.label,
        **score,
        "failures": {str(record.world): record.outcome for record in records if not record.success},
    }


def measure(a: Arguments) -> dict[str, Any]:
    """Fly every policy in every shape; raises ValueError for a name that is not known."""
    unknown = [name for name in a.shapes if name not in SHAPES]
    if unknown:
        raise ValueError(f"no shape {', '.join(map(repr, unknown))}: known are {', '.join(map(repr, SHAPES))}")
    if a.episodes < 1:
        raise ValueError(f"episodes must be at least 1, got {a.episodes}")
    sources, console, cells, began = find_policies(a.policies), Console(stderr=True), [], time.process_time()
    for name in a.shapes:
        for source in sources:
            episodes = min(a.episodes, a.yardstick_episodes) if source.label == YARDSTICK else a.episodes
            cells.append(fly_shape(name, source, episodes, a.seed))
        latest = cells[-len(sources) :]
        console.print(f"{name}: " + ", ".join(f"{c['policy']} {100 * c['success']:.1f} %" for c in latest))
    return {"seed": a.seed, "cpu_seconds": round(time.process_time() - began, 1), "cells": cells}


def main(arguments: Sequence[str] | None = None) -> int:
    given = sys.argv[1:] if arguments is None else list(arguments)
    a = tyro.cli(Arguments, args=given, description=__doc__)
    try:
        measured = measure(a)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    command = shlex.join(["python", "-m", "benchmarks.generalisation", *given])
    path = save("generalisation", command, {"measured": measured}, folder=a.out)
    Console().print(success_sheet(measured))
    print(path)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
