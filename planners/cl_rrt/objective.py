"""What a path costs: seconds, joules or metres; and the paper's own rule, which only looks at the distance left.

The cost-to-go is the time-to-go of an empty world with each speed divided by the cost of a second at that speed.
"""

from typing import NamedTuple

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym.control.envelope import Envelope
from hydrone_gym.simulation.time_to_go import SETTLE_SHARE, CruiseSpeeds, cruise_speeds, time_to_go

OBJECTIVES = ("time", "energy", "length", "paper")


class ObjectiveParams(NamedTuple):
    """An objective as the kernels read it."""

    per_second: float
    per_joule: float
    per_metre: float
    paper: float  # 1: choose the branch closest to the goal and cross where the line to a sample meets the zone
    rates: CruiseSpeeds  # metres for one unit of cost
    speeds: CruiseSpeeds  # m/s


def objective_params(envelope: Envelope, objective: str) -> ObjectiveParams:
    """Flatten an objective for a vehicle; raises ValueError for an unknown one."""
    if objective not in OBJECTIVES:
        raise ValueError(f"objective must be one of {', '.join(map(repr, OBJECTIVES))}, got {objective!r}")
    speeds = cruise_speeds(envelope)
    if objective == "time":
        return ObjectiveParams(1.0, 0.0, 0.0, 0.0, speeds, speeds)
    if objective == "energy":
        return ObjectiveParams(0.0, 1.0, 0.0, 0.0, _divided(speeds, envelope.flight_power, envelope.swim_power), speeds)
    one = CruiseSpeeds(1.0, 1.0, 1.0, 1.0, 1.0 / (1.0 - SETTLE_SHARE))
    return ObjectiveParams(0.0, 0.0, 1.0, float(objective == "paper"), one, speeds)


def _divided(speeds: CruiseSpeeds, air: float, water: float) -> CruiseSpeeds:
    """Metres a joule in each leg; the zone is crossed half in air and half in water, and settled in air."""
    mean = 0.5 * (air + water)
    zone = 1.0 / (mean / speeds.zone + (mean - 1.0) * SETTLE_SHARE)
    return CruiseSpeeds(speeds.air / air, speeds.climb / air, speeds.water / water, speeds.dive / water, zone)


@inlined
def cost_to_go(x, y, z, goal_x, goal_y, goal_z, objective):
    """Return the cost from a position to the goal in an empty world; for the paper's rule the distance (m)."""
    dx, dy, dz = goal_x - x, goal_y - y, goal_z - z
    straight = np.sqrt(dx * dx + dy * dy + dz * dz)
    legs = time_to_go(x, y, z, goal_x, goal_y, goal_z, objective.rates)
    return straight if objective.paper > 0.0 else legs
