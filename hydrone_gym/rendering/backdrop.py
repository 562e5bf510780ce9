"""What every ray can meet: sky, sandy floor, water surface and the walls of the box, all without textures."""

import math
from typing import NamedTuple

from hydrone_gym._jit import inlined

GRID = 5.0  # m between the lines on the floor and on the far walls
_SEA = 120.0  # m: how far beyond the box water and floor reach for a camera inside it
_HAZE = 40.0  # m: from where on they fade into the horizon there
_HORIZON = (0.965, 0.975, 0.985)
_ZENITH = (0.52, 0.73, 0.93)
_BELOW = (0.74, 0.79, 0.84)
_SAND = (0.87, 0.81, 0.68)
_LINE = (0.45, 0.50, 0.55)

Point = tuple[float, float, float]


class Camera(NamedTuple):
    """Where the eye is (m), and unit vectors to the right, up and forward."""

    eye: Point
    right: Point
    up: Point
    forward: Point
    pixel: float  # width of one at distance 1
    middle: tuple[float, float]  # of the picture, pixels


class Box(NamedTuple):
    """The world as it is drawn (m)."""

    lower: Point
    upper: Point
    zone: float
    sea: float  # 1: water and floor reach to the horizon; 0: they end at the walls, which show a grid


class Span(NamedTuple):
    """Where a ray is inside the box and under water (lengths along it), and the axes of the walls it passes."""

    enter: float
    leave: float
    enter_axis: int
    leave_axis: int
    dive: float
    rise: float
    by: Point  # one by each part of its direction, as divisions take long


@inlined
def mix(a, b, share):
    """A colour between two."""
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2])


@inlined
def _cut(o, inverse, low, high):
    """Where a ray passes between two planes."""
    a, b = (low - o) * inverse, (high - o) * inverse
    return min(a, b), max(a, b)


@inlined
def span_of(camera, box, d):
    """Return the `Span` of a ray from the eye."""
    reach = _SEA * box.sea
    by = 1.0 / d[0], 1.0 / d[1], 1.0 / d[2]
    x_in, x_out = _cut(camera.eye[0], by[0], box.lower[0] - reach, box.upper[0] + reach)
    y_in, y_out = _cut(camera.eye[1], by[1], box.lower[1] - reach, box.upper[1] + reach)
    z_in, z_out = _cut(camera.eye[2], by[2], box.lower[2], box.upper[2] + reach)
    dive, rise = _cut(camera.eye[2], by[2], box.lower[2], 0.0)
    side_in, side_out = max(x_in, y_in), min(x_out, y_out)
    enter_axis = 2 if z_in > side_in else (0 if x_in > y_in else 1)
    leave_axis = 2 if z_out < side_out else (0 if x_out < y_out else 1)
    dive, rise = max(max(dive, side_in), 0.0), min(rise, side_out)
    return Span(max(side_in, z_in), min(side_out, z_out), enter_axis, leave_axis, dive, rise, by)


@inlined
def _sharpness(camera, span, d, t, axis, normal):
    """Pixels a metre along an axis of a plane where a ray meets it; the plane's normal is another axis, both 0 to 2."""
    right, up, slope = camera.right, camera.up, d[axis] * span.by[normal]
    wide = abs(right[axis] - slope * right[normal]) + abs(up[axis] - slope * up[normal])
    return 1.0 / (t * camera.pixel * wide + 1e-9)


@inlined
def _stroke(distance, half_width, sharp):
    """How much of a pixel a line covers: distance (m) from its middle, half its width (m), and pixels a metre."""
    return max(0.0, min(1.0, 0.5 + (half_width - distance) * sharp)) * min(1.0, 2.0 * half_width * sharp)


@inlined
def _off_lines(value, low, high):
    """Distance to the nearest line of the grid along one axis, the box's edges included."""
    nearest = GRID * math.floor(value * (1.0 / GRID) + 0.5)
    edge = min(abs(value - low), abs(value - high))
    return min(abs(value - nearest), edge) if low < nearest and nearest < high else edge


