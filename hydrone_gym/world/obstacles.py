"""Signed distance from a short straight path to a sphere: swept collision and sensing use the same number."""

import numpy as np

from hydrone_gym._jit import inlined


@inlined
def swept_distance(ax, ay, az, bx, by, bz, cx, cy, cz, radius):
    """Least distance (m) from the segment a-b to the surface of a sphere, negative inside it."""
    dx, dy, dz = bx - ax, by - ay, bz - az
    ox, oy, oz = cx - ax, cy - ay, cz - az
    along = ox * dx + oy * dy + oz * dz
    length2 = dx * dx + dy * dy + dz * dz
    t = along / length2 if along > 0.0 and length2 > 0.0 else 0.0
    t = 1.0 if t > 1.0 else t
    ox, oy, oz = ox - t * dx, oy - t * dy, oz - t * dz
    return np.sqrt(ox * ox + oy * oy + oz * oz) - radius
