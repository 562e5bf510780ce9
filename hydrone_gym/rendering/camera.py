"""Where a picture is taken from and how large it is, and which part of it a shape can reach."""

import itertools
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hydrone_gym.world.world import World

CAMERAS = ("overview", "chase")
LEAST, MOST = 64, 4096  # pixels
ELEVATION = 20.0  # degrees, of cameras that see the whole box
FIELD_OF_VIEW = 32.0  # degrees, over the height of the picture
CHASE_FIELD = 50.0
_BACK, _ABOVE, _AHEAD = 5.0, 2.3, 1.0  # m: where the chase camera is, and how far before the vehicle it looks
_TICKS_REMEMBERED = 0.033  # share by which a move counts less with every tick since: half of it after 1 s
_MARGIN = 0.97  # of the picture that the box may fill


@dataclass(frozen=True, kw_only=True)
class View:
    """What a picture is like; ValueError for a value out of range names the option, its rule and the value."""

    size: tuple[int, int] = (640, 480)  # width and height, pixels; even, as video codecs demand
    camera: str = "overview"  # or "chase"

    def __post_init__(self) -> None:
        if self.camera not in CAMERAS:
            raise ValueError(f"camera must be one of {', '.join(map(repr, CAMERAS))}, got {self.camera!r}")
        rule = f"render_size must be two even whole numbers from {LEAST} to {MOST} (pixels)"
        if not isinstance(self.size, tuple | list) or len(self.size) != 2 or not all(map(_fits, self.size)):
            raise ValueError(f"{rule}, got {self.size!r}")
        object.__setattr__(self, "size", tuple(map(int, self.size)))


def _fits(n: Any) -> bool:
    return isinstance(n, int) and not isinstance(n, bool) and LEAST <= n <= MOST and n % 2 == 0


class Pose(NamedTuple):
    """A camera: its eye (m) and the unit vectors to its right, up and forward, each (3,); field of view in degrees."""

    eye: NDArray[np.float64]
    right: NDArray[np.float64]
    up: NDArray[np.float64]
    forward: NDArray[np.float64]
    field: float

    def pixel(self, height: int) -> float:
        """Width of a pixel at distance 1, for a picture so many pixels high."""
        return float(2.0 * np.tan(np.radians(0.5 * self.field)) / height)

    def project(self, points: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.float64]:
        """Return where points (n, 3) in m appear, (n, 2) columns and rows, in a picture of width and height `size`."""
        offsets = points - self.eye
        depth = self.pixel(size[1]) * (offsets @ self.forward)
        across, upward = offsets @ self.right / depth, offsets @ self.up / depth
        return np.stack((0.5 * size[0] + across, 0.5 * size[1] - upward), axis=1)


def looking(direction: NDArray[np.float64], eye: NDArray[np.float64], field: float) -> Pose:
    """Return the level camera at an eye (m) that looks along a direction, which must not be vertical."""
    forward = direction / np.linalg.norm(direction)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return Pose(eye, right, np.cross(right, forward), forward, field)


def axes(azimuth: float, elevation: float) -> NDArray[np.float64]:
    """Return right, up and towards the eye (3, 3), unit vectors, of a camera that stands at these angles, degrees."""
    a, e = np.radians([azimuth, elevation])
    right, up = (-np.sin(a), np.cos(a), 0.0), (-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e))
    return np.array([right, up, (np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e))])


def overview(corners: NDArray[np.float64], azimuth: float, elevation: float, aspect: float) -> Pose:
    """Return the nearest camera that sees all of some points (n, 3) m; it stands at these angles, degrees, from them.

    `aspect` is width by height of the picture.
    """
    pose = looking(-axes(azimuth, elevation)[2], np.zeros(3), FIELD_OF_VIEW)
    tangent = np.tan(np.radians(0.5 * FIELD_OF_VIEW)) * _MARGIN
    depth = corners @ pose.forward
    # a corner is in view when its offset to each side is at most tangent times its depth: linear in the eye's place
    sides = [(corners @ pose.right, tangent * aspect), (corners @ pose.up, tangent)]
    spans = [((side - k * depth).max(), (side + k * depth).min(), k) for side, k in sides]
    back = max((high - low) / (2.0 * k) for high, low, k in spans)
    across, upward = (0.5 * (high + low) for high, low, _ in spans)
    return pose._replace(eye=across * pose.right + upward * pose.up - back * pose.forward)


def side_azimuth(start: ArrayLike, goal: ArrayLike) -> float:
    """Return the azimuth (degrees) from which the way from start to goal (m) is seen from the side."""
    x, y, _ = np.subtract(goal, start)
    return float(np.degrees(np.arctan2(y, x))) - 75.0


def beside(world: World, start: ArrayLike, goal: ArrayLike, aspect: float) -> Pose:
    """Return the camera that sees the whole box from the side of the way from start to goal (m)."""
    corners = np.array(list(itertools.product(*zip(world.lower, world.upper, strict=True))))
    return overview(corners, side_azimuth(start, goal), ELEVATION, aspect)


def chase(path: NDArray[np.float64], goal: NDArray[np.float64]) -> Pose:
    """Return the camera that follows a vehicle, which was at `path` (N, 3) m at every tick.

    It stands behind and above as the vehicle has been moving lately, which turns slowly, whatever the heading. Before
    the vehicle has moved it looks towards the goal (3,) m.
    """
    moves = np.diff(path[:, :2], axis=0)
    recent = np.exp(-_TICKS_REMEMBERED * np.arange(len(moves))[::-1])
    ahead = goal[:2] - path[0, :2]
    distance = float(np.linalg.norm(ahead))
    ahead = ahead / distance if distance > 0.0 else np.array([1.0, 0.0])
    lead = ahead + recent @ moves
    length = float(np.linalg.norm(lead))
    forward = np.append(lead / length if length > 1e-6 else ahead, 0.0)
    up = np.array([0.0, 0.0, 1.0])
    return looking((_BACK + _AHEAD) * forward - _ABOVE * up, path[-1] - _BACK * forward + _ABOVE * up, CHASE_FIELD)


def outlines(
    pose: Pose, ends: NDArray[np.float64], radii: NDArray[np.float64], size: tuple[int, int], tile: int
) -> NDArray[np.int64]:
    """Return the tiles of a picture that shapes can reach: (n, 4) first column and row, last of each, excluded.

    A shape lies in the hull of two balls: `ends` (n, 2, 3) and `radii` (n,) in m. `size` and `tile` are in pixels.
    """
    offsets, r = ends - pose.eye, radii[:, None]
    side, depth = np.stack((offsets @ pose.right, -(offsets @ pose.up))), offsets @ pose.forward
    near, gap = depth <= 1.001 * r, depth**2 - r**2
    # tangents from the eye to the ball, in the planes of depth and columns, and of depth and rows
    root = r * np.sqrt(np.maximum(side**2 + gap, 0.0))
    scale, middle = np.where(near, 1.0, gap) * pose.pixel(size[1]), 0.5 * np.reshape(size, (2, 1, 1))
    low = np.where(near, -np.inf, (side * depth - root) / scale + middle).min(axis=2) - 1.0
    high = np.where(near, np.inf, (side * depth + root) / scale + middle).max(axis=2) + 1.0
    reach = np.vstack((np.floor(low / tile), np.floor(high / tile) + 1.0)).T
    tiles = np.clip(reach, 0.0, np.tile(np.ceil(np.divide(size, tile)), 2)).astype(np.int64)
    tiles[(depth + r <= 0.0).all(axis=1)] = 0  # wholly behind the eye
    return tiles
