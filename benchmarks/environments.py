"""Environments as contestants: what is measured is `step`, resets and the drawing of actions included.

Two ways of driving: "near" sends references within 1.5 m of the vehicle, a random walk that ends at a wall or an
obstacle; "uniform" sends references anywhere in the action space, between which the vehicle hovers about. Episodes last
as long as under a policy or longer, so beginning one is a small share of the work; tables say how many there were.
Every row counts as one environment step a call, except where that call only began its next episode.
"""

from collections import Counter
from typing import Any

import gymnasium as gym
import numpy as np

import hydrone_gym
from benchmarks.timing import Contestant

ID = "HydroneGym/Mission-v0"
REACH = 1.5  # m: how far from the vehicle "near" references lie, each axis
DRAWN = 64  # actions drawn beforehand, used in turn


class Flights:
    """Counts of what happened, so that a rate can be read for what it is."""

    def __init__(self) -> None:
        self.steps = 0
        self.outcomes: Counter[str] = Counter()

    def report(self) -> dict[str, Any]:
        """Steps, episodes, mean length in steps, and the share of steps spent beginning an episode."""
        episodes = self.outcomes.total()
        length = self.steps / episodes if episodes else float("nan")
        return {"steps": self.steps, "episodes": episodes, "mean_length": length, "outcomes": dict(self.outcomes)}


def has_vector_env() -> bool:
    """Whether the ids offer a native vector env."""
    return gym.spec(ID).vector_entry_point is not None


def has_egocentric() -> bool:
    """Whether the learner's interface exists."""
    try:
        make_vector(1, "egocentric").close()
    except ValueError:
        return False
    return True


def pendulum() -> Contestant:
    """What the API itself allows: Gymnasium's own small environment, with its default wrappers."""
    env = gym.make("Pendulum-v1")
    env.reset(seed=0)
    actions = list(np.random.default_rng(0).uniform(-2.0, 2.0, (DRAWN, 1)).astype(np.float32))

    def run() -> float:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        return DRAWN

    return Contestant("Pendulum-v1", run)


def single(driving: str, name: str, interface: str = "world") -> tuple[Contestant, Flights]:
    """One env from `gym.make`, default wrappers."""
    env = gym.make(ID, interface=interface)
    space: Any = env.action_space
    rng = np.random.default_rng(0)
    drawn = rng.uniform(space.low, space.high, (DRAWN, *space.shape)).astype(np.float32)
    offsets = rng.uniform(-REACH, REACH, (DRAWN, 3)).astype(np.float32)
    observation: Any = env.reset(seed=0)[0]
    flights = Flights()

    def run() -> float:
        nonlocal observation
        for action, offset in zip(drawn, offsets, strict=True):
            if driving == "near":
                action[:3] = observation["state"][:3] + offset
            observation, _, terminated, truncated, info = env.step(action)
            if terminated or truncated:
                flights.outcomes[info["outcome"].name] += 1
                observation = env.reset()[0]
        flights.steps += DRAWN
        return DRAWN

    return Contestant(name, run), flights


def make_vector(
    count: int, interface: str = "world", threads: int | None = None, weather: int = 0, controller: str = "paper"
) -> Any:
    """A native vector env; `threads`, `weather` and `controller` only where they are asked for."""
    options: dict[str, Any] = {} if threads is None else {"threads": threads}
    options |= {"weather": weather} if weather else {}
    options |= {"controller": controller} if controller != "paper" else {}
    return gym.make_vec(ID, num_envs=count, vectorization_mode="vector_entry_point", interface=interface, **options)


def vector(
    count: int,
    driving: str,
    name: str,
    interface: str = "world",
    threads: int | None = None,
    weather: int = 0,
    controller: str = "paper",
) -> tuple[Contestant, Flights]:
    """A native vector env in its default autoreset mode."""
    env = make_vector(count, interface, threads, weather, controller)
    space: Any = env.single_action_space
    rng = np.random.default_rng(0)
    drawn = rng.uniform(space.low, space.high, (DRAWN, count, *space.shape)).astype(np.float32)
    offsets = rng.uniform(-REACH, REACH, (DRAWN, count, 3)).astype(np.float32)
    observation: Any = env.reset(seed=0)[0]
    flights = Flights()
    turns = max(1, DRAWN * 16 // max(count, 16))  # the same number of steps a call, more or less
    names = {int(member): member.name for member in hydrone_gym.Outcome}
    state = {"k": 0, "idle": 0}

    def run() -> float:
        nonlocal observation
        steps = 0
        for _ in range(turns):
            k = state["k"] = (state["k"] + 1) % DRAWN
            if driving == "near":
                drawn[k, :, :3] = observation["state"][:, :3] + offsets[k]
            observation, _, terminated, truncated, info = env.step(drawn[k])
            steps += count - state["idle"]  # NEXT_STEP: a row that has ended spends the next call on its reset
            ended = terminated | truncated
            state["idle"] = int(np.count_nonzero(ended))
            if state["idle"]:
                flights.outcomes.update(names[int(value)] for value in np.asarray(info["outcome"])[ended])
        flights.steps += steps
        return steps

    return Contestant(name, run), flights
