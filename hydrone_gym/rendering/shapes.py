"""What a picture shows, as shapes for the ray caster: obstacles, vehicle, path, reference and goal."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from hydrone_gym.rendering import style
from hydrone_gym.rendering.camera import Pose
from hydrone_gym.rendering.outdoors import Outdoors, barbed
from hydrone_gym.rendering.paths import along
from hydrone_gym.rendering.solids import CAPSULE, DISC, OPACITY, SHADOW, SHAPE_FIELDS, SPHERE
from hydrone_gym.surface import in_air
from hydrone_gym.world.bodies import placed

Shades = tuple[str, str]  # away from and towards the sun
Shapes = NDArray[np.float64]  # (n, len(SHAPE_FIELDS))
_BLACK = ("#101010", "#4a4a4a")
_WHITE = ("#e8e8e8", "#ffffff")
_ORANGE = ("#8f3d00", "#ff7a1a")
_GOAL = ("#8a3f66", "#f39ac8")
_ARM = ("#10283a", "#4a6f8c")
_REAR = ("#10283a", "#f4f7fa")
_SHADE = ("#0a2238", "#0a2238")
_HAIR = 0.005  # m: a shadow lies on its ground
_WAVE, _CURRENT = ("#2a83b8", "#8fc9ec"), ("#003f66", style.BLUE)
_PLUMB = ("#4f6475", "#6d8596")


def _rows(
    kind: int, a: ArrayLike, b: ArrayLike, radius: ArrayLike, shades: Shades, opacity: float = 1.0, foam: float = 0.0
) -> Shapes:
    """Return shapes of equal colours; `a` is (n, 3), `b` (n, 3) or (3,), `radius` (n,) or a number, in m."""
    rows = np.empty((len(np.atleast_2d(a)), len(SHAPE_FIELDS)))
    rows[:, 0], rows[:, 1:4], rows[:, 4:7], rows[:, 7] = kind, a, b, radius
    rows[:, 8:] = *style.rgb(shades[0]), *style.rgb(shades[1]), opacity, foam
    return rows


def _model() -> dict[str, Shapes]:
    """The vehicle by parts, level, the arms on its axes as in the model, the front one on +x; an arm is 1 m long."""
    up, ends = np.array([0.0, 0.0, 1.0]), np.array([(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)])
    hubs, feet = ends + 0.12 * up, ends - 0.3 * up
    frame = (
        _rows(CAPSULE, -0.18 * up, 0.12 * up, 0.26, _ARM),
        _rows(CAPSULE, np.zeros((3, 3)), ends[1:], 0.11, _ARM),
        _rows(CAPSULE, feet, hubs, 0.066, _ARM),
        _rows(DISC, feet, up, 0.3, _ARM),
    )
    front = _rows(CAPSULE, np.zeros(3), ends[0], 0.132, _ORANGE), _rows(DISC, hubs[0], up, 0.62, _ORANGE)
    return {"frame": np.vstack(frame), "front": np.vstack(front), "rotors": _rows(DISC, hubs[1:], up, 0.62, _REAR)}


MODEL = _model()


def vehicle(state: NDArray[np.float64], arm: float, scale: float) -> Shapes:
    """The vehicle at a state (12,), so many times as large as it is; `arm` is from the middle to a rotor, m."""
    turn, size = Rotation.from_euler("ZXY", state[[5, 3, 4]]).as_matrix(), arm * scale
    rows = np.vstack(list(MODEL.values()))
    ends = rows[:, 4:7] @ turn.T
    rows[:, 1:4] = state[:3] + size * rows[:, 1:4] @ turn.T
    rows[:, 4:7] = np.where(rows[:, :1] == CAPSULE, state[:3] + size * ends, ends)
    rows[:, 7] *= size
    return rows


def obstacles(bodies: NDArray[np.float64], detected: NDArray[np.bool_], veiled: NDArray[np.bool_]) -> Shapes:
    """Obstacles (M, BODY): dark where detected (M,), dark glass if also veiled (M,), else clear glass."""
    middles, radii = placed(bodies)
    rows = _rows(SPHERE, middles, 0.0, radii, style.DETECTED, foam=1.0)
    glass = _rows(SPHERE, middles, 0.0, radii, style.GLASS, opacity=0.8, foam=1.0)
    rows[detected & veiled, OPACITY] = 0.7
    return np.where(detected[:, None], rows, glass)


def shadow(position: NDArray[np.float64], floor: float, radius: float) -> Shapes:
    """The vehicle's shadow on what is below it, water or floor (at z = `floor`), wider and fainter from high above."""
    ground = 0.0 if in_air(position[2]) else floor
    height = max(position[2] - ground, 0.0)
    below = np.array([position[0], position[1], ground + _HAIR])
    return _rows(SHADOW, below, (0.0, 0.0, 1.0), radius * (1.0 + 0.06 * height), _SHADE, 0.5 / (1.0 + 0.08 * height))


