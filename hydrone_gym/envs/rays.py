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
    rings = [
        np.stack([math.cos(e) * np.cos(around), math.cos(e) * np.sin(around), np.full(AZIMUTHS, math.sin(e))])
        for e in map(math.radians, ELEVATIONS)
    ]
    rays = np.concatenate([*rings, [[0.0, 0.0], [0.0, 0.0], [1.0, -1.0]]], axis=1)
    return np.where(abs(rays) < 1e-12, 0.0, rays)  # the cosine of a right angle: a ray along a wall must not leave


# Kernels read the three rows as constants.
_X, _Y, _Z = (np.ascontiguousarray(row) for row in _fixed_directions())
FIXED = _X.size
RAY_NAMES = (
    *(f"ray_{e:+d}_{360 * k // AZIMUTHS}" for e in ELEVATIONS for k in range(AZIMUTHS)),
    "ray_up",
    "ray_down",
    "ray_goal",
    "ray_velocity",
)


@inlined
def leave_box(x, y, z, dx, dy, dz, box):
    """Distance (m) from a position along a unit vector to the box; negative if it lies behind.

    Slabs: of the two crossings of each axis the later one leaves. A component of zero gives infinity, or on a wall
    NaN, which no comparison takes.
    """
    inverse_x, inverse_y, inverse_z = 1.0 / dx, 1.0 / dy, 1.0 / dz
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
def cast_fixed(out, n, first, state, cosine, sine, known, found, box, radius):
    """Write the fixed rays of row n, as shares of the reach, to out[n, first : first + FIXED].

    Args:
        out: (rows, K) float32; its own columns hold the least so far, since rounding keeps the order.
        n: row of `out`, `known` and `found`.
        first: column of the first ray.
        state: (12,), position first (m).
        cosine, sine: of the mission frame's azimuth.
        known, found: (rows, M, 4) spheres x, y, z, r in m, and how many of them count.
        box: has x_min ... z_max (m).
        radius: of the vehicle (m).
    """
    x, y, z = state[0], state[1], state[2]
    for k in range(FIXED):
        dx, dy = cosine * _X[k] - sine * _Y[k], sine * _X[k] + cosine * _Y[k]
        out[n, first + k] = share_of_reach(leave_box(x, y, z, dx, dy, _Z[k], box))
    for j in range(found[n]):
        ox, oy, oz = known[n, j, 0] - x, known[n, j, 1] - y, known[n, j, 2] - z
        inflated = known[n, j, 3] + radius
        square = ox * ox + oy * oy + oz * oz
        if square < (REACH + inflated) * (REACH + inflated):
            power = square - inflated * inflated
            ahead, left = cosine * ox + sine * oy, cosine * oy - sine * ox
            for k in range(FIXED):
                share = share_of_reach(meet_ray(ahead * _X[k] + left * _Y[k] + oz * _Z[k], power))
                out[n, first + k] = min(out[n, first + k], np.float32(share))


@routine
def cast_along(n, state, vx, vy, vz, known, found, box, radius):
    """Share of the reach that is free along a vector (any length, world frame); 1 if it is shorter than `STILL`."""
    length = np.sqrt(vx * vx + vy * vy + vz * vz)
    x, y, z = state[0], state[1], state[2]
    dx, dy, dz = vx / length, vy / length, vz / length
    least = leave_box(x, y, z, dx, dy, dz, box)
    for j in range(found[n]):
        ox, oy, oz = known[n, j, 0] - x, known[n, j, 1] - y, known[n, j, 2] - z
        inflated = known[n, j, 3] + radius
        power = ox * ox + oy * oy + oz * oz - inflated * inflated
        t = meet_ray(ox * dx + oy * dy + oz * dz, power)
        least = t if t < least else least
    return share_of_reach(least) if length >= STILL else 1.0
