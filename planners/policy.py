"""What every planner is: a policy with Stable-Baselines3's `predict`, for one observation or a batch."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.simulation.simulation import Simulation

Observation = Mapping[str, NDArray]
KEYS = ("state", "integral", "reference", "goal", "obstacles")


class Known(NamedTuple):
    """One environment's observation: everything a planner may know."""

    state: NDArray[np.float64]  # (12,)
    integral: NDArray[np.float64]  # (4,) controller memory
    reference: NDArray[np.float64]  # (4,) in force
    goal: NDArray[np.float64]  # (3,)
    obstacles: NDArray[np.float64]  # (k, 4) detected so far


def simulation_of(env: Any) -> Simulation:
    """Return the `Simulation` of an environment, wrapped or not, or of the first one in a vector of them.

    Raises TypeError for anything that is not a HyDrone environment.
    """
    first = env.envs[0] if hasattr(env, "envs") else env
    simulation = getattr(getattr(first, "unwrapped", first), "simulation", None)
    if not isinstance(simulation, Simulation):
        raise TypeError(f"for_env needs a HyDrone environment or a vector of them, got {type(env).__name__}")
    return simulation


def known(observation: Observation, index: int | None = None) -> Known:
    """Pick one environment out of an observation and drop the empty obstacle rows.

    Raises ValueError for missing keys or values that are not finite.
    """
    missing = [key for key in KEYS if key not in observation]
    if missing:
        raise ValueError(f"observation lacks {', '.join(missing)}; planners read the interface='world' observation")
    parts = [np.asarray(observation[key], dtype=np.float64) for key in KEYS]
    if index is not None:
        parts = [part[index] for part in parts]
    for key, part in zip(KEYS, parts, strict=True):
        if not np.isfinite(part).all():
            raise ValueError(f"observation[{key!r}] must be finite, got {part}")
    parts[-1] = np.ascontiguousarray(parts[-1][parts[-1][:, 3] > 0.0])
    return Known(*parts)


class PlannerPolicy:
    """Base of the planners: subclasses say what to do for one environment in `act`.

    Memory travels in `state`, one entry an environment, and `act` never changes the memory it is given, so an old
    state can be used again.
    """

    def act(self, now: Known, memory: Any) -> tuple[NDArray[np.float64], Any]:
        """Return the reference (4,) for the next period and the new memory; memory is None when an episode starts."""
        raise NotImplementedError(f"{type(self).__name__} must define act(now, memory)")

    def predict(
        self,
        observation: Observation,
        state: Sequence[Any] | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.float32], tuple[Any, ...]]:
        """Return references for one observation or a batch, in Stable-Baselines3's form.

        Args:
            observation: Dict observation of `interface="world"`, single or batched along the first axis.
            state: what the last call returned, None at the start.
            episode_start: (n,) True where an episode begins: that memory is dropped.
            deterministic: planners always are; accepted for the interface's sake.

        Returns:
            Actions, (4,) or (n, 4) float32 (m, m, m, rad), and the new state: one memory an environment.
        """
        single = np.ndim(observation["state"]) == 1
        count = 1 if single else len(observation["state"])
        memories = [None] * count if state is None else list(state)
        if len(memories) != count:
            raise ValueError(f"state holds {len(memories)} memories for {count} observations")
        starts = np.zeros(count, bool) if episode_start is None else np.atleast_1d(episode_start)
        actions = np.empty((count, 4), np.float32)
        for index in range(count):
            now = known(observation, None if single else index)
            actions[index], memories[index] = self.act(now, None if starts[index] else memories[index])
        return (actions[0] if single else actions), tuple(memories)
