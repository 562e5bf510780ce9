"""Rays: how far the vehicle could move in a direction before it met a known sphere or a wall of the box.

Spheres are inflated by the vehicle's radius, so a ray is the way of its centre. The box is not: the centre may go up
to the wall. Most rays point in directions that are fixed in the mission frame; two follow the goal and the velocity.
"""

import math

import numpy as np

from hydrone_gym._jit import inlined, routine
from hydrone_gym.world.bodies import meet_ray

REACH = 4.0  # m: beyond the sensor's 3 m, because what was seen stays known
AZIMUTHS = 12  # counter-clockwise from the frame's x'
ELEVATIONS = (-40, 0, 40)  # degrees
STILL = 1e-3  # m/s, and m to the goal: below it there is no direction to look along


def _fixed_directions() -> np.ndarray:
    """Unit vectors (3, 38) in the mission frame: each elevation all round, then up and down."""
    around = 2.0 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    circle = np.stack([np.cos(around), np.sin(around), np.ones(AZIMUTHS)])
    rings = [np.array([[math.cos(e)], [math.cos(e)], [math.sin(e)]]) * circle for e in map(math.radians, ELEVATIONS)]
    rays = np.concatenate([*rings, [[0.0, 0.0], [0.0, 0.0], [1.0, -1.0]]], axis=1)
    return np.where(abs(rays) < 1e-12, 0.0, rays)  # the cosine of a right angle: a ray along a wall must not leave


# Kernels read the three rows as constants.
_X, _Y, _Z = (np.ascontiguousarray(row) for row in _fixed_directions())
FIXED = _X.size
_RINGS = [f"ray_{e:+d}_{360 * k // AZIMUTHS}" for e in ELEVATIONS for k in range(AZIMUTHS)]
RAY_NAMES = (*_RINGS, "ray_up", "ray_down", "ray_goal", "ray_velocity")


@inlined
def leave_box(place, way, box):
    """Distance (m) from a position along a unit vector (x, y, z) to the box; negative if it lies behind.

    Slabs: of the two crossings of each axis the later one leaves. A component of zero gives infinity, or on a wall
    NaN, which no comparison takes.
    """
    x, y, z = place
    inverse_x, inverse_y, inverse_z = 1.0 / way[0], 1.0 / way[1], 1.0 / way[2]
    low, high = (box.x_min - x) * inverse_x, (box.x_max - x) * inverse_x
    distance = low if low > high else high
    low, high = (box.y_min - y) * inverse_y, (box.y_max - y) * inverse_y
    t = low if low > high else high
    distance = distance if distance < t else t
    low, high = (box.z_min - z) * inverse_z, (box.z_max - z) * inverse_z
    t = low if low > high else high
    return distance if distance < t else t


@inlined
def share_of_reach(distance):
    """Distance (m) as a share of the reach, in [0, 1]; what is not a number reads 1."""
    share = distance * (1.0 / REACH)
    share = share if share > 0.0 or share != share else 0.0
    return share if share < 1.0 else 1.0


@inlined
def cast_fixed(out, first, place, frame, spheres, count, params):
    """Write the fixed rays of a row, as shares of the reach, to out[first : first + FIXED], float32.

    These columns hold the least so far, since rounding keeps the order. `place` (x, y, z) in m; `frame` from
    `mission_frame`; the first `count` of the spheres (M, 4) in m are known; `params` has the box and the radius (m).
    """
    cosine, sine = frame
    for k in range(FIXED):
        dx, dy = cosine * _X[k] - sine * _Y[k], sine * _X[k] + cosine * _Y[k]
        out[first + k] = share_of_reach(leave_box(place, (dx, dy, _Z[k]), params))
    for j in range(count):
        ox, oy, oz = spheres[j, 0] - place[0], spheres[j, 1] - place[1], spheres[j, 2] - place[2]
        inflated = spheres[j, 3] + params.radius
        square = ox * ox + oy * oy + oz * oz
        if square < (REACH + inflated) * (REACH + inflated):
            power = square - inflated * inflated
            ahead, left = cosine * ox + sine * oy, cosine * oy - sine * ox
            for k in range(FIXED):
                share = share_of_reach(meet_ray(ahead * _X[k] + left * _Y[k] + oz * _Z[k], power))
                out[first + k] = min(out[first + k], np.float32(share))


@routine
def cast_along(place, vector, spheres, count, params):
    """Share of the reach that is free along a vector (any length, world frame); 1 if it is shorter than `STILL`."""
    vx, vy, vz = vector
    length = np.sqrt(vx * vx + vy * vy + vz * vz)
    dx, dy, dz = vx / length, vy / length, vz / length
    least = leave_box(place, (dx, dy, dz), params)
    for j in range(count):
        ox, oy, oz = spheres[j, 0] - place[0], spheres[j, 1] - place[1], spheres[j, 2] - place[2]
        inflated = spheres[j, 3] + params.radius
        power = ox * ox + oy * oy + oz * oz - inflated * inflated
        t = meet_ray(ox * dx + oy * dy + oz * dz, power)
        least = t if t < least else least
    return share_of_reach(least) if length >= STILL else 1.0
