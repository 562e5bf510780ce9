"""How often a policy arrives: many held-out worlds flown at once.

``python -m agents.evaluation --agent ppo`` prints the table of a shipped agent, or of one of yours by its folder.
"""

import dataclasses
import json
import os
import sys
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import gymnasium as gym
import numpy as np
import tyro
from numpy.typing import NDArray

import hydrone_gym  # noqa: F401  (registers the ids)
from agents.agent import load_agent, shipped_agents
from hydrone_gym.evaluation.policies import find_policy, known_policies
from hydrone_gym.evaluation.policies import Policy
from hydrone_gym.evaluation.statistics import wilson_interval
from hydrone_gym.simulation.outcome import Outcome
from planners.shield import Shield

MISSIONS = ("HydroneGym/Mission-v0", "HydroneGym/AirToWater-v0", "HydroneGym/WaterToAir-v0")
HELD_OUT = 10_000_000  # seeds from here on are for evaluation; training uses those below


@dataclass(frozen=True, kw_only=True)
class Score:
    """How the flights of one mission ended.

    Attributes:
        mission: environment id.
        episodes: number of flights, each in a world of its own.
        outcomes: flights an outcome, those that occurred.
        success: share that arrived.
        interval: 95 % Wilson interval of that share.
        time: mean time of those that arrived, s; None if none did.
        energy: mean energy of those that arrived, J; None if none did.
    """

    mission: str
    episodes: int
    outcomes: dict[str, int]
    success: float
    interval: tuple[float, float]
    time: float | None
    energy: float | None


class Ends(NamedTuple):
    """How the flights of many worlds ended, an entry a world."""

    outcome: NDArray[np.int64]  # (n,) an `Outcome`
    time: NDArray[np.float64]  # (n,) s
    energy: NDArray[np.float64]  # (n,) J


def fly_worlds(
    policy: Policy,
    mission: str,
    *,
    episodes: int = 1000,
    seed: int = HELD_OUT,
    options: Mapping[str, Any] | None = None,
) -> Ends:
    """Fly a policy once in each of many worlds, deterministically, all at once.

    Args:
        policy: on the raw interface, for batches.
        mission: environment id.
        episodes: number of worlds; world i is the one a single environment draws from ``seed + i``.
        seed: of the first world.
        options: keyword options of the environment.

    Raises:
        ValueError: no episodes, or an option that the environment refuses.
    """
    if episodes < 1:
        raise ValueError(f"episodes must be at least 1, got {episodes}")
    rows = gym.make_vec(mission, num_envs=episodes, vectorization_mode="vector_entry_point", **(options or {}))
    observation, _ = rows.reset(seed=seed)
    running, memory, starts = np.arange(episodes), None, np.ones(episodes, bool)
    outcome = np.zeros(episodes, np.int64)
    time, energy = np.zeros(episodes), np.zeros(episodes)
    while len(running):
        # rows fly on after their first episode; what they do then does not count, so the policy is spared it
        seen = {key: value[running] for key, value in observation.items()}
        actions = observation["reference"].astype(np.float32)
        actions[running], memory = policy.predict(seen, state=memory, episode_start=starts, deterministic=True)
        observation, _, _, _, info = rows.step(actions)
        outcome[running] = info["outcome"][running]
        time[running], energy[running] = info["time"][running], info["energy"][running]
        on = np.flatnonzero(outcome[running] == Outcome.RUNNING)
        running, memory, starts = running[on], _rows_of(memory, on), np.zeros(len(on), bool)
    rows.close()
    return Ends(outcome, time, energy)


def evaluate(
    policy: Policy,
    mission: str,
    *,
    episodes: int = 1000,
    seed: int = HELD_OUT,
    options: Mapping[str, Any] | None = None,
) -> Score:
    """Fly a policy once in each of many worlds and summarise; arguments and errors are those of `fly_worlds`."""
    return score_of(mission, fly_worlds(policy, mission, episodes=episodes, seed=seed, options=options))


def score_of(mission: str, ends: Ends) -> Score:
    """Summarise flights of one mission, an environment id."""
    arrived = ends.outcome == Outcome.GOAL
    episodes, count = len(arrived), int(arrived.sum())
    return Score(
        mission=mission,
        episodes=episodes,
        outcomes={kind.name: int((ends.outcome == kind).sum()) for kind in Outcome if (ends.outcome == kind).any()},
        success=count / episodes,
        interval=wilson_interval(count, episodes),
        time=float(ends.time[arrived].mean()) if count else None,
        energy=float(ends.energy[arrived].mean()) if count else None,
    )


