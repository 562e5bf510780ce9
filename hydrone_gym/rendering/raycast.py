"""A ray caster: spheres, capsules and discs in a box with translucent water below z = 0, without display or GL.

One ray a pixel meets exact surfaces, so depth order and the waterline are exact. Along a ray, what is translucent (the
water surface, glassy spheres, the box's near walls) is mixed from far to near, and water takes light away with the
length of the ray under water, so that depth can be read. Pixels at an edge get four rays instead. Each shape is looked
for only in the tiles of the picture that it can reach, and a picture without shapes can be given to start from.
"""

import math

import numpy as np

from hydrone_gym._jit import inlined, kernel
from hydrone_gym.rendering.backdrop import Box, Camera, exit_colour, mix, near_wall, span_of, surface
from hydrone_gym.rendering.solids import glass, meet, solid

TILE = 8  # pixels
_SURFACE, _NEAR_WALL = -1, -2
_EMPTY = -1  # mark of a ray that met no shape and was given up
_ABSORPTION = 0.027  # 1/m, of blue under water; twice that of green, four times that of red
_MURK = (0.05, 0.37, 0.60)  # what water looks like when it is deep
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
def _keep(depths, layers, count, t, layer):
    """Put a translucent thing among those found, nearest first; return how many there are, the farthest given up."""
    k = min(count, depths.size - 1)
    if count == depths.size and depths[k] < t:
        return count
    while k > 0 and depths[k - 1] > t:
        depths[k], layers[k] = depths[k - 1], layers[k - 1]
        k -= 1
    depths[k], layers[k] = t, layer
    return min(count + 1, depths.size)


@inlined
def _trace(d, known, camera, box, shapes, geometry, items, first, last, depths, layers):
    """Follow one ray, unless it meets no shape and what is there without shapes is known.

    Returns:
        Red, green, blue, 0 to 1, and a number that differs between things side by side, negative for none.
    """
    end, hit, count = math.inf, -1, 0
    for k in range(first, last):
        item = items[k]
        t = meet(shapes[item, 0], shapes[item, 7], geometry[item], d)
        if t > 0.0 and t < end:
            if shapes[item, 14] < 1.0:
                count = _keep(depths, layers, count, t, item)
            else:
                end, hit = t, item
    if known and hit < 0 and count == 0:
        return 0.0, 0.0, 0.0, _EMPTY
    span = span_of(camera, box, d[0], d[1], d[2])
    inside = span.leave > max(span.enter, 0.0)
    waterline = -camera.ez / d[2]
    if inside and waterline > 0.0 and span.enter <= waterline and waterline <= span.leave and waterline < end:
        count = _keep(depths, layers, count, waterline, _SURFACE)
    if inside and span.enter > 0.0 and span.enter_axis < 2 and span.enter < end:
        count = _keep(depths, layers, count, span.enter, _NEAR_WALL)
    mark = hit * 64 + span.leave_axis + 8 * inside
    if hit >= 0:
        colour, part = solid(shapes[hit], geometry[hit], d, end, camera)
        mark += part
    else:
        colour = exit_colour(camera, box, span, d[0], d[1], d[2])
    for i in range(count - 1, -1, -1):
        t, layer = depths[i], layers[i]
        if t < end:
            colour = _drown(colour, min(end, span.rise) - max(t, span.dive))
            if layer == _SURFACE:
                paint, opacity = surface(camera, box, span, d[0], d[1], d[2], t)
            elif layer == _NEAR_WALL:
                paint, opacity = near_wall(camera, box, span, d[0], d[1], d[2])
            else:
                paint, opacity = glass(shapes[layer], geometry[layer], d, t, camera, box)
            colour = mix(colour, paint, opacity)
            end = t
            mark = mark * 31 + layer
    colour = _drown(colour, min(end, span.rise) - span.dive)
    return colour[0], colour[1], colour[2], abs(mark)


@inlined
def _ray(camera, column, row, width, height):
    """Unit direction through a point of the image, in pixels from its upper left corner."""
    u = (column - 0.5 * width) * camera.pixel
    v = (0.5 * height - row) * camera.pixel
    x = camera.fx + u * camera.rx + v * camera.ux
    y = camera.fy + u * camera.ry + v * camera.uy
    z = camera.fz + u * camera.rz + v * camera.uz
    scale = 1.0 / math.sqrt(1.0 + u * u + v * v)
    return x * scale, y * scale, z * scale


@inlined
def _byte(value):
    return np.uint8(max(0.0, min(255.0, 255.0 * value + 0.5)))


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
def _paint(image, row, column, fine, known, camera, box, shapes, geometry, items, first, last, depths, layers):
    """Paint one pixel with one ray, or with four if fine; return the mark of its last ray."""
    red, green, blue, mark = 0.0, 0.0, 0.0, 0
    rays = 4 if fine else 1
    for k in range(rays):
        x = column + 0.5 + (_CORNERS[k][0] if fine else 0.0)
        y = row + 0.5 + (_CORNERS[k][1] if fine else 0.0)
        d = _ray(camera, x, y, image.shape[1], image.shape[0])
        r, g, b, mark = _trace(d, known, camera, box, shapes, geometry, items, first, last, depths, layers)
        red, green, blue = red + r, green + g, blue + b
    if mark != _EMPTY:
        image[row, column, 0] = _byte(red / rays)
        image[row, column, 1] = _byte(green / rays)
        image[row, column, 2] = _byte(blue / rays)
    return mark


@kernel
def cast(image, marks, known, shapes, geometry, begins, items, depths, layers, camera_values, box_values):
    """Paint a picture.

    Args:
        image: (height, width, 3) uint8, written.
        marks: (height, width) int64, what each pixel sees, written.
        known: whether image and marks hold the picture without shapes; the result is the same.
        shapes: (n, len(SHAPE_FIELDS)) float64: m, and colours from 0 to 1.
        geometry: (n, 9), what is the same for every ray, see `hydrone_gym.rendering.canvas`.
        begins, items: (tiles + 1,) and (m,) int64: where each tile's shapes begin, and the shapes, tile by tile.
        depths, layers: (k,) float64 and int64, working storage: the most translucent things kept along one ray.
        camera_values, box_values: a `Camera` and a `Box` as arrays.
    """
    c, v = camera_values, box_values
    camera = Camera(c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], c[9], c[10], c[11], c[12])
    box = Box(v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7])
    height, width = marks.shape
    columns = (width + TILE - 1) // TILE
    for again in range(2):
        for row in range(height):
            for column in range(width):
                tile = (row // TILE) * columns + column // TILE
                first, last = begins[tile], begins[tile + 1]
                if (known and first == last) or (again == 1 and _smooth(marks, row, column)):
                    continue
                fine, skip = again == 1, known and again == 0
                mark = _paint(
                    image, row, column, fine, skip, camera, box, shapes, geometry, items, first, last, depths, layers
                )
                if again == 0 and mark != _EMPTY:
                    marks[row, column] = mark
