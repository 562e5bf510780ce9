"""A ray caster: spheres, capsules and discs in a box with translucent water below z = 0, without display or GL.

One ray a pixel meets exact surfaces, so depth order and the waterline are exact. Along a ray, what is translucent (the
water surface, glassy spheres, the box's near walls) is mixed from far to near, and water takes light away with the
length of the ray under water, so that depth can be read. Pixels at an edge get four rays instead. Each shape is looked
for only in the tiles of the picture that it can reach, and a picture without shapes can be given to start from.
"""

import math

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import inlined, kernel
from hydrone_gym.rendering.backdrop import Box, Camera, exit_colour, mix, near_wall, span_of, surface
from hydrone_gym.rendering.camera import Pose, outlines
from hydrone_gym.rendering.solids import CAPSULE, OPACITY, glass, meet, prepare, solid

TILE = 8  # pixels
_LAYERS = 32  # translucent things kept along one ray, the nearest
_SURFACE, _NEAR_WALL = -1, -2
_EMPTY = -1  # mark of a ray that met no shape and was given up
_ABSORPTION = 0.027  # 1/m, of blue under water; twice that of green, four times that of red
_MURK = (0.05, 0.37, 0.60)  # what water looks like when it is deep
Seen = tuple[NDArray[np.uint8], NDArray[np.int64]]  # a picture (height, width, 3), and what its pixels see
_CORNERS = ((-0.125, -0.375), (0.375, -0.125), (0.125, 0.375), (-0.375, 0.125))  # of a pixel, for its four rays


@inlined
def _drown(colour, length):
    """What is left of a colour after so much water (m)."""
    if length <= 0.0:
        return colour
    blue = math.exp(-_ABSORPTION * length)
    green = blue * blue
    return (
        _MURK[0] + green * green * (colour[0] - _MURK[0]),
        _MURK[1] + green * (colour[1] - _MURK[1]),
        _MURK[2] + blue * (colour[2] - _MURK[2]),
    )


@inlined
def _keep(found, count, t, layer):
    """Put a translucent thing among those found, nearest first; return how many there are, the farthest given up."""
    k = min(count, len(found) - 1)
    if count == len(found) and found[k, 0] < t:
        return count
    while k > 0 and found[k - 1, 0] > t:
        found[k, 0], found[k, 1] = found[k - 1, 0], found[k - 1, 1]
        k -= 1
    found[k, 0], found[k, 1] = t, layer
    return min(count + 1, len(found))


@inlined
def _meet_all(shapes, items, tile, found, d):
    """Return the way to the nearest opaque shape of a tile, which one, and how many translucent ones are found."""
    end, hit, count = math.inf, -1, 0
    for k in range(tile[0], tile[1]):
        item = items[k]
        t = meet(shapes[item], d)
        if t > 0.0 and t < end:
            if shapes[item, OPACITY] < 1.0:
                count = _keep(found, count, t, item)
            else:
                end, hit = t, item
    return end, hit, count


@inlined
def _trace(place, shapes, items, tile, found, d, known):
    """Follow one ray, unless it meets no shape and what is there without shapes is known.

    Return red, green, blue, 0 to 1, and a number that differs between things side by side, negative for none.
    """
    camera, box = place
    end, hit, count = _meet_all(shapes, items, tile, found, d)
    if known and hit < 0 and count == 0:
        return 0.0, 0.0, 0.0, _EMPTY
    span = span_of(camera, box, d)
    inside = span.leave > max(span.enter, 0.0)
    waterline = -camera.eye[2] / d[2]
    if inside and waterline > 0.0 and span.enter <= waterline and waterline <= span.leave and waterline < end:
        count = _keep(found, count, waterline, _SURFACE)
    if inside and span.enter > 0.0 and span.enter_axis < 2 and span.enter < end:
        count = _keep(found, count, span.enter, _NEAR_WALL)
    mark = hit * 64 + span.leave_axis + 8 * inside
    if hit >= 0:
        colour, part = solid(shapes[hit], d, end, camera)
        mark += part
    else:
        colour = exit_colour(camera, box, span, d)
    for i in range(count - 1, -1, -1):
        t, layer = found[i, 0], int(found[i, 1])
        if t < end:
            colour = _drown(colour, min(end, span.rise) - max(t, span.dive))
            if layer == _SURFACE:
                paint, opacity = surface(camera, box, span, d, t)
            elif layer == _NEAR_WALL:
                paint, opacity = near_wall(camera, box, span, d)
            else:
                paint, opacity = glass(shapes[layer], d, t, camera, box)
            colour = mix(colour, paint, opacity)
            end = t
            mark = mark * 31 + layer
    colour = _drown(colour, min(end, span.rise) - span.dive)
    return colour[0], colour[1], colour[2], abs(mark)


@inlined
def _ray(camera, column, row):
    """Unit direction through a point of the image, in pixels from its upper left corner."""
    u, v = (column - camera.middle[0]) * camera.pixel, (camera.middle[1] - row) * camera.pixel
    right, up, forward = camera.right, camera.up, camera.forward
    x = forward[0] + u * right[0] + v * up[0]
    y = forward[1] + u * right[1] + v * up[1]
    z = forward[2] + u * right[2] + v * up[2]
    scale = 1.0 / math.sqrt(1.0 + u * u + v * v)
    return x * scale, y * scale, z * scale


