"""Why a planner waits, where the balance of forces forbids what the mission asks for.

Judged by the estimated disturbance alone, steady, and the nominal vehicle; `python -m benchmarks.weather_limits` has
the same balance for each level of weather.
"""

import math

from hydrone_gym.physics.parameters import vehicle_params
from hydrone_gym.simulation.conditions import Steady
from hydrone_gym.surface import in_air
from hydrone_gym.vehicle import Vehicle
from planners.belief import Belief
from planners.caution import Caution
from planners.disturbance import Sight


def holding_tilt(vehicle: Vehicle, wind: float, rotors: float = 0.0) -> float:
    """Tilt (rad) whose lateral lift balances the drag of the hull in a wind (m/s), and a drag of rotors (N)."""
    air = vehicle_params(vehicle).air
    return math.atan((rotors + air.drag_x / air.inverse_mass * wind * wind) / air.weight)


def refusal(belief: Belief, caution: Caution, sight: Sight | None, goal_height: float) -> str | None:
    """Return what cannot be done where a vehicle is, with the figure and its limit; None if forces do not forbid it.

    Args:
        belief: the `Belief`.
        caution: what planned crossings keep.
        sight: what the estimator remembers; None in still weather.
        goal_height: of the goal, m.
    """
    if sight is None:
        return None
    found = Steady(*sight.estimate)
    wind, current = math.hypot(found.wind_x, found.wind_y), math.hypot(found.water_x, found.water_y)
    if not in_air(sight.state[2]):
        fastest = belief.envelope.surge
        if current <= fastest:
            return None
        return (
            f"cannot hold its place under water: {current:.2f} m/s of current, the vehicle swims at {fastest:.2f} m/s"
        )
    if in_air(goal_height):
        return None
    tilt = holding_tilt(belief.vehicle, wind)
    if tilt > caution.crossing_tilt:
        allowed = f"{math.degrees(caution.crossing_tilt):.1f} degrees of tilt"
        return f"cannot keep still at the surface: {wind:.1f} m/s of wind take {math.degrees(tilt):.1f}, not {allowed}"
    rough = belief.world.rough_speed
    if belief.law == "paper" and current > rough:
        return f"cannot enter smoothly over ground: {current:.2f} m/s of current, {rough:g} m/s are rough"
    return None
