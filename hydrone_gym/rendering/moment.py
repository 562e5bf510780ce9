"""What a picture shows: a mission at one moment, or at each of its earlier ones."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.rendering.track import Ticks
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.simulation import TICK

_SLACK = 1e-3  # m: ticks are samples, sensing is continuous


class Moment(NamedTuple):
    """A mission at a moment."""

    ticks: Ticks  # (N, 16) flown so far, the last one now
    goal: NDArray[np.float64]  # (3,) m
    obstacles: NDArray[np.float64]  # (M, 4) x, y, z, r in m
    detected: NDArray[np.bool_]  # (M,)
    time: float  # s
    outcome: Outcome


def replay(last: Moment, counts: Iterable[int], sensor_range: float) -> Iterator[Moment]:
    """Yield earlier moments of a mission, those at which so many of its ticks had been flown.

    Args:
        last: the mission now.
        counts: numbers of ticks, the start included, from 1 to all.
        sensor_range: distance (m) at which a surface is detected. What has been detected without having come so near
            was known from the start.
    """
    middles, radii = last.obstacles[:, :3], last.obstacles[:, 3]
    distances = np.linalg.norm(last.ticks[:, None, :3] - middles, axis=2) - radii
    since = np.argmax(distances <= sensor_range + _SLACK, axis=0)
    total = len(last.ticks)
    for count in counts:
        if count == total:
            yield last
            continue
        yield last._replace(
            ticks=last.ticks[:count],
            detected=last.detected & (since < count),
            time=last.time - (total - count) * TICK,
            outcome=Outcome.RUNNING,
        )
