"""Obstacles as bodies: how far a path or a ray is from one. Spheres are the only shape so far.

A body is a row of `BODY` numbers: x, y, z of the centre and the radius, in m. Whoever needs to know what a body looks
like asks here: the simulation sweeps its path past them, sensing compares the same distance, rays meet them, planners
keep away from them, and pictures draw them.
"""

import sys

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import inlined

BODY = 4  # numbers a body
NOWHERE = (1e160, 0.0, 0.0, 0.0)  # a body that is not there: its square overflows, so its distance is infinite
UNIT = np.array([0.0, 0.0, 0.0, 1.0])  # the body that all others are moved and scaled copies of


@inlined
def inverse_square(dx, dy, dz):
    """Return 1 over the squared length of a path (m), zero for a point: the division that all bodies share."""
    length2 = dx * dx + dy * dy + dz * dz
    return 1.0 / length2 if length2 > 0.0 else 0.0


@inlined
def path_distance(a, d, inverse, body):
    """Least distance (m) from the path a to a + d (x, y, z in m) to a body; `inverse` is `inverse_square` of d."""
    ox, oy, oz = body[0] - a[0], body[1] - a[1], body[2] - a[2]
    t = (ox * d[0] + oy * d[1] + oz * d[2]) * inverse
    t = t if t > 0.0 else 0.0
    t = t if t < 1.0 else 1.0
    ox, oy, oz = ox - t * d[0], oy - t * d[1], oz - t * d[2]
    return np.sqrt(ox * ox + oy * oy + oz * oz) - body[3]


@inlined
def segment_distance(a, b, body):
    """Least distance (m) from the segment between two points (x, y, z) to the surface of a body, negative inside it."""
    d = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
    return path_distance((a[0], a[1], a[2]), d, inverse_square(d[0], d[1], d[2]), body)


@inlined
def meet_ray(along, power):
    """Distance (m) along a ray to a sphere: 0 inside it, infinity if missed.

    `along` is the component (m) of its centre along the ray, `power` the squared distance of its centre less its
    squared radius (m²), negative inside.
    """
    discriminant = along * along - power
    t = along - np.sqrt(discriminant if discriminant > 0.0 else 0.0)
    hit = power < 0.0 or (along > 0.0 and discriminant >= 0.0)
    return (t if t > 0.0 else 0.0) if hit else np.inf


def gaps_along(a: NDArray[np.float64], b: NDArray[np.float64], bodies: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the least distances (M,) in m from the straight path between two points (3,) to the surfaces of bodies."""
    along, offset = b - a, bodies[:, :3] - a
    share = np.clip(offset @ along / max(float(along @ along), sys.float_info.min), 0.0, 1.0)
    return np.linalg.norm(offset - share[:, None] * along, axis=1) - bodies[:, 3]


def distances(points: NDArray[np.float64], bodies: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distances (N, M) in m from points (N, 3) to the surfaces of bodies, negative inside."""
    return np.linalg.norm(points[:, None] - bodies[:, :3], axis=2) - bodies[:, 3]


def placed(bodies: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the middles (M, 3) of bodies in m, and how many times as large as `UNIT` they are (M,)."""
    return bodies[:, :3], bodies[:, 3]


def bounds(bodies: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lower and the upper corner of the box around each body, (M, 2, 3) in m."""
    return bodies[:, None, :3] + np.array([[-1.0], [1.0]]) * bodies[:, None, 3:]


def support(body: NDArray[np.float64], directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where the surface of a body faces unit directions, (n, 3) in m: the points farthest that way."""
    return body[:3] + body[3] * directions


def section(body: NDArray[np.float64], z: float, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return so many points round a body at a height (m), and the unit normals there, each (n, 3); none beyond it."""
    height = (z - body[2]) / body[3]
    turns = np.linspace(0.0, 2.0 * np.pi, count if abs(height) < 1.0 else 0, endpoint=False)
    normals = np.column_stack((np.cos(turns), np.sin(turns), np.full(len(turns), height)))
    normals[:, :2] *= np.sqrt(max(1.0 - height * height, 0.0))
    return support(body, normals), normals


def mesh(body: NDArray[np.float64], rings: int = 16) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return a body as triangles: vertices (n, 3) in m, and faces (m, 3), counter-clockwise as seen from outside."""
    sections = 2 * rings
    rise, turn = np.meshgrid(np.linspace(0.0, np.pi, rings + 1), 2.0 * np.pi * np.arange(sections) / sections)
    directions = np.stack((np.sin(rise) * np.cos(turn), np.sin(rise) * np.sin(turn), -np.cos(rise)), axis=2)
    return support(body, directions.swapaxes(0, 1).reshape(-1, 3)), belt(rings, sections)


def belt(rings: int, sections: int) -> NDArray[np.int64]:
    """Return the triangles (n, 3) between rings, one more than `rings`, of so many vertices each, from low to high."""
    a = np.arange(rings * sections)
    b = a - a % sections + (a + 1) % sections
    return np.concatenate((np.stack((a, b, b + sections), 1), np.stack((a, b + sections, a + sections), 1)))
