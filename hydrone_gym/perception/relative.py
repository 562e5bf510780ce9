"""Relative actions: the mission frame, and references as offsets from the vehicle in it.

Why as it is, and the frame: `hydrone_gym.perception.egocentric`.
"""

import numpy as np

from hydrone_gym._jit import inlined, kernel
from hydrone_gym.control.laws import envelope_of
from hydrone_gym.simulation.time_to_go import CruiseSpeeds, cruise_speeds
from hydrone_gym.surface import is_air
from hydrone_gym.vehicle import Vehicle
from hydrone_gym.world.world import World

STEP = (2.0, 2.0, 1.5)  # m along x', y', z at full action: 3.2 m at most, about as far as the vehicle senses
MARGIN = 0.2  # m: the nearest a reference comes to the box

_SPEEDS = np.dtype([(name, np.float64) for name in CruiseSpeeds._fields])
_BOX = ("x_min", "y_min", "z_min", "x_max", "y_max", "z_max", "zone", "radius")  # m
EGOCENTRIC = np.dtype([*((name, np.float64) for name in _BOX), ("speeds", _SPEEDS)])


def pack_egocentric(vehicle: Vehicle, world: World, law: str = "paper") -> np.ndarray:
    """Return the constants of the interface as one record (1,), dtype `EGOCENTRIC`."""
    speeds = tuple(cruise_speeds(envelope_of(vehicle, law)))
    return np.array([(*world.lower, *world.upper, world.zone, vehicle.radius, speeds)], EGOCENTRIC)


@inlined
def mission_frame(start_x, start_y, goal_x, goal_y):
    """Cosine and sine of the azimuth of x'; of the world's x where start and goal (m) give none."""
    dx, dy = goal_x - start_x, goal_y - start_y
    length = np.sqrt(dx * dx + dy * dy)
    level = 1e-6 <= length < np.inf
    return (dx / length if level else 1.0), (dy / length if level else 0.0)


@inlined
def _inside(value, low, high):
    """Keep a coordinate (m) MARGIN inside two walls, as float32 would; NaN stays NaN."""
    low, high = low + MARGIN, high - MARGIN
    return np.float64(np.float32(low if value < low else (high if value > high else value)))


@inlined
def _unit(value):
    """Clip to [-1, 1]; NaN stays NaN."""
    return -1.0 if value < -1.0 else (1.0 if value > 1.0 else value)


@kernel
def place_references(told, actions, memory, values, out):
    """Turn relative actions into references.

    Args:
        told: (n,) as in `Perceived`.
        actions: (n, 3) float32 offsets in the mission frame, clipped to [-1, 1].
        memory: (n, 3 or more) where the episodes started, x, y, z in m.
        values: from `pack_egocentric`.
        out: (n, 4) float64 m, m, m, rad, written; every number is a float32.
    """
    p = values[0]
    for n in range(out.shape[0]):
        row = told[n]
        s, goal = row.state, row.goal
        cosine, sine = mission_frame(memory[n, 0], memory[n, 1], goal[0], goal[1])
        ahead = STEP[0] * _unit(np.float64(actions[n, 0]))
        left = STEP[1] * _unit(np.float64(actions[n, 1]))
        out[n, 0] = _inside(s[0] + (cosine * ahead - sine * left), p.x_min, p.x_max)
        out[n, 1] = _inside(s[1] + (sine * ahead + cosine * left), p.y_min, p.y_max)
        out[n, 2] = _inside(s[2] + STEP[2] * _unit(np.float64(actions[n, 2])), p.z_min, p.z_max)
        out[n, 3] = np.float64(np.float32(row.reference[3] if is_air(s[2]) else s[5]))
