"""The shapes of pictures: where a ray meets a sphere, a capsule, a disc or a shadow, and what colour it has there."""

import math

from hydrone_gym._jit import inlined
from hydrone_gym.rendering.backdrop import mix
from hydrone_gym.surface import is_air

# dark and light: the colour turned from and to the sun; opacity below 1: glass; foam 1: a bright line at the waterline
SHAPE_FIELDS = (
    *("kind", "ax", "ay", "az", "bx", "by", "bz", "radius"),
    *("dark_r", "dark_g", "dark_b", "light_r", "light_g", "light_b", "opacity", "foam"),
)
SPHERE, CAPSULE, DISC, SHADOW = 0, 1, 2, 3  # centre a; from a to b; centre a and normal b; the same, darkest at a
_LIGHT = (-0.36, -0.24, 0.90)  # towards the sun
_FOAM = 0.05  # m: half-height of the bright line round what breaks the surface


@inlined
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def _ball(along, beyond):
    """Where a ray enters a sphere, else infinite: ray times offset, and offset squared less radius squared."""
    root = along * along - beyond
    return -along - math.sqrt(root) if root > 0.0 else math.inf


@inlined
def meet(kind, radius, g, d):
    """Where a ray of direction d enters a shape, infinite or negative if it does not."""
    along = g[0] * d[0] + g[1] * d[1] + g[2] * d[2]
    if kind == SPHERE:
        return _ball(along, g[8])
    side = g[3] * d[0] + g[4] * d[1] + g[5] * d[2]
    if kind >= DISC:
        t = -g[7] / side
        return t if g[8] + t * (2.0 * along + t) <= 0.0 else math.inf
    a = g[6] - side * side
    b = g[6] * along - g[7] * side
    root = b * b - a * (g[6] * g[8] - g[7] * g[7])
    if not root >= 0.0:
        return math.inf
    t = (-b - math.sqrt(root)) / a
    y = g[7] + t * side
    if y > 0.0 and y < g[6]:
        return t
    if y <= 0.0:
        return _ball(along, g[8])
    return _ball(along - side, g[8] - 2.0 * g[7] + g[6])


@inlined
def _normal(s, g, d, t):
    """Unit normal of a shape where a ray meets it, towards the ray's origin."""
    x, y, z = g[0] + t * d[0], g[1] + t * d[1], g[2] + t * d[2]
    if s[0] == DISC:
        turn = -1.0 if _dot((s[4], s[5], s[6]), d) > 0.0 else 1.0
        return turn * s[4], turn * s[5], turn * s[6]
    if s[0] == CAPSULE:
        share = max(0.0, min(1.0, (x * g[3] + y * g[4] + z * g[5]) / g[6]))
        x, y, z = x - share * g[3], y - share * g[4], z - share * g[5]
    return x / s[7], y / s[7], z / s[7]


@inlined
def _foam(s, z, t, camera):
    """How bright the line is that the water draws round a shape at height z, if it draws one."""
    return 0.85 * s[15] * max(0.0, min(1.0, 0.5 + (_FOAM - abs(z)) / (t * camera.pixel)))


@inlined
def solid(s, g, d, t, camera):
    """Colour of an opaque shape where a ray meets it, and which part of the shape that is."""
    n = _normal(s, g, d, t)
    z = camera.eye[2] + t * d[2]
    lit = 0.08 + 0.62 * max(0.0, _dot(n, _LIGHT)) + 0.30 * (0.5 + 0.5 * n[2])
    lit = lit if is_air(z) else lit * math.exp(0.07 * z)
    # a disc has a rim, so that it is seen against anything
    x, y, w = g[0] + t * d[0], g[1] + t * d[1], g[2] + t * d[2]
    rim = s[0] == DISC and x * x + y * y + w * w > 0.72 * s[7] * s[7]
    colour = mix((s[8], s[9], s[10]), (s[11], s[12], s[13]), 0.0 if rim else lit)
    return mix(colour, (1.0, 1.0, 1.0), _foam(s, z, t, camera)), 16 if rim else 0


@inlined
def glass(s, g, d, t, camera, box):
    """Colour and opacity of a translucent shape: glass is clear in the middle, denser at its rim."""
    if s[0] == SHADOW:
        x, y = camera.eye[0] + t * d[0], camera.eye[1] + t * d[1]
        fall = math.sqrt((x - s[1]) ** 2 + (y - s[2]) ** 2) / s[7]
        ground = box.sea > 0.0 or (box.lower[0] < x and x < box.upper[0] and box.lower[1] < y and y < box.upper[1])
        return (s[8], s[9], s[10]), s[14] * min(1.0, 2.2 - 2.2 * fall) if ground else 0.0
    n = _normal(s, g, d, t)
    rim = 1.0 + _dot(n, d)
    foam = _foam(s, camera.eye[2] + t * d[2], t, camera)
    colour = mix((s[11], s[12], s[13]), (s[8], s[9], s[10]), min(1.0, rim * rim * 1.3))
    colour = mix(colour, (1.0, 1.0, 1.0), max(foam, 0.125 + 0.125 * _dot(n, _LIGHT)))
    return colour, max(0.6 * foam, s[14] * (0.28 + 0.72 * rim * rim))
