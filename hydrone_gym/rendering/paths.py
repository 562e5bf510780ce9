"""Polylines: how far along them, where they cross the surface, and how they are cut into pieces."""

import itertools

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.surface import in_air

Line = NDArray[np.float64]  # (n, 3) m


def along(line: Line) -> NDArray[np.float64]:
    """Return how far each point lies along a polyline (n,), m."""
    return np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))))


def _crossings(line: Line) -> tuple[NDArray[np.intp], NDArray[np.float64], Line]:
    """Return the segments that lead from one medium into the other, how far along them (0 to 1), and where."""
    air, z = in_air(line[:, 2]), line[:, 2]
    first = np.flatnonzero(air[:-1] != air[1:])
    share = z[first] / (z[first] - z[first + 1])
    points = line[first] + share[:, None] * (line[first + 1] - line[first])
    points[:, 2] = 0.0
    return first, share, points


def crossing_points(line: Line) -> Line:
    """Return where a path crosses the surface, (c, 3), interpolated between samples."""
    return _crossings(line)[2]


def _split(line: Line) -> tuple[Line, NDArray[np.bool_]]:
    """Return a polyline with a point added wherever it crosses the surface, and which segments are under water."""
    first, share, points = _crossings(line)
    inner = (share > 0.0) & (share < 1.0)
    line = np.insert(line, first[inner] + 1, points[inner], axis=0)
    return line, ~in_air(0.5 * (line[:-1, 2] + line[1:, 2]))


def _cut(line: Line, change: NDArray[np.bool_]) -> list[Line]:
    """Cut a polyline into consecutive ones that share their ends, where one segment differs from the next."""
    cuts = [0, *(np.flatnonzero(change) + 1).tolist(), len(line) - 1]
    return [line[first : last + 1] for first, last in itertools.pairwise(cuts) if last > first]


def split_media(line: Line) -> tuple[list[Line], list[Line]]:
    """Cut a path at the surface into its parts in air and its parts under water."""
    line, wet = _split(line)
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
