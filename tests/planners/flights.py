"""Flying a planner period by period, keeping what tests look at."""

from typing import NamedTuple

import gymnasium as gym
import numpy as np

import hydrone_gym  # noqa: F401  registers the environments


class Cycle(NamedTuple):
    """One period of a flight."""

    snapshot: object
    action: np.ndarray
    memory: object
    state_after: np.ndarray


def make(mission, **options):
    """An environment by the short name of its mission."""
    return gym.make(f"HydroneGym/{mission}-v0", **options)


def fly(env, planner, *, seed=None, scenario=None, snapshots=False, cycles=240):
    """Fly one episode; return its cycles and the last info."""
    options = None if scenario is None else {"scenario": scenario}
    observation, info = env.reset(seed=seed, options=options)
    state, history = None, []
    for k in range(cycles):
        snapshot = env.unwrapped.get_state() if snapshots else None
        action, state = planner.predict(observation, state, np.array([k == 0]))
        observation, _, terminated, truncated, info = env.step(action)
        history.append(Cycle(snapshot, action, state[0], observation["state"].copy()))
        if terminated or truncated:
            break
    return history, info