def evaluate_missions(
    agent: str | os.PathLike[str],
    *,
    shield: bool,
    episodes: int = 1000,
    options: Mapping[str, Any] | None = None,
) -> list[Score]:
    """Fly an agent, behind the shield or alone, in held-out worlds of every mission; arguments as in `evaluate`.

    Raises what `policy_for` and `evaluate` raise.
    """
    scores = []
    for mission in MISSIONS:
        policy = policy_for(agent, gym.make(mission, **(options or {})), shield=shield)
        scores.append(evaluate(policy, mission, episodes=episodes, options=options))
    return scores


def policy_for(agent: str | os.PathLike[str], env: Any, *, shield: bool) -> Policy:
    """Return an agent for an environment, behind the shield or alone.

    `agent` may also be a registered policy that flies batches, such as "straight-line". Raises what `load_agent` does.
    """
    registered = agent in known_policies() and agent not in shipped_agents()
    loaded = find_policy(str(agent)).make(env, 0) if registered else load_agent(agent, env)
    return Shield.for_env(loaded, env) if shield else loaded


def _rows_of(memory: Any, rows: NDArray[np.intp]) -> Any:
    """Pick rows out of a policy's memory: arrays, tuples with an entry a row, and named tuples of such things."""
    if memory is None:
        return None
    if hasattr(memory, "_fields"):
        return type(memory)(*(_rows_of(part, rows) for part in memory))
    if isinstance(memory, np.ndarray):
        return memory[rows]
    return tuple(memory[row] for row in rows)


def score_table(scores: Sequence[Score]) -> str:
    """Return scores as a Markdown table."""
    lines = ["| mission | worlds | success % | 95 % interval | time (s) | failures |", "|---|---|---|---|---|---|"]
    for score in scores:
        low, high = (100.0 * end for end in score.interval)
        failures = ", ".join(f"{name} {n}" for name, n in score.outcomes.items() if name != "GOAL") or "none"
        time = "-" if score.time is None else f"{score.time:.1f}"
        lines.append(
            f"| {score.mission} | {score.episodes} | {100.0 * score.success:.2f} | {low:.2f}–{high:.2f} | {time} | "
            f"{failures} |"
        )
    return "\n".join(lines)


@dataclass(frozen=True, kw_only=True)
class HeldOutWorlds(ABC):
    """What a command flies: an agent, once in each of many held-out worlds of every mission."""

    agent: str
    """Name of a shipped agent, or a folder; for comparison also a registered policy such as straight-line."""
    shield: bool = False
    """Fly behind the shield."""
    episodes: int = 4000
    """Worlds a mission."""
    obstacles: int = 20
    """Number of spheres."""
    radii: tuple[float, float] = (0.5, 1.5)
    """Least and greatest radius of a sphere, m."""
    vehicle: Literal["paper", "physical"] = "paper"
    """Parameter set of the vehicle."""

    @property
    def options(self) -> dict[str, Any]:
        """Keyword options of the environment."""
        return {"num_obstacles": self.obstacles, "obstacle_radius": self.radii, "vehicle": self.vehicle}

    @abstractmethod
    def text(self) -> str:
        """Do what the command is for and return what is printed."""


@dataclass(frozen=True, kw_only=True)
class Evaluation(HeldOutWorlds):
    """Fly an agent once in each of many held-out worlds, deterministically, and print how the flights ended."""

    json: bool = False
    """Print JSON instead of the Markdown table."""

    def text(self) -> str:
        """Fly and return what is printed; raises as `evaluate_missions` does."""
        scores = evaluate_missions(self.agent, shield=self.shield, episodes=self.episodes, options=self.options)
        return json.dumps([dataclasses.asdict(score) for score in scores]) if self.json else score_table(scores)


def run_command(kind: type[HeldOutWorlds], name: str, arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code, 2 for bad input; `arguments` default to those of the process."""
    command = tyro.cli(kind, args=arguments, config=(tyro.conf.FlagCreatePairsOff,))
    try:
        print(command.text())
    except (ValueError, TypeError, OSError) as error:
        print(f"{name}: error: {error}", file=sys.stderr)
        return 2
    return 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Evaluate an agent as the arguments say; see `run_command`."""
    return run_command(Evaluation, "evaluation", arguments)


if __name__ == "__main__":
    sys.exit(main())