@inlined
def _smooth(marks, row, column):
    """Whether the pixels around one see the same things as it does."""
    height, width = marks.shape
    mark = marks[row, column]
    return (
        marks[max(row - 1, 0), column] == mark
        and marks[min(row + 1, height - 1), column] == mark
        and marks[row, max(column - 1, 0)] == mark
        and marks[row, min(column + 1, width - 1)] == mark
    )


@inlined
def _look(place, shapes, items, tile, found, pixel, fine, known):
    """Colour of a pixel from one ray, or from four if fine, 0 to 1, and the mark of its last ray."""
    red, green, blue, mark = 0.0, 0.0, 0.0, 0
    rays = 4 if fine else 1
    for k in range(rays):
        x = pixel[0] + 0.5 + (_CORNERS[k][0] if fine else 0.0)
        y = pixel[1] + 0.5 + (_CORNERS[k][1] if fine else 0.0)
        r, g, b, mark = _trace(place, shapes, items, tile, found, _ray(place[0], x, y), known)
        red, green, blue = red + r, green + g, blue + b
    return (red / rays, green / rays, blue / rays), mark


@kernel
def cast(image, marks, known, place, shapes, begins, items, found):
    """Paint an image (height, width, 3) uint8, and marks (height, width) int64, what each pixel sees.

    Args:
        known: whether image and marks hold the picture without shapes; the result is the same.
        place: a `Camera` and a `Box`.
        shapes, begins, items: from `prepare` and `_sort_into_tiles`.
        found: (k, 2) float64, working storage: the most translucent things kept along one ray.
    """
    height, width = marks.shape
    columns = (width + TILE - 1) // TILE
    for fine in (False, True):
        for row in range(height):
            for column in range(width):
                number = (row // TILE) * columns + column // TILE
                tile = begins[number], begins[number + 1]
                if (known and tile[0] == tile[1]) or (fine and _smooth(marks, row, column)):
                    continue
                colour, mark = _look(place, shapes, items, tile, found, (column, row), fine, known and not fine)
                if mark == _EMPTY:
                    continue
                for k in range(3):
                    image[row, column, k] = np.uint8(max(0.0, min(255.0, 255.0 * colour[k] + 0.5)))
                if not fine:
                    marks[row, column] = mark


class Canvas:
    """Makes pictures of one size, in pixels; from a camera that stands still it keeps the picture without shapes."""

    def __init__(self, size: tuple[int, int]) -> None:
        self.size = size
        self._place: tuple[Camera, Box] | None = None
        self._still: Seen | None = None

    def picture(self, shapes: NDArray[np.float64], pose: Pose, box: Box) -> NDArray[np.uint8]:
        """Return a new picture (height, width, 3) of shapes (n, len(SHAPE_FIELDS)), in m and colours from 0 to 1.

        It is the same whether or not one from there has been made before.
        """
        width, height = self.size
        eye, right, up, forward = (tuple(axis.tolist()) for axis in pose[:4])
        place = Camera(eye, right, up, forward, pose.pixel(height), (0.5 * width, 0.5 * height)), box
        if place != self._place:
            self._place, self._still = place, None
        elif self._still is None:  # worth it from the second picture on
            self._still = self._cast(shapes[:0], pose)
        return self._cast(shapes, pose)[0]

    def _cast(self, shapes: NDArray[np.float64], pose: Pose) -> Seen:
        """Paint a picture, over the one without shapes if that is known."""
        width, height = self.size
        still, seen = self._still or (np.zeros((height, width, 3), np.uint8), np.zeros((height, width), np.int64))
        image, marks = still.copy(), seen.copy()
        ends = np.stack((shapes[:, 1:4], np.where(shapes[:, :1] == CAPSULE, shapes[:, 4:7], shapes[:, 1:4])), axis=1)
        tiles = _sort_into_tiles(outlines(pose, ends, shapes[:, 7], self.size, TILE), self.size)
        known, found = self._still is not None, np.empty((_LAYERS, 2))
        cast(image, marks, known, self._place, prepare(shapes, pose.eye), *tiles, found)
        return image, marks


def _sort_into_tiles(outlines: NDArray[np.int64], size: tuple[int, int]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return where each tile's shapes begin, (tiles + 1,), in the shapes (m,) tile by tile, from `camera.outlines`."""
    columns, rows = (-(-pixels // TILE) for pixels in size)
    wide, high = outlines[:, 2] - outlines[:, 0], outlines[:, 3] - outlines[:, 1]
    counts = wide * high
    items = np.repeat(np.arange(len(outlines)), counts)
    place = np.arange(len(items)) - np.repeat(np.cumsum(counts) - counts, counts)
    column = outlines[items, 0] + place % wide[items]
    tile = (outlines[items, 1] + place // wide[items]) * columns + column
    order = np.argsort(tile, kind="stable")
    return np.searchsorted(tile[order], np.arange(columns * rows + 1)), items[order]
