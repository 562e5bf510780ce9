"""What worlds are like, so that those an agent fails in can be set against those it masters."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.world.bodies import gaps_along
from hydrone_gym.world.scenario import Scenario

BESIDE_LINE = 1.0  # m from a sphere's surface to the straight line from start to goal
BESIDE_COLUMN = 3.0  # m in plan from a sphere's surface to the column over or under the end in water
MEDIA = ("air to air", "water to water", "air to water", "water to air")


class Features(NamedTuple):
    """Of many worlds, an entry a world."""

    beside_line: NDArray[np.int64]  # (n,) spheres within BESIDE_LINE of the straight line
    beside_column: NDArray[np.int64]  # (n,) spheres in the zone's way within BESIDE_COLUMN; -1 without a crossing
    media: NDArray[np.int64]  # (n,) index in MEDIA


def features_of(scenarios: Iterable[Scenario], reach: float) -> Features:
    """Return the features of worlds.

    The column is that of the end in water, where the time-to-go lets the surface be crossed. A sphere is in the zone's
    way if a vehicle inside the transition zone could touch it: within `reach` of the surface, m.
    """
    rows = []
    for scenario in scenarios:
        start, goal, spheres = np.array(scenario.start[:3]), np.array(scenario.goal), scenario.obstacles
        column = goal if goal[2] < start[2] else start
        beside = np.linalg.norm(spheres[:, :2] - column[:2], axis=1) - spheres[:, 3] <= BESIDE_COLUMN
        in_way = np.abs(spheres[:, 2]) - spheres[:, 3] <= reach
        media = MEDIA.index(" to ".join(scenario.media))
        near = np.sum(gaps_along(start, goal, spheres) <= BESIDE_LINE)
        rows.append((near, np.sum(beside & in_way) if media >= 2 else -1, media))
    return Features(*np.array(rows, np.int64).reshape(-1, 3).T)
