"""Polylines: how far along them, where they cross the surface, and how they are cut into pieces."""

import itertools

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.surface import in_air

Line = NDArray[np.float64]  # (n, 3) m


def along(line: Line) -> NDArray[np.float64]:
    """Return how far each point lies along a polyline (n,), m."""
    return np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))))


def _crossings(line: Line, level: NDArray[np.float64] | float) -> tuple[NDArray[np.intp], NDArray[np.float64], Line]:
    """Return the segments that lead from one medium into the other, how far along them (0 to 1), and where."""
    level = np.broadcast_to(level, len(line))
    z = line[:, 2] - level
    air = in_air(z)
    first = np.flatnonzero(air[:-1] != air[1:])
    share = z[first] / (z[first] - z[first + 1])
    points = line[first] + share[:, None] * (line[first + 1] - line[first])
    points[:, 2] = level[first] + share * (level[first + 1] - level[first])
    return first, share, points


def crossing_points(line: Line, level: NDArray[np.float64] | float = 0.0) -> Line:
    """Return where a path crosses the surface, (c, 3), interpolated between samples.

    The surface is at a level (m), one for all of the path or one for each point (n,), as where there are waves.
    """
    return _crossings(line, level)[2]


def _split(line: Line, level: NDArray[np.float64] | float = 0.0) -> tuple[Line, NDArray[np.bool_]]:
    """Return a polyline with a point added wherever it crosses the surface, and which segments are under water."""
    first, share, points = _crossings(line, level)
    inner = (share > 0.0) & (share < 1.0)
    height = np.insert(line[:, 2] - level, first[inner] + 1, 0.0)
    line = np.insert(line, first[inner] + 1, points[inner], axis=0)
    return line, ~in_air(0.5 * (height[:-1] + height[1:]))


def _cut(line: Line, change: NDArray[np.bool_]) -> list[Line]:
    """Cut a polyline into consecutive ones that share their ends, where one segment differs from the next."""
    cuts = [0, *(np.flatnonzero(change) + 1).tolist(), len(line) - 1]
    return [line[first : last + 1] for first, last in itertools.pairwise(cuts) if last > first]


def split_media(line: Line, level: NDArray[np.float64] | float = 0.0) -> tuple[list[Line], list[Line]]:
    """Cut a path at the surface, see `crossing_points`, into its parts in air and its parts under water."""
    line, wet = _split(line, level)
    parts = _cut(line, wet[1:] != wet[:-1])
    begins_wet = int(wet[:1].any())
    return parts[begins_wet::2], parts[1 - begins_wet :: 2]


def pieces(line: Line, length: float) -> list[Line]:
    """Cut a polyline into pieces about so long (m), and at the surface."""
    if len(line) < 2:
        return []
    line, wet = _split(line)
    way = along(line)
    count = max(int(np.ceil(way[-1] / length)), 1)
    sections = np.floor(way * count / max(way[-1], 1e-12) + 1e-9).astype(int)
    return _cut(line, (np.diff(sections[:-1]) != 0) | (wet[1:] != wet[:-1]))


def dash(line: Line, length: float, gap: float) -> list[Line]:
    """Cut dashes of a length out of a polyline, a gap apart, all in m along the line.

    A dash pattern of Matplotlib would restart in every piece of the scene.
    """
    way = along(line)
    dashes = []
    for begin in np.arange(0.0, way[-1], length + gap):
        end = min(begin + length, way[-1])
        samples = np.concatenate(([begin], way[(way > begin) & (way < end)], [end]))
        dashes.append(np.column_stack([np.interp(samples, way, column) for column in line.T]))
    return dashes