@inlined
def _level_lines(camera, box, span, d, t, half_width):
    """Coverage by the grid's lines on a level plane."""
    x = _off_lines(camera.eye[0] + t * d[0], box.lower[0], box.upper[0])
    y = _off_lines(camera.eye[1] + t * d[1], box.lower[1], box.upper[1])
    across = _stroke(x, half_width, _sharpness(camera, span, d, t, 0, 2))
    return max(across, _stroke(y, half_width, _sharpness(camera, span, d, t, 1, 2)))


@inlined
def _haze(box, t):
    """Share of the horizon in what is so far away (m)."""
    share = t / (t + _HAZE)
    return box.sea * share * share


@inlined
def _wall(camera, box, span, axis, d, t):
    """How strongly a wall of the box is drawn at a point: (grid, edges with the waterline, transition zone)."""
    along = 1 - axis
    x, z, low, top = camera.eye[along] + t * d[along], camera.eye[2] + t * d[2], box.lower[along], box.upper[along]
    side, rise = _sharpness(camera, span, d, t, along, axis), _sharpness(camera, span, d, t, 2, axis)
    level = _stroke(_off_lines(z, box.lower[2], box.upper[2]), 0.035, rise)
    grid = max(_stroke(_off_lines(x, low, top), 0.035, side), level)
    edge = max(_stroke(min(abs(x - low), abs(x - top)), 0.05, side), _stroke(abs(z), 0.05, rise))
    return grid, edge, max(0.35 if abs(z) < box.zone else 0.0, _stroke(abs(abs(z) - box.zone), 0.03, rise))


@inlined
def exit_colour(camera, box, span, d):
    """What a ray sees that meets no shape: the sandy floor with its grid, far wall or sky."""
    if d[2] > 0.0:
        background = mix(_HORIZON, _ZENITH, min(1.7 * d[2], 1.0))
    else:
        background = mix(_HORIZON, _BELOW, min(-1.4 * d[2], 1.0))
    t = span.leave
    if t <= max(span.enter, 0.0):
        return background
    if span.leave_axis == 2:
        if d[2] >= 0.0:
            return background
        line = _level_lines(camera, box, span, d, t, 0.045)
        return mix(mix(_SAND, _LINE, 0.55 * line), _HORIZON, _haze(box, t))
    if box.sea > 0.0:
        return background
    grid, edge, band = _wall(camera, box, span, span.leave_axis, d, t)
    colour = mix(background, (0.34, 0.71, 0.91), 0.45 * band)
    return mix(colour, _LINE, max(0.30 * grid, 0.5 * edge))


@inlined
def near_wall(camera, box, span, d):
    """Colour and opacity of a wall that a ray passes on its way into the box: edges and zone only."""
    _, edge, band = _wall(camera, box, span, span.enter_axis, d, span.enter)
    return (0.10, 0.45, 0.70), max(0.35 * edge, 0.22 * band)


@inlined
def _swell(turns):
    """A wave of period 1 between -1 and 1, of parabolas: a third of the time of a sine."""
    phase = abs(turns - math.floor(turns) - 0.5)
    near = min(phase, 0.5 - phase)
    wave = 1.0 - 16.0 * near * near
    return wave if phase < 0.25 else -wave


@inlined
def surface(camera, box, span, d, t):
    """Colour and opacity of the water's surface, more of a mirror the flatter it is looked at."""
    x, y = camera.eye[0] + t * d[0], camera.eye[1] + t * d[1]
    line = _level_lines(camera, box, span, d, t, 0.03)
    wave = _swell(0.30 * x + 0.17 * y) + _swell(-0.21 * x + 0.36 * y + 0.2) + _swell(0.1 * x - 0.13 * y + 0.3)
    # waves that are narrower than a pixel would flicker
    wave = wave * max(0.0, 1.0 - t * camera.pixel * (1.0 + abs(span.by[2])))
    flat = 1.0 - abs(d[2])
    mirror = 0.04 + 0.96 * flat * flat * flat * flat * flat
    colour = mix(mix((0.42, 0.75, 0.92), (0.93, 0.97, 1.0), 0.35 + 0.10 * wave), (1.0, 1.0, 1.0), 0.7 * line)
    opacity = 0.16 + 0.55 * mirror + 0.03 * wave + 0.25 * line
    far = _haze(box, t)
    return mix(colour, _HORIZON, far), min(opacity + far, 0.95)
