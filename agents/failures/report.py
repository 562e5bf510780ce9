"""Where and why an agent fails, in words and figures.

``python -m agents.failures --agent ppo --out failures`` flies the held-out worlds of every mission, flies those that
failed once more with everything kept, and writes what it finds to a folder. docs/failures.md explains the columns.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from tqdm import tqdm

from agents.evaluation import (
    HELD_OUT,
    MISSIONS,
    Ends,
    HeldOutWorlds,
    fly_worlds,
    policy_for,
    run_command,
    score_of,
    score_table,
)
from agents.failures.causes import Failure, examine
from agents.failures.figures import draw_how, draw_where, draw_worlds
from agents.failures.flights import fly_again
from agents.failures.tables import failure_tables, write_failures
from agents.failures.worlds import features_of
from hydrone_gym.evaluation.policies import Policy
from hydrone_gym.rendering.style import DOTS_PER_INCH
from hydrone_gym.simulation.outcome import Outcome


def find_failures(
    policy: Policy,
    mission: str,
    *,
    episodes: int = 1000,
    seed: int = HELD_OUT,
    options: Mapping[str, Any] | None = None,
) -> tuple[Ends, list[Failure]]:
    """Fly a policy in many worlds of a mission, and those where it failed once more, singly.

    Args and errors as in `agents.evaluation.fly_worlds`; also ValueError for a policy that flies otherwise alone.

    Returns:
        How all flights ended, and the failures in order of their seeds.
    """
    ends = fly_worlds(policy, mission, episodes=episodes, seed=seed, options=options)
    env = gym.make(mission, **(options or {}))
    world: Any = env.get_wrapper_attr("world")
    failures = []
    for row in tqdm(np.flatnonzero(ends.outcome != Outcome.GOAL), desc=mission, unit="flight", disable=None):
        flown = fly_again(env, policy, mission, seed + int(row), Outcome(ends.outcome[row]))
        failures.append(examine(flown, world))
    return ends, failures


@dataclass(frozen=True, kw_only=True)
class FailureReport(HeldOutWorlds):
    """Fly an agent in many held-out worlds, and say where and why it fails: tables, failures.csv and figures."""

    out: Path
    """Folder to write to."""

    def text(self) -> str:
        """Fly, write everything to the folder and return the tables; raises as `find_failures` and `policy_for` do."""
        self.out.mkdir(parents=True, exist_ok=True)
        scores, failures, worlds = [], [], []
        for mission in MISSIONS:
            env = gym.make(mission, **self.options)
            policy = policy_for(self.agent, env, shield=self.shield)
            ends, failed = find_failures(policy, mission, episodes=self.episodes, options=self.options)
            scores.append(score_of(mission, ends))
            failures += failed
            seeds = np.arange(HELD_OUT, HELD_OUT + self.episodes)
            worlds.append((mission, features_of(env, seeds), ends.outcome == Outcome.GOAL))
        world: Any = env.get_wrapper_attr("world")
        figures = {
            "where": draw_where(failures, MISSIONS, world),
            "how": draw_how(failures),
            "worlds": draw_worlds(worlds),
        }
        for name, figure in figures.items():
            figure.savefig(self.out / f"failures-{name}.png", dpi=DOTS_PER_INCH)
        write_failures(failures, self.out / "failures.csv")
        text = f"{score_table(scores)}\n\n{failure_tables(failures, scores)}"
        (self.out / "failures.md").write_text(text + "\n", encoding="utf-8")
        return text


def main(arguments: Sequence[str] | None = None) -> int:
    """Report the failures of an agent as the arguments say; see `agents.evaluation.run_command`."""
    return run_command(FailureReport, "failures", arguments)
