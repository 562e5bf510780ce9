"""Signed distance from a short straight path to a sphere: swept collision and sensing use the same number."""

import numpy as np

from hydrone_gym._jit import inlined


@inlined
def inverse_square(dx, dy, dz):
    """Return 1 over the squared length of a path (m), zero for a point: the division that all spheres share."""
    length2 = dx * dx + dy * dy + dz * dz
    return 1.0 / length2 if length2 > 0.0 else 0.0


@inlined
def path_distance(ax, ay, az, dx, dy, dz, inverse, cx, cy, cz, radius):
    """Least distance (m) from the path that leads from a by d to the surface of a sphere; `inverse_square` of d."""
    ox, oy, oz = cx - ax, cy - ay, cz - az
    t = (ox * dx + oy * dy + oz * dz) * inverse
    t = t if t > 0.0 else 0.0
    t = t if t < 1.0 else 1.0
    ox, oy, oz = ox - t * dx, oy - t * dy, oz - t * dz
    return np.sqrt(ox * ox + oy * oy + oz * oz) - radius


@inlined
def swept_distance(ax, ay, az, bx, by, bz, cx, cy, cz, radius):
    """Least distance (m) from the segment a-b to the surface of a sphere, negative inside it."""
    dx, dy, dz = bx - ax, by - ay, bz - az
    return path_distance(ax, ay, az, dx, dy, dz, inverse_square(dx, dy, dz), cx, cy, cz, radius)
