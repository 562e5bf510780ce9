"""Time to go: how long the vehicle would need to the goal in an empty world, in seconds.

The environment's progress reward and the planner's cost-to-go are this one estimate. Water is the slow medium, so the
surface is crossed in the column of whichever end lies in water.
"""

from typing import NamedTuple

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym.control.envelope import Envelope
from hydrone_gym.surface import is_air

GATE = 1.1  # m: crossings begin and end this far from the surface
_SETTLE = 2.0  # s: coming to rest above or below the surface before a crossing
SETTLE_SHARE = _SETTLE / (2.0 * GATE)  # s/m: that time spread over the height of a crossing
_CRUISE = 0.9  # share of the limit speed that a flight with turns and stops averages


class CruiseSpeeds(NamedTuple):
    """Speeds (m/s) the vehicle reaches under its controller."""

    air: float
    climb: float
    water: float
    dive: float
    zone: float


def cruise_speeds(envelope: Envelope) -> CruiseSpeeds:
    """Return the speeds that flights average, from the limits of a law."""
    limits = envelope.cruise, envelope.climb, envelope.surge, envelope.dive
    return CruiseSpeeds._make([*(_CRUISE * limit for limit in limits), envelope.zone])


@inlined
def same_medium(across, z, goal_z, speeds):
    """Return what a way across (m) takes within one medium, while it climbs or dives."""
    climbing = abs(goal_z - z)
    same_air = max(across / speeds.air, climbing / speeds.climb)
    same_water = max(across / speeds.water, climbing / speeds.dive)
    return same_air if is_air(z) else same_water


@inlined
def heights_of(z, goal_z, speeds):
    """Return what climbing to the gate in air and diving to that in water take, and how far (m) a crossing goes."""
    from_air = is_air(z)
    air_height = z if from_air else goal_z
    water_height = goal_z if from_air else z
    climb = max(air_height - GATE, 0.0) / speeds.climb
    dive = max(-GATE - water_height, 0.0) / speeds.dive
    return climb, dive, min(air_height, GATE) - max(water_height, -GATE)


@inlined
def time_to_go(x, y, z, goal_x, goal_y, goal_z, speeds):
    """Return the time in s from a position to the goal (m), media and crossing considered, obstacles not."""
    dx, dy = goal_x - x, goal_y - y
    across = np.sqrt(dx * dx + dy * dy)
    # changing medium: lateral flight and climbing in air overlap, then the crossing, then the leg in water
    climb, dive, inside = heights_of(z, goal_z, speeds)
    changing = max(across / speeds.air, climb) + dive + inside * (1.0 / speeds.zone + SETTLE_SHARE)
    return same_medium(across, z, goal_z, speeds) if is_air(z) == is_air(goal_z) else changing
