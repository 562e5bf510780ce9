"""How near straight lines come to what is known."""

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym.world.bodies import segment_distance


@inlined
def clearance_between(a, b, spheres, first, count, radius):
    """Least clearance (m) of a vehicle on the straight path between two points (m), infinite without spheres.

    `spheres` are flat, x, y, z, r in m; those numbered from `first` up to `count` are looked at.
    """
    least = np.inf
    for j in range(first, count):
        k = 4 * j
        body = (spheres[k], spheres[k + 1], spheres[k + 2], spheres[k + 3])
        least = min(least, segment_distance(a, b, body) - radius)
    return least
