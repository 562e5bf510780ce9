"""What every planner is: a policy with Stable-Baselines3's `predict`, for one observation or a batch."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from planners.belief import Belief, belief_of

Observation = Mapping[str, NDArray]


class Known(NamedTuple):
    """One environment's observation: everything a planner may know."""

    state: NDArray[np.float64]  # (12,)
    integral: NDArray[np.float64]  # (4,) controller memory
    reference: NDArray[np.float64]  # (4,) in force
    goal: NDArray[np.float64]  # (3,)
    obstacles: NDArray[np.float64]  # (k, 4) detected so far

    @property
    def vessel(self) -> NDArray[np.float64]:
        """State, controller memory and reference in force as one vessel, with no energy spent."""
        return np.concatenate([self.state, self.integral, [0.0], self.reference])


KEYS = Known._fields


def whole_number(name: str, value: Any, least: int) -> int:
    """Return a whole number that is large enough; raises ValueError naming it."""
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise ValueError(f"{name} must be a whole number of at least {least}, got {value!r}")
    return value


def known(observation: Observation, index: int | None = None) -> Known:
    """Pick one environment out of an observation and drop the empty obstacle rows.

    Raises ValueError for missing keys or values that are not finite.
    """
    missing = [key for key in KEYS if key not in observation]
    if missing:
        raise ValueError(f"observation lacks {', '.join(missing)}; planners read the interface='world' observation")
    parts = [np.asarray(observation[key], dtype=np.float64, order="C") for key in KEYS]
    if index is not None:
        parts = [np.ascontiguousarray(part[index]) for part in parts]
    for key, part in zip(KEYS, parts, strict=True):
        if not np.isfinite(part).all():
            raise ValueError(f"observation[{key!r}] must be finite, got {part}")
    parts[-1] = np.ascontiguousarray(parts[-1][parts[-1][:, 3] > 0.0])
    return Known(*parts)


class PlannerPolicy:
    """Base of the planners: subclasses take a belief and options, and say what to do for one environment in `act`.

    Memory travels in `state`, one entry an environment, and `act` never changes the memory it is given, so an old
    state can be used again.
    """

    def __init__(self, belief: Belief | Any = None) -> None:
        """Keep what to believe, a `Belief` or any model with vehicle, world and period; None for planners without."""
        self.belief: Any = None if belief is None else Belief.of(belief)

    @classmethod
    def for_env(cls, env: Any, *, belief: Belief | Literal["truth"] | None = None, **options: Any) -> Self:
        """Make a planner for a HyDrone environment or a vector of them.

        Args:
            env: the environment; nothing but its description is read.
            belief: what to predict with instead of the nominal model, see `planners.belief.belief_of`.
            options: keywords of the class.

        Raises:
            TypeError: anything that is not a HyDrone environment, or an option that the class does not have.
        """
        make: Any = cls
        return make(belief_of(env, belief), **options)

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
