"""Triangles for what a page shows: bodies of revolution, and the vehicle made of them."""

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Mesh(NamedTuple):
    """A surface of triangles, seen from outside."""

    vertices: NDArray[np.float64]  # (n, 3) m
    faces: NDArray[np.int64]  # (m, 3) vertices, counter-clockwise

    @classmethod
    def joined(cls, *meshes: "Mesh") -> Self:
        """Return several meshes as one."""
        counts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
        faces = [mesh.faces + first for mesh, first in zip(meshes, counts)]
        return cls(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def turned(profile: ArrayLike, base: ArrayLike, axis: ArrayLike, sections: int = 16) -> Mesh:
    """Return a body of revolution.

    Args:
        profile: (n, 2) distance from the axis and way along it, m; the way grows from row to row or stays.
        base: (3,) where the way is 0, m.
        axis: (3,) its direction.
        sections: corners of a circle.
    """
    radius, way = np.array(profile, dtype=np.float64).T[:, :, None, None]
    forward = np.array(axis, dtype=np.float64) / np.linalg.norm(axis)
    right = np.cross(forward, np.eye(3)[np.argmin(np.abs(forward))])
    right /= np.linalg.norm(right)
    turns = np.linspace(0.0, 2.0 * np.pi, sections, endpoint=False)[:, None]
    circle = np.cos(turns) * right + np.sin(turns) * np.cross(forward, right)
    vertices = np.array(base) + way * forward + radius * circle
    ring = np.arange(sections)
    a = (sections * np.arange(len(vertices) - 1)[:, None] + ring).ravel()
    b = (sections * np.arange(len(vertices) - 1)[:, None] + (ring + 1) % sections).ravel()
    faces = np.concatenate((np.stack((a, b, b + sections), 1), np.stack((a, b + sections, a + sections), 1)))
    return Mesh(vertices.reshape(-1, 3), faces)


def ball(radius: float, centre: ArrayLike = (0.0, 0.0, 0.0), rings: int = 16) -> Mesh:
    """Return a sphere (m)."""
    turns = np.linspace(0.0, np.pi, rings + 1)
    return turned(radius * np.stack((np.sin(turns), -np.cos(turns)), 1), centre, (0.0, 0.0, 1.0), 2 * rings)


def rod(start: ArrayLike, end: ArrayLike, radius: float, sections: int = 12) -> Mesh:
    """Return a cylinder from one point to another (m), closed at both ends."""
    axis = np.subtract(end, start)
    length = float(np.linalg.norm(axis))
    return turned([(0.0, 0.0), (radius, 0.0), (radius, length), (0.0, length)], start, axis, sections)


def slab(z: float, lower: tuple[float, ...], upper: tuple[float, ...]) -> Mesh:
    """Return a level rectangle at height z between two corners of a box (m)."""
    (x0, y0, *_), (x1, y1, *_) = lower, upper
    return Mesh(
        np.array([(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]), np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int64)
    )


def walls(lower: tuple[float, ...], upper: tuple[float, ...], low: float, high: float) -> list[Mesh]:
    """Return the four upright sides of a box between two heights (m), seen from outside."""
    floor, top = (slab(z, lower, upper).vertices for z in (low, high))
    faces = np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int64)
    ahead = [(k + 1) % 4 for k in range(4)]
    return [Mesh(np.array([floor[k], floor[n], top[n], top[k]]), faces) for k, n in enumerate(ahead)]


class VehicleMeshes(NamedTuple):
    """The parts of the vehicle by colour, in its own axes."""

    frame: Mesh
    front: Mesh
    rotors: Mesh


def vehicle(arm: float) -> VehicleMeshes:
    """Return a vehicle whose rotors lie on its axes, this far (m) from its middle; the front one lies on +x."""
    ends = arm * np.array([(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)], dtype=np.float64)
    up = np.array([0.0, 0.0, arm])
    body = rod(-0.18 * up, 0.14 * up, 0.3 * arm)
    arms = [rod((0.0, 0.0, 0.0), end, 0.1 * arm) for end in ends]
    hubs = [rod(end - 0.3 * up, end + 0.15 * up, 0.07 * arm) for end in ends]
    screws = [rod(end - 0.32 * up, end - 0.28 * up, 0.3 * arm, 20) for end in ends]
    rotors = [rod(end + 0.12 * up, end + 0.16 * up, 0.62 * arm, 28) for end in ends]
    return VehicleMeshes(
        frame=Mesh.joined(body, *arms[1:], *hubs, *screws),
        front=Mesh.joined(arms[0], rotors[0]),
        rotors=Mesh.joined(*rotors[1:]),
    )
