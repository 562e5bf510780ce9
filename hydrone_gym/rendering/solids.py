"""The shapes of pictures: where a ray meets a sphere, a capsule, a disc or a shadow, and what colour it has there."""

import math

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import inlined
from hydrone_gym.rendering.backdrop import mix
from hydrone_gym.surface import is_air

# dark and light: the colour turned from and to the sun; opacity below 1: glass; foam 1: a bright line at the waterline
SHAPE_FIELDS = (
    *("kind", "ax", "ay", "az", "bx", "by", "bz", "radius"),
    *("dark_r", "dark_g", "dark_b", "light_r", "light_g", "light_b", "opacity", "foam"),
)
OPACITY = SHAPE_FIELDS.index("opacity")
SPHERE, CAPSULE, DISC, SHADOW = 0, 1, 2, 3  # centre a; from a to b; centre a and normal b; the same, darkest at a
_LIGHT = (-0.36, -0.24, 0.90)  # towards the sun
_FOAM = 0.05  # m: half-height of the bright line round what breaks the surface


def prepare(shapes: NDArray[np.float64], eye: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return shapes (n, len(SHAPE_FIELDS)) with what is the same for every ray from an eye (3,) in m, (n, 25).

    Numbers 16 to 18 lead from a to the eye; 19 to 21 from a to b of a capsule, and are b itself of a disc; 22 is that
    one squared; 23 its product with the first; 24 the first squared less the radius squared.
    """
    offset, other = eye - shapes[:, 1:4], shapes[:, 4:7] - np.where(shapes[:, :1] == CAPSULE, shapes[:, 1:4], 0.0)
    squares = [(other * other).sum(axis=1), (other * offset).sum(axis=1), (offset * offset).sum(axis=1)]
    squares[2] -= shapes[:, 7] ** 2
    return np.ascontiguousarray(np.column_stack((shapes, offset, other, *squares)))


@inlined
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def _ball(along, beyond):
    """Where a ray enters a sphere, else infinite: ray times offset, and offset squared less radius squared."""
    root = along * along - beyond
    return -along - math.sqrt(root) if root > 0.0 else math.inf


@inlined
def meet(s, d):
    """Where a ray of direction d enters a shape, infinite or negative if it does not."""
    along = s[16] * d[0] + s[17] * d[1] + s[18] * d[2]
    if s[0] == SPHERE:
        return _ball(along, s[24])
    side = s[19] * d[0] + s[20] * d[1] + s[21] * d[2]
    if s[0] >= DISC:
        t = -s[23] / side
        return t if s[24] + t * (2.0 * along + t) <= 0.0 else math.inf
    a = s[22] - side * side
    b = s[22] * along - s[23] * side
    root = b * b - a * (s[22] * s[24] - s[23] * s[23])
    if not root >= 0.0:
        return math.inf
    t = (-b - math.sqrt(root)) / a
    y = s[23] + t * side
    if y > 0.0 and y < s[22]:
        return t
    if y <= 0.0:
        return _ball(along, s[24])
    return _ball(along - side, s[24] - 2.0 * s[23] + s[22])


@inlined
def _normal(s, d, t):
    """Unit normal of a shape where a ray meets it, towards the ray's origin."""
    x, y, z = s[16] + t * d[0], s[17] + t * d[1], s[18] + t * d[2]
    if s[0] == DISC:
        turn = -1.0 if _dot((s[4], s[5], s[6]), d) > 0.0 else 1.0
        return turn * s[4], turn * s[5], turn * s[6]
    if s[0] == CAPSULE:
        share = max(0.0, min(1.0, (x * s[19] + y * s[20] + z * s[21]) / s[22]))
        x, y, z = x - share * s[19], y - share * s[20], z - share * s[21]
    return x / s[7], y / s[7], z / s[7]


@inlined
def _foam(s, z, t, camera):
    """How bright the line is that the water draws round a shape at height z, if it draws one."""
    return 0.85 * s[15] * max(0.0, min(1.0, 0.5 + (_FOAM - abs(z)) / (t * camera.pixel)))


@inlined
def solid(s, d, t, camera):
    """Colour of an opaque shape where a ray meets it, and which part of the shape that is."""
    n = _normal(s, d, t)
    z = camera.eye[2] + t * d[2]
    lit = 0.08 + 0.62 * max(0.0, _dot(n, _LIGHT)) + 0.30 * (0.5 + 0.5 * n[2])
    lit = lit if is_air(z) else lit * math.exp(0.07 * z)
    # a disc has a rim, so that it is seen against anything
    x, y, w = s[16] + t * d[0], s[17] + t * d[1], s[18] + t * d[2]
    rim = s[0] == DISC and x * x + y * y + w * w > 0.72 * s[7] * s[7]
    colour = mix((s[8], s[9], s[10]), (s[11], s[12], s[13]), 0.0 if rim else lit)
    return mix(colour, (1.0, 1.0, 1.0), _foam(s, z, t, camera)), 16 if rim else 0


@inlined
def glass(s, d, t, camera, box):
    """Colour and opacity of a translucent shape: glass is clear in the middle, denser at its rim."""
    if s[0] == SHADOW:
        x, y = camera.eye[0] + t * d[0], camera.eye[1] + t * d[1]
        fall = math.sqrt((x - s[1]) ** 2 + (y - s[2]) ** 2) / s[7]
        ground = box.sea > 0.0 or (box.lower[0] < x and x < box.upper[0] and box.lower[1] < y and y < box.upper[1])
        return (s[8], s[9], s[10]), s[14] * min(1.0, 2.2 - 2.2 * fall) if ground else 0.0
    n = _normal(s, d, t)
    rim = 1.0 + _dot(n, d)
    foam = _foam(s, camera.eye[2] + t * d[2], t, camera)
    colour = mix((s[11], s[12], s[13]), (s[8], s[9], s[10]), min(1.0, rim * rim * 1.3))
    colour = mix(colour, (1.0, 1.0, 1.0), max(foam, 0.125 + 0.125 * _dot(n, _LIGHT)))
    return colour, max(0.6 * foam, s[14] * (0.28 + 0.72 * rim * rim))
