"""Shaded spheres as a few flat polygons: exact outlines under an orthographic camera, small files, crisp in print.

A sphere lit from direction L is shaded by nested caps around L. Each cap, or the part of it above the water, is convex,
so its picture is the convex hull of its projected rim. Eight polygons a sphere replace the hundreds of a mesh.
"""

import numpy as np
from numpy.typing import NDArray

# half-angles of the lit caps, all in full view of the camera
_CAPS = np.radians([52.0, 46.0, 40.0, 34.0, 28.0, 22.0, 15.0])
_LIGHT = np.array([-0.35, 0.45, 0.82])  # in camera axes: right, up, towards the eye
_RIM = 64  # points round an outline


def camera_axes(elevation: float, azimuth: float) -> NDArray[np.float64]:
    """Return the camera's right, up and towards-the-eye directions in the world, (3, 3), from angles in degrees."""
    e, a = np.radians([elevation, azimuth])
    right = [-np.sin(a), np.cos(a), 0.0]
    up = [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)]
    eye = [np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]
    return np.array([right, up, eye])


def convex_hull(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners of the convex hull of points (n, 2), counter-clockwise (Andrew's monotone chain)."""
    ordered = np.unique(points, axis=0).tolist()
    if len(ordered) < 3:
        return np.array(ordered)
    chains: list[list[list[float]]] = []
    for sequence in (ordered, ordered[::-1]):
        chain: list[list[float]] = []
        for p in sequence:
            while len(chain) > 1:
                (ax, ay), (bx, by) = chain[-2], chain[-1]
                if (bx - ax) * (p[1] - ay) - (by - ay) * (p[0] - ax) > 0.0:
                    break
                chain.pop()
            chain.append(p)
        chains.append(chain[:-1])
    return np.array(chains[0] + chains[1])


def _rim(axis: NDArray[np.float64], half_angle: float) -> NDArray[np.float64]:
    """Points (n, 3) on the unit sphere at an angle (rad) from a unit axis."""
    first = np.cross(axis, [0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    turn = np.linspace(0.0, 2.0 * np.pi, _RIM, endpoint=False)[:, None]
    circle = np.cos(turn) * first + np.sin(turn) * np.cross(axis, first)
    return np.cos(half_angle) * axis + np.sin(half_angle) * circle


def sphere_outlines(
    centre: NDArray[np.float64], radius: float, camera: NDArray[np.float64], above_water: bool
) -> list[NDArray[np.float64]]:
    """Return the outline of a sphere and of its lit caps, darkest first, as polygons in the world, each (n, 3).

    Args:
        centre, radius: the sphere, m.
        camera: from `camera_axes`.
        above_water: keep only what rises above z = 0; polygons that do not are left out.
    """
    light = _LIGHT / np.linalg.norm(_LIGHT) @ camera
    waterline = -centre[2] / radius  # height of the water in the unit sphere
    wet = _rim(np.array([0.0, 0.0, 1.0]), np.arccos(waterline)) if above_water and abs(waterline) < 1.0 else None
    polygons = []
    for level, half_angle in enumerate((0.5 * np.pi, *_CAPS)):
        axis = camera[2] if level == 0 else light
        points = _rim(axis, half_angle)
        if above_water:
            points = points[points[:, 2] >= waterline]
            if wet is not None:
                inside = wet if level == 0 else wet[wet @ light >= np.cos(half_angle)]
                points = np.vstack((points, inside))
        if len(points) < 3:
            continue
        hull = convex_hull(np.round(points @ camera[:2].T, 9))
        if len(hull) < 3:
            continue
        # all in one plane that faces the camera, lit caps a hair in front
        depth = np.full((len(hull), 1), 1e-3 * level)
        polygons.append(centre + radius * np.hstack((hull, depth)) @ camera)
    return polygons
