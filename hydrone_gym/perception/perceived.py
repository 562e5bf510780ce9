"""What is perceived of many rows: the vehicle as it is told, and the obstacles detected so far.

An obstacle is detected once its surface has been within the sensor's range, and stays known. The simulation already
keeps the least distance of each episode to each obstacle, swept over the whole path, so detection is a comparison:
nothing is missed between two periods, however fast the vehicle flies.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import inlined

TOLD = ("state", "integral", "reference", "goal")


class Perceived(NamedTuple):
    """What a policy is told of n vehicles; kernels take it whole.

    The four quantities of `TOLD` share one record a row, as in the simulation's rows: an array of each would have
    another memory layout for a single row, and with it another compiled version of every kernel.
    """

    told: np.ndarray  # (n,) records with the fields `TOLD`
    obstacles: NDArray[np.float64]  # (n, M, 4) detected spheres x, y, z, r in m, in order; zero rows after
    found: NDArray[np.int64]  # (n,) how many

    @property
    def state(self) -> NDArray[np.float64]:
        """(n, 12) position (m), Euler angles (rad), velocity (m/s), body rates (rad/s)."""
        return self.told["state"]

    @property
    def integral(self) -> NDArray[np.float64]:
        """(n, 4) the controller's memory."""
        return self.told["integral"]

    @property
    def reference(self) -> NDArray[np.float64]:
        """(n, 4) the reference in force, m and rad."""
        return self.told["reference"]

    @property
    def goal(self) -> NDArray[np.float64]:
        """(n, 3) m."""
        return self.told["goal"]

    def observation(self) -> dict[str, NDArray[np.float64]]:
        """Return the raw observation of all rows; it shares this memory."""
        return {**{key: self.told[key] for key in TOLD}, "obstacles": self.obstacles}


def perceive(rows: np.ndarray, known: NDArray[np.float64], found: NDArray[np.int64]) -> Perceived:
    """Return what perfect senses tell of rows (n,), dtype `ROW`: the truth, in the very same memory.

    `known` (n, M, 4) and `found` (n,) are the spheres that `detect` keeps, and their number.
    """
    return Perceived(rows[list(TOLD)], known, found)


@inlined
def detect(now, n, lanes, sensor_range):
    """Append what row n has newly detected, within `sensor_range` (m), to its known spheres, ties of a period by index.

    `now` has `obstacles` and `closest`, `lanes` rows a block as in the simulation, and `seen` (rows, M), 1 if detected,
    `found` (rows,) and `known` (rows, M, 4), which are updated; all in m.
    """
    block, lane = n // lanes, n % lanes
    for j in range(now.seen.shape[1]):
        if now.seen[n, j] == 0 and now.closest[block, j * lanes + lane] <= sensor_range:
            now.seen[n, j] = 1
            slot = now.found[n]
            now.found[n] = slot + 1
            for c in range(4):
                now.known[n, slot, c] = now.obstacles[block, (4 * j + c) * lanes + lane]
