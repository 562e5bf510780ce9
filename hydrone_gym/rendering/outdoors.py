"""Weather in pictures: lines on the moving surface, an arrow each for wind and current, and words for both."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._memory import unpacked
from hydrone_gym.simulation.conditions import Conditions
from hydrone_gym.weather.waves import elevation
from hydrone_gym.world.world import World

_LINES, _POINTS = 5, 33  # on the surface each way, and of each line
WIND_SCALE, CURRENT_SCALE = 0.5, 4.0  # m of arrow for 1 m/s
_LEAST = 0.01  # m/s: what is slower has no arrow
_ABOVE = np.array([0.0, 0.0, 1.0])  # m: the wind's arrow begins above the vehicle, the current's below
_HEAD = 0.3  # of an arrow's length
_BARBS = np.array([(-1.0, 0.5), (-1.0, -0.5)])


class Outdoors(NamedTuple):
    """What there is to draw of the weather at a moment."""

    wind: NDArray[np.float64]  # (2, 3) from above the vehicle (m) along the wind; equal ends without wind
    current: NDArray[np.float64]  # (2, 3) from below it, for the water
    waves: NDArray[np.float64]  # (L, P, 3) lines on the surface, m; none where it is flat
    level: float  # of the surface at the vehicle, m
    words: str


def outdoors(conditions: NDArray[np.float64], position: NDArray[np.float64], time: float, world: World) -> Outdoors:
    """Return what to draw of `Conditions` (as numbers) around a vehicle at a position (3,) in m, at a time (s)."""
    now: Conditions = unpacked(Conditions, conditions)
    wind, water = np.array(now.fluid[:3]), np.array(now.fluid[6:9])
    height = 2.0 * np.sqrt(sum(wave.amplitude**2 for wave in now.sea))
    flat = height == 0.0
    (x0, y0, _), (x1, y1, _) = world.lower, world.upper
    across, along = np.linspace(y0, y1, _LINES), np.linspace(x0, x1, _POINTS)
    one = np.stack(np.meshgrid(along, across), axis=-1)
    other = np.stack(np.meshgrid(np.linspace(x0, x1, _LINES), np.linspace(y0, y1, _POINTS), indexing="ij"), axis=-1)
    places = np.concatenate((one, other))
    level = elevation(now.sea, places[..., 0], places[..., 1], time)
    words = [f"wind {np.linalg.norm(wind):.1f} m/s", f"water {np.linalg.norm(water):.1f} m/s", f"waves {height:.2f} m"]
    there = (wind.any(), water.any(), not flat)
    return Outdoors(
        _arrow(position + _ABOVE, WIND_SCALE * wind, WIND_SCALE * _LEAST),
        _arrow(position - _ABOVE, CURRENT_SCALE * water, CURRENT_SCALE * _LEAST),
        np.concatenate((places, level[..., None]), axis=-1)[: 0 if flat else None],
        float(elevation(now.sea, position[0], position[1], time)),
        ", ".join(word for word, shown in zip(words, there, strict=True) if shown),
    )


def _arrow(position: NDArray[np.float64], along: NDArray[np.float64], least: float) -> NDArray[np.float64]:
    """Return the ends of an arrow from a position (m)."""
    return np.stack((position, position + along if np.linalg.norm(along) > least else position))


def barbed(arrow: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return an arrow's edges (3, 2, 3): its shaft and the two barbs of its head; all at one point without length."""
    start, end = arrow
    side = np.cross(end - start, (0.0, 0.0, 1.0))
    back = [end + _HEAD * (a * (end - start) + b * side) for a, b in _BARBS]
    return np.stack((arrow, (end, back[0]), (end, back[1])))
