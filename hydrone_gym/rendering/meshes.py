"""Triangles for what a page shows: balls and rods, shapes made of them, and the sides of the box."""

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hydrone_gym.rendering.solids import CAPSULE
from hydrone_gym.world.bodies import UNIT, belt, mesh

_THICK = 0.02  # half of a disc
_RECTANGLE = np.array([(0, 1, 2), (0, 2, 3)])


class Mesh(NamedTuple):
    """A surface of triangles, seen from outside."""

    vertices: NDArray[np.float64]  # (n, 3) m
    faces: NDArray[np.int64]  # (m, 3) vertices, counter-clockwise

    @classmethod
    def joined(cls, *meshes: "Mesh") -> Self:
        """Return several meshes as one."""
        counts = np.cumsum([0, *(len(part.vertices) for part in meshes)])
        faces = [part.faces + first for part, first in zip(meshes, counts)]
        return cls(np.concatenate([part.vertices for part in meshes]), np.concatenate(faces))


def ball(radius: float, centre: ArrayLike = (0.0, 0.0, 0.0), rings: int = 16) -> Mesh:
    """Return a sphere (m)."""
    vertices, faces = mesh(UNIT, rings)
    return Mesh(np.array(centre) + radius * vertices, faces)


def rod(start: ArrayLike, end: ArrayLike, radius: float, sections: int = 12) -> Mesh:
    """Return a cylinder from one point to another (m), closed at both ends."""
    a, b = np.array(start, dtype=np.float64), np.array(end, dtype=np.float64)
    forward = (b - a) / np.linalg.norm(b - a)
    right = np.cross(forward, np.eye(3)[np.argmin(np.abs(forward))])
    right /= np.linalg.norm(right)
    turns = np.linspace(0.0, 2.0 * np.pi, sections, endpoint=False)[:, None]
    circle = radius * (np.cos(turns) * right + np.sin(turns) * np.cross(forward, right))
    return Mesh(np.concatenate((a + 0.0 * circle, a + circle, b + circle, b + 0.0 * circle)), belt(3, sections))


def slab(z: float, lower: ArrayLike, upper: ArrayLike) -> Mesh:
    """Return a level rectangle at height z between two corners of a box (m)."""
    (x0, y0, _), (x1, y1, _) = np.array(lower), np.array(upper)
    return Mesh(np.array([(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]), _RECTANGLE)


def walls(lower: ArrayLike, upper: ArrayLike, low: float, high: float) -> list[Mesh]:
    """Return the four upright sides of a box between two heights (m), seen from outside."""
    floor, top = slab(low, lower, upper).vertices, slab(high, lower, upper).vertices
    return [Mesh(np.array([floor[k - 1], floor[k], top[k], top[k - 1]]), _RECTANGLE) for k in (1, 2, 3, 0)]


def model(shapes: NDArray[np.float64], size: float) -> Mesh:
    """Return capsules and discs of the ray caster as rods, so many times as large."""
    rods = []
    for shape in shapes:
        a, b = shape[1:4], shape[4:7]
        ends = (a, b) if shape[0] == CAPSULE else (a - _THICK * b, a + _THICK * b)
        rods.append(rod(size * ends[0], size * ends[1], size * shape[7], 20))
    return Mesh.joined(*rods)
