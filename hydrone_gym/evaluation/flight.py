"""One flight: a policy flies an environment to its end, and everything worth knowing about it is kept."""

import time
from dataclasses import dataclass
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from hydrone_gym.envs.hydrone_env import HydroneEnv
from hydrone_gym.evaluation.policy import Policy
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.simulation import row_at, trajectory
from hydrone_gym.world.scenario import Scenario


class Trace(NamedTuple):
    """A flight sampled every tick (0.05 s), the start included."""

    times: NDArray[np.float64]  # (N,) s
    states: NDArray[np.float64]  # (N, 12) as in the observation
    references: NDArray[np.float64]  # (N, 4) the moving reference: m, m, m, rad


@dataclass(frozen=True, kw_only=True, eq=False)
class Flight:
    """A flown episode.

    Attributes:
        scenario: what was flown.
        outcome: how it ended.
        time: s.
        energy: of the rotors' shafts, J.
        clearance: least distance of the vehicle's sphere to an obstacle, m; infinite without obstacles.
        transitions: a dict for each crossing: time (s), direction, lateral_speed (m/s), tilt (rad),
            vertical_speed (m/s).
        length: of the path, summed over ticks, m.
        episode_return: sum of rewards.
        references: (K, 4) those in force at the end of each period, the action after clipping: m, m, m, rad.
        states: (K + 1, 12) at the start and after each period, as in the observation.
        detected: (k, 4) spheres x, y, z, r in m, in order of detection.
        decision_ms: (K,) wall-clock time of each decision, ms.
        interventions: periods in which a shield flew another reference than proposed; None for a policy whose memory
            does not count them.
        trace: the same flight every tick.
    """

    scenario: Scenario
    outcome: Outcome
    time: float
    energy: float
    clearance: float
    transitions: list[dict[str, Any]]
    length: float
    episode_return: float
    references: NDArray[np.float64]
    states: NDArray[np.float64]
    detected: NDArray[np.float64]
    decision_ms: NDArray[np.float64]
    interventions: int | None
    trace: Trace

    @property
    def undetected(self) -> NDArray[np.float64]:
        """The scenario's other spheres, (m, 4)."""
        known = {tuple(sphere) for sphere in self.detected.tolist()}
        hidden = [sphere for sphere in self.scenario.obstacles.tolist() if tuple(sphere) not in known]
        return np.array(hidden).reshape(-1, 4)


def fly(env: gym.Env, policy: Policy, *, seed: int | None = None, scenario: Scenario | None = None) -> Flight:
    """Fly one episode and return its record.

    Args:
        env: a HyDrone environment with `interface="world"`, wrapped or not.
        policy: chooses the references; its memory is new.
        seed: seeds the environment's random stream.
        scenario: what to fly, None for one that the environment draws.

    Raises:
        TypeError: an environment of another kind.
        ValueError: another interface, or a scenario that this environment cannot fly.
    """
    world = _world_env(env)
    observation, info = env.reset(seed=seed, options=None if scenario is None else {"scenario": scenario})
    states, references, decisions, rewards = [observation["state"]], [], [], []
    memory, start, done = None, np.array([True]), False
    while not done:
        began = time.perf_counter()
        action, memory = policy.predict(observation, state=memory, episode_start=start, deterministic=True)
        decisions.append(1e3 * (time.perf_counter() - began))
        observation, reward, terminated, truncated, info = env.step(action)
        states.append(observation["state"])
        references.append(observation["reference"])
        rewards.append(float(reward))
        start, done = np.array([False]), terminated or truncated
    sent = np.array(references)
    trace = _trace(world, states[0], sent)
    interventions = getattr(memory, "interventions", None)
    return Flight(
        scenario=world.scenario,
        outcome=info["outcome"],
        time=info["time"],
        energy=info["energy"],
        clearance=info["clearance"],
        transitions=info["transitions"],
        length=float(np.linalg.norm(np.diff(trace.states[:, :3], axis=0), axis=1).sum()),
        episode_return=sum(rewards),
        references=sent,
        states=np.array(states),
        detected=observation["obstacles"][observation["obstacles"][:, 3] > 0.0],
        decision_ms=np.array(decisions),
        interventions=None if interventions is None else int(np.sum(interventions)),
        trace=trace,
    )


def _world_env(env: gym.Env) -> HydroneEnv:
    """Return the environment under its wrappers, or say why it cannot be flown."""
    inner = env.unwrapped
    if not isinstance(inner, HydroneEnv):
        raise TypeError(f"fly needs a HyDrone environment, got {type(inner).__name__}")
    if inner.options.interface != "world":
        raise ValueError(f'fly needs an environment with interface="world", got {inner.options.interface!r}')
    return inner


def _trace(env: HydroneEnv, start: NDArray[np.float64], references: NDArray[np.float64]) -> Trace:
    """Play the references again, tick by tick: the same kernel, so the same flight bit for bit."""
    row = row_at(start, np.array(env.scenario.goal))
    obstacles = env.scenario.obstacles.copy()  # read-only arrays would compile the kernel once more
    times, states, moving, _ = trajectory(env.simulation, row, references, obstacles)
    return Trace(times, states, moving)
