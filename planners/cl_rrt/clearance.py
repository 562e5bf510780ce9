"""How near straight lines come to what is known."""

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym.world.obstacles import swept_distance


@inlined
def clearance_between(work, a, b, first, radius):
    """Least clearance (m) of the straight path between two points from the known obstacles, from the first given on."""
    least = np.inf
    for j in range(first, work.closest.size):
        o = 4 * j
        distance = swept_distance(
            a[0],
            a[1],
            a[2],
            b[0],
            b[1],
            b[2],
            work.obstacles[o],
            work.obstacles[o + 1],
            work.obstacles[o + 2],
            work.obstacles[o + 3],
        )
        least = min(least, distance - radius)
    return least
