"""What a path costs: seconds, joules, seconds weighed against joules, or metres; and the paper's own rule.

The cost-to-go is the cost of an empty world: the time-to-go, each speed divided by the cost of a second at that speed.
Where joules count, it is the least one: the pace under water and the point to cross at are those that cost least. The
paper's rule only looks at the distance left.
"""

import math
from typing import NamedTuple

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym.control.envelope import Envelope
from hydrone_gym.control.laws import envelope_of
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.simulation.time_to_go import (
    SETTLE_SHARE,
    CruiseSpeeds,
    cruise_speeds,
    heights_of,
    same_medium,
    time_to_go,
)
from hydrone_gym.surface import is_air
from planners.cl_rrt.swimming import Pace, cheapest

OBJECTIVES = ("time", "energy", "length", "paper")
_CARROT_TIME = 1.4  # s of travel ahead under water, where joules do not count: nearly full thrust
_CLIMB_TIME = 1.0  # s the same in height
_CLIMB = 0.6  # m of height an edge of 0.5 s in air may change there
_CLIMB_SHARE = 0.95  # of the limit speed, where joules count: height costs hover power for as long as it takes
_FORWARD, _DOWN, _UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])


class Lead(NamedTuple):
    """How far ahead of a vehicle its reference is laid every period (m): that sets how fast it goes."""

    climb: float  # in air, up or down, from the reference in force
    ahead: float  # under water, toward where it goes
    down: float  # under water
    up: float


class ObjectiveParams(NamedTuple):
    """An objective as the kernels read it."""

    per_second: float
    per_joule: float  # above zero: pace and crossing point are chosen for what they cost
    per_metre: float
    paper: float  # 1: choose the branch closest to the goal and cross where the line to a sample meets the zone
    rates: CruiseSpeeds  # metres for one unit of cost
    speeds: CruiseSpeeds  # m/s
    lead: Lead


def objective_params(simulation: Simulation, objective: str | float) -> ObjectiveParams:
    """Flatten an objective for a vehicle under its law; a number is how many joules a second is worth (W).

    Raises ValueError for an unknown name, and a number that is negative or not finite.
    """
    weight = 0.0 if objective == "energy" else objective
    if isinstance(weight, int | float) and not isinstance(weight, bool) and 0.0 <= weight < math.inf:
        return _weighed(simulation, float(weight))
    if objective not in OBJECTIVES:
        raise ValueError(
            f"objective must be one of {', '.join(map(repr, OBJECTIVES))} or how many joules a second is worth "
            f"(W, finite, not negative), got {objective!r}"
        )
    speeds = cruise_speeds(envelope_of(simulation.vehicle, simulation.law))
    climb = speeds.dive * _CLIMB_TIME
    lead = Lead(_CLIMB * simulation.period / 0.5, speeds.water * _CARROT_TIME, climb, climb)
    if objective == "time":
        return ObjectiveParams(1.0, 0.0, 0.0, 0.0, speeds, speeds, lead)
    one = CruiseSpeeds(1.0, 1.0, 1.0, 1.0, 1.0 / (1.0 - SETTLE_SHARE))
    return ObjectiveParams(0.0, 0.0, 1.0, float(objective == "paper"), one, speeds, lead)


def _weighed(simulation: Simulation, worth: float) -> ObjectiveParams:
    """Weigh joules against seconds that are worth so many joules each (W)."""
    envelope = envelope_of(simulation.vehicle, simulation.law)
    swim, dive, rise = (cheapest(simulation, way, worth) for way in (_FORWARD, _DOWN, _UP))
    speeds = cruise_speeds(envelope)._replace(water=swim.speed)
    lead = Lead(_CLIMB_SHARE * envelope.climb * simulation.period, swim.lead, dive.lead, rise.lead)
    return ObjectiveParams(worth, 1.0, 0.0, 0.0, _rates(envelope, worth, swim, rise), speeds, lead)


def _rates(envelope: Envelope, worth: float, swim: Pace, rise: Pace) -> CruiseSpeeds:
    """Metres a joule in each leg at most; half of the zone lies in water.

    A vehicle that floats rises at less cost than it dives at: both count as the lesser, as a bound from below.
    """
    air = worth + envelope.flight_power
    water, depth = swim.speed / (worth + swim.power), rise.speed / (worth + rise.power)
    zone = 2.0 * envelope.zone / (air + worth + envelope.swim_power)
    return CruiseSpeeds(envelope.cruise / air, envelope.climb / air, water, depth, zone)


@inlined
def flown_part(across, climb, dive, rates):
    """Return how much (m) of a way across is better flown than swum, by what climbing and diving to its ends cost.

    While it climbs or sinks in air the vehicle gets on sideways at no cost, in water while it rises or dives; what is
    left of the way lies in the cheaper medium.
    """
    return min(climb * rates.air, across) if rates.water > rates.air else max(across - dive * rates.water, 0.0)


@inlined
def crossing_point(x, y, z, goal_x, goal_y, goal_z, rates):
    """Return where (x, y in m) to cross on the straight way to a goal in the other medium."""
    dx, dy = goal_x - x, goal_y - y
    across = np.sqrt(dx * dx + dy * dy)
    climb, dive, _ = heights_of(z, goal_z, rates)
    flown = flown_part(across, climb, dive, rates)
    share = (flown if is_air(z) else across - flown) / max(across, 1e-9)
    return x + share * dx, y + share * dy


@inlined
def least_to_go(x, y, z, goal_x, goal_y, goal_z, rates):
    """Return the cost from a position to the goal (m), obstacles not considered, crossing where that costs least."""
    dx, dy = goal_x - x, goal_y - y
    across = np.sqrt(dx * dx + dy * dy)
    climb, dive, inside = heights_of(z, goal_z, rates)
    flown = flown_part(across, climb, dive, rates)
    changing = max(flown / rates.air, climb) + max((across - flown) / rates.water, dive) + inside / rates.zone
    return same_medium(across, z, goal_z, rates) if is_air(z) == is_air(goal_z) else changing


@inlined
def cost_to_go(x, y, z, goal_x, goal_y, goal_z, objective):
    """Return the cost from a position to the goal in an empty world; for the paper's rule the distance (m)."""
    dx, dy, dz = goal_x - x, goal_y - y, goal_z - z
    straight = np.sqrt(dx * dx + dy * dy + dz * dz)
    if objective.per_joule > 0.0:
        legs = least_to_go(x, y, z, goal_x, goal_y, goal_z, objective.rates)
    else:
        legs = time_to_go(x, y, z, goal_x, goal_y, goal_z, objective.rates)
    return straight if objective.paper > 0.0 else legs
