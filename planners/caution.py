"""How much planner and shield keep away from what they know, by the level of the weather they are to be ready for."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.weather.weather import LEVELS
from planners.belief import Belief
from planners.check import MARGIN
from planners.tube import NO_TUBE, tube_of

_TAKEN = 5.0  # s to be through the zone and get away from what a current pushes to
_TURNED = 2.5  # s to be turned so far that thrust takes effect: who is nearer to a wall may be carried into it
_NEAR_GOALS = 0.75  # m: more would keep vehicles from goals, which lie 1 m from walls, see `check.inside`
_TUNED = 3.0  # the level whose margins were tried; those of others are in proportion


class Caution(NamedTuple):
    """What a planner keeps away from: in still weather, or more in weather, where it is not where it believes to be."""

    margin: float  # clearance (m) that the shield keeps
    edge_margin: float  # the CL-RRT along its edges
    rest_margin: float  # and at their stops
    room: float  # from the walls, m; references 0.1 m more
    crossing_speed: float  # lateral limit of crossings that are planned, m/s; rough is 0.2
    crossing_tilt: float  # rad; rough is 5 degrees
    drift: float  # m from the walls that crossings keep: as far as a current carries a vehicle until it swims
    tube: NDArray[np.float64] = NO_TUBE  # (3, TUBE_LENGTH) m, what stops keep besides, by place and time of the look


def caution_at(level: Any) -> Caution:
    """Return what to keep at a level of weather, 0 for none; raises ValueError for what is no level.

    A vehicle that leans against wind, or drifts in a current, cannot cross as smoothly as one in still weather.
    """
    if isinstance(level, bool) or not isinstance(level, int) or not 0 <= level < len(LEVELS):
        raise ValueError(f"level must be a whole number from 0 to {len(LEVELS) - 1}, got {level!r}")
    if level == 0:
        return Caution(MARGIN, 0.12, MARGIN, 0.0, 0.1, math.radians(2.0), 0.0)
    share, current = level / _TUNED, LEVELS[level].current
    margins = (MARGIN + 0.15 * share, 0.12 + 0.13 * share, MARGIN + 0.07 * share)
    return Caution(*margins, min(_TURNED * current, _NEAR_GOALS), 0.15, math.radians(4.5), _TAKEN * current)


def caution_for(belief: Belief, level: Any, promise: float | None = None) -> Caution:
    """Return what to keep at a level, with stops that keep the tube of a promise instead of margins that were tried.

    Raises ValueError for what is no level, for a promise without one, and for one that no tube can tell.
    """
    caution = caution_at(level)
    if promise is None:
        return caution
    if level == 0:
        raise ValueError(f"promise needs a level of weather from 1 to {len(LEVELS) - 1} to be measured in, got level=0")
    return caution._replace(margin=MARGIN, rest_margin=MARGIN, tube=tube_of(belief, level).at(promise))


CALM = caution_at(0)
