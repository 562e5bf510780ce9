"""What an environment with `interface="egocentric"` keeps for its rows besides their episodes."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hydrone_gym.envs.egocentric import OBSERVATION_SIZE, observe_rows, pack_egocentric, place_references
from hydrone_gym.envs.options import Options
from hydrone_gym.envs.task import Episodes


class RowMemory(NamedTuple):
    """`egocentric.Memory` of every row, and the observation it led to."""

    starts: NDArray[np.float64]  # (n, 3)
    least: NDArray[np.float64]  # (n,)
    clock: NDArray[np.float64]  # (n,)
    seen: NDArray[np.float32]  # (n, OBSERVATION_SIZE)


class EgocentricRows:
    """Observations and references of rows seen from the vehicle, each row looked at once a period.

    Args:
        options: of the environment.
        count: number of rows.
    """

    def __init__(self, options: Options, count: int) -> None:
        """Make room for the rows."""
        self._values = pack_egocentric(options.vehicle, options.world)
        self.memory = RowMemory(
            np.zeros((count, 3)),
            np.full(count, np.inf),
            np.zeros(count),
            np.zeros((count, OBSERVATION_SIZE), np.float32),
        )

    def begin(self, episodes: Episodes, rows: NDArray[np.intp]) -> None:
        """Look at rows whose episode begins."""
        self.memory.least[rows] = np.inf
        for row in rows:
            self._look(episodes, row, row + 1)

    def look(self, episodes: Episodes) -> None:
        """Look at every row after a period."""
        self._look(episodes, 0, len(self.memory.least))

    def _look(self, now: Episodes, first: int, last: int) -> None:
        starts, least, clock, seen = self.memory
        observe_rows(now.rows, now.known, now.found, starts, least, clock, self._values, first, last, seen)

    def observation(self) -> NDArray[np.float32]:
        """Return a new array (n, OBSERVATION_SIZE)."""
        return self.memory.seen.copy()

    def references(self, actions: ArrayLike, episodes: Episodes) -> NDArray[np.float64]:
        """Return the references (n, 4) of relative actions (n, 3), which are clipped to [-1, 1].

        Raises ValueError for another shape, or naming the rows that are not finite.
        """
        count = len(self.memory.least)
        wanted = np.ascontiguousarray(actions, np.float32)
        if wanted.shape != (count, 3):
            raise ValueError(f"actions must have shape ({count}, 3), offsets in [-1, 1], got {wanted.shape}")
        finite = np.isfinite(wanted)
        if not finite.all():
            bad = np.flatnonzero(~finite.all(axis=1)).tolist()
            raise ValueError(f"actions must be finite offsets in [-1, 1]; rows {bad} are not")
        out = np.empty((count, 4))
        place_references(episodes.rows, wanted, self.memory.starts, self._values, 0, count, out)
        return out