def path(points: NDArray[np.float64], radius: float) -> Shapes:
    """The flown path (N, 3) as a tube, with a ball at its start."""
    # one point a stretch, counted from the start, so that the tube does not shimmer as the path grows
    steps = np.floor(along(points) / (2.0 * radius)).astype(np.int64)
    new = np.diff(steps, prepend=-1) > 0
    new[-1] = True
    chosen = points[new]
    moved = (chosen[1:] != chosen[:-1]).any(axis=1)
    tube = _rows(CAPSULE, chosen[:-1][moved], chosen[1:][moved], radius, _ORANGE)
    return np.vstack((_rows(SPHERE, points[0], 0.0, 2.2 * radius, _BLACK), tube))


def weather(seen: Outdoors, radius: float) -> Shapes:
    """Lines on the moving surface, and arrows along wind (black) and current (blue), so thick (m)."""
    lines = seen.waves.reshape(-1, *seen.waves.shape[-2:])
    starts, ends = lines[:, :-1].reshape(-1, 3), lines[:, 1:].reshape(-1, 3)
    wind, water = barbed(seen.wind), barbed(seen.current)
    blown, flowing = (np.ptp(edges[0], axis=0).any() for edges in (wind, water))
    parts = (
        _rows(CAPSULE, starts, ends, 0.7 * radius, _WAVE) if len(starts) else np.empty((0, len(SHAPE_FIELDS))),
        _rows(CAPSULE, wind[:, 0], wind[:, 1], radius, _BLACK)[: 3 * blown],
        _rows(CAPSULE, water[:, 0], water[:, 1], radius, _CURRENT)[: 3 * flowing],
    )
    return np.vstack(parts)


def plumb(point: NDArray[np.float64], radius: float, level: float = 0.0) -> Shapes:
    """A thin vertical line from a point (3,) in m to the water surface, whose level (m) may be another in waves."""
    foot = np.array([point[0], point[1], level])
    return _rows(CAPSULE, point, foot, radius, _PLUMB)[: int(abs(point[2] - level) > 1e-3)]


def goal(position: NDArray[np.float64], reach: float, pose: Pose, arm: float, radius: float) -> Shapes:
    """The goal: a glass ball within which it counts as reached (m), and a cross that faces the camera."""
    ends = arm * np.array([pose.right + pose.up, pose.right - pose.up]) / np.sqrt(2.0)
    ball = _rows(SPHERE, position, 0.0, reach, (_GOAL[0], style.PURPLE), opacity=0.9)
    return np.vstack((_rows(CAPSULE, position - ends, position + ends, radius, _GOAL), ball))


def reference(position: NDArray[np.float64], pose: Pose, size: float, radius: float) -> Shapes:
    """The reference: a black ring with a dot, which faces the camera, edged in white to be seen on dark obstacles."""
    turns = np.linspace(0.0, 2.0 * np.pi, 17)[:, None]
    ring = position + size * (np.cos(turns) * pose.right + np.sin(turns) * pose.up)
    edge = ring + 2.0 * radius * pose.forward
    parts = (
        _rows(CAPSULE, ring[:-1], ring[1:], radius, _BLACK),
        _rows(CAPSULE, edge[:-1], edge[1:], 1.8 * radius, _WHITE),
        _rows(SPHERE, position, 0.0, 1.4 * radius, _BLACK),
        _rows(SPHERE, position + 3.0 * radius * pose.forward, 0.0, 2.4 * radius, _WHITE),
    )
    return np.vstack(parts)
