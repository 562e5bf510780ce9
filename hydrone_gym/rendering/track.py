"""What has been flown, at every tick, for pictures: kept as what was sent and played again only when it is drawn."""

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.simulation.simulation import Simulation, trajectory

Ticks = NDArray[np.float64]  # (N, 16) a row a tick: state (12), and reference x, y, z in m and yaw in rad (4)


class Track:
    """The flight of one vehicle from where it was first seen.

    Args:
        row: (1,) dtype `ROW`: where it begins; copied.
        obstacles: (M, 4) spheres x, y, z, r in m.
    """

    def __init__(self, row: np.ndarray, obstacles: NDArray[np.float64]) -> None:
        """Begin."""
        self.goal: NDArray[np.float64] = row["goal"][0].copy()
        self.obstacles = np.array(obstacles, dtype=np.float64)
        self._parts: list[Ticks] = [np.concatenate((row["state"][0], row["reference"][0]))[None]]
        self._waiting: list[tuple[np.ndarray, NDArray[np.float64]]] = []

    def add(self, row: np.ndarray, reference: NDArray[np.float64]) -> None:
        """Note a period about to be flown: the row (1,) before it and the reference (4,) sent; both are copied."""
        self._waiting.append((row.copy(), reference.copy()))

    def ticks(self, simulation: Simulation) -> Ticks:
        """Return every tick so far, the start included; the same kernel gives the same numbers as the flight itself.

        Args:
            simulation: of the flight's vehicle, world and period, with one lane.
        """
        for row, reference in self._waiting:
            _, states, references, _ = trajectory(simulation, row, reference[None], self.obstacles)
            self._parts.append(np.hstack((states, references))[1:])
        self._waiting = []
        self._parts = [np.concatenate(self._parts)]
        return self._parts[0]

    def copy(self) -> "Track":
        """Return a track that goes on by itself; arrays are shared, as none is ever changed."""
        twin = Track.__new__(Track)
        twin.goal, twin.obstacles = self.goal, self.obstacles
        twin._parts, twin._waiting = self._parts.copy(), self._waiting.copy()
        return twin
