"""How near straight lines come to what is known."""

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym._memory import gather
from hydrone_gym.simulation.storage import Pose
from hydrone_gym.world.bodies import BODY, segment_distance


@inlined
def clearance_between(a, b, lane, first, radius):
    """Least clearance (m) of a vehicle on the straight path between two points (x, y, z), infinite without spheres.

    `lane` is a rollout's: of its obstacles those numbered from `first` on are looked at.
    """
    least = np.inf
    for j in range(first, lane.number):
        least = min(least, segment_distance(a, b, gather(lane.obstacles, BODY * j, 0, 1, Pose)) - radius)
    return least
