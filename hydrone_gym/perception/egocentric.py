"""The egocentric interface: what a learner wants to see and to say, made from what `interface="world"` gives.

One set of kernels reads what is `Perceived`, be it of an environment's rows or of a raw observation: a policy trained
here flies through the raw interface with the same numbers bit for bit. Besides the raw observation it needs what a
policy can carry itself (`EgocentricMemory`): where the episode started and how progress goes.

**Mission frame.** x' points horizontally from the episode's start to its goal, y' to its left, z up; it stays as it is
for the whole episode. If the goal lies straight above or below the start, x' is the world's x. Every horizontal vector
is expressed in it: what is learned on one mission then holds on any other, however it lies in the world.

**Observation** (68,) float32, every entry finite and clipped to [-5, 5]; three-vectors are x', y', z:

| index | content | scale |
|---|---|---|
| 0-2 | goal less position, coarse | 1/5 m |
| 3-5 | goal less position, near: its direction, shrinking within the last metre | 2 d / max(1 m, abs(d)) |
| 6 | height above the surface | 1/3 m |
| 7-9 | velocity | 1 m/s |
| 10, 11 | roll, pitch | 1/3 rad |
| 12, 13 | sine and cosine of the yaw, from x' | 1 |
| 14-16 | reference now in force less position | 1 m |
| 17 | medium | air 1, water -1 |
| 18 | inside the transition zone | 1, else 0 |
| 19-24 | distance to the box along x', -x', y', -y', up, down | 1/5 m |
| 25, 26 | distance to the goal, horizontal and vertical, both positive | 1/5 m |
| 27-38 | rays at -40 degrees elevation, 12 azimuths counter-clockwise from x' | 1/4 m; 1: free for 4 m |
| 39-50 | rays at 0 degrees | as above |
| 51-62 | rays at 40 degrees | as above |
| 63-66 | rays up, down, to the goal, along the velocity (1 at rest) | as above |
| 67 | progress clock | 1/10 period |

Rays are those of `hydrone_gym.perception.rays`. The progress clock counts the periods since the time-to-go in an empty
world last fell below its least value so far: it tells a detour that goes on from one that has begun, which no single
observation does.

**Action** (3,) in [-1, 1]: the reference's offset from the vehicle, 2, 2 and 1.5 m along x', y', z; the reference is
kept 0.2 m inside the box and rounded to float32, so it is an action of the raw interface. Yaw is not chosen, because no
mission needs it: in air the yaw reference stays as it is, in water, where the heading follows the line of sight and the
yaw reference is unused, it is the heading of the moment, so that the vehicle does not turn when it leaves the water.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hydrone_gym._jit import inlined, kernel
from hydrone_gym.control.laws import envelope_of
from hydrone_gym.perception.perceived import Perceived, perceive
from hydrone_gym.perception.rays import FIXED, RAY_NAMES, cast_along, cast_fixed, leave_box
from hydrone_gym.physics.trigonometry import sincos
from hydrone_gym.simulation.storage import new_rows
from hydrone_gym.simulation.time_to_go import CruiseSpeeds, cruise_speeds, time_to_go
from hydrone_gym.surface import is_air
from hydrone_gym.vehicle import Vehicle
from hydrone_gym.world.world import World

RawObservation = Mapping[str, NDArray]

LIMIT = 5.0  # of every entry of an observation
STEP = (2.0, 2.0, 1.5)  # m along x', y', z at full action: 3.2 m at most, about as far as the vehicle senses
MARGIN = 0.2  # m: the nearest a reference comes to the box

_BOX = [(name, np.float64) for name in ("x_min", "y_min", "z_min", "x_max", "y_max", "z_max", "zone", "radius")]  # m
EGOCENTRIC = np.dtype([*_BOX, ("speeds", [(name, np.float64) for name in CruiseSpeeds._fields])])


def _axes(word: str) -> list[str]:
    return [f"{word}_{axis}" for axis in ("ahead", "left", "up")]


_VEHICLE = ("height", *_axes("velocity"), "roll", "pitch", "sin_yaw", "cos_yaw", *_axes("reference"), "medium", "zone")
_WALLS = [f"wall_{side}" for side in ("ahead", "behind", "left", "right", "up", "down")]
_WAYS = (*_WALLS, "goal_horizontal", "goal_vertical", *RAY_NAMES)
NAMES = (*_axes("goal"), *_axes("goal_near"), *_VEHICLE, *_WAYS, "clock")
OBSERVATION_SIZE = len(NAMES)
_RAYS = NAMES.index(RAY_NAMES[0])
_CLOCK = NAMES.index("clock")
LEAST = 3  # column of a memory, after the start and before the clock
_COARSE, _HEIGHT, _ANGLE, _WALL, _PERIODS = 1.0 / 5.0, 1.0 / 3.0, 3.0, 1.0 / 5.0, 1.0 / 10.0


@inlined
def _clip(value):
    """Bring a value into [-LIMIT, LIMIT]; what is not a number reads -LIMIT."""
    return LIMIT if value > LIMIT else (value if value > -LIMIT else -LIMIT)


class EgocentricMemory(NamedTuple):
    """What a policy carries from one observation to the next; a leading axis for a batch."""

    start: NDArray[np.float64]  # (3,) where the episode started, m
    least: NDArray[np.float64]  # () least time-to-go so far, s; infinity: an episode begins
    clock: NDArray[np.float64]  # () periods since it last fell


def pack_egocentric(vehicle: Vehicle, world: World, law: str = "paper") -> np.ndarray:
    """Return the constants of the interface as one record (1,), dtype `EGOCENTRIC`."""
    speeds = tuple(cruise_speeds(envelope_of(vehicle, law)))
    return np.array([(*world.lower, *world.upper, world.zone, vehicle.radius, speeds)], EGOCENTRIC)


@inlined
def mission_frame(start_x, start_y, goal_x, goal_y):
    """Cosine and sine of the azimuth of x'; of the world's x where start and goal (m) give none."""
    dx, dy = goal_x - start_x, goal_y - start_y
    length = np.sqrt(dx * dx + dy * dy)
    level = 1e-6 <= length < np.inf
    return (dx / length if level else 1.0), (dy / length if level else 0.0)


@inlined
def _inside(value, low, high):
    """Keep a coordinate (m) MARGIN inside two walls, as float32 would; NaN stays NaN."""
    low, high = low + MARGIN, high - MARGIN
    return np.float64(np.float32(low if value < low else (high if value > high else value)))


@inlined
def _unit(value):
    """Clip to [-1, 1]; NaN stays NaN."""
    return -1.0 if value < -1.0 else (1.0 if value > 1.0 else value)


@inlined
def _put3(out, first, vector, frame, scale):
    """Write a vector (x, y, z in the world frame) to three columns, in the mission frame."""
    x, y, z = vector
    cosine, sine = frame
    out[first] = _clip((cosine * x + sine * y) * scale)
    out[first + 1] = _clip((cosine * y - sine * x) * scale)
    out[first + 2] = _clip(z * scale)


@inlined
def _write_vehicle(out, told, frame, p):
    """Write what a row says about the vehicle, its goal and the box: columns before the rays."""
    s, reference, goal = told.state, told.reference, told.goal
    cosine, sine = frame
    x, y, z = s[0], s[1], s[2]
    dx, dy, dz = goal[0] - x, goal[1] - y, goal[2] - z
    across2 = dx * dx + dy * dy
    _put3(out, 0, (dx, dy, dz), frame, _COARSE)
    _put3(out, 3, (dx, dy, dz), frame, 2.0 / max(np.sqrt(across2 + dz * dz), 1.0))
    out[6] = _clip(z * _HEIGHT)
    _put3(out, 7, (s[6], s[7], s[8]), frame, 1.0)
    out[10], out[11] = _clip(_ANGLE * s[3]), _clip(_ANGLE * s[4])
    sin_yaw, cos_yaw = sincos(s[5])
    out[12] = _clip(sin_yaw * cosine - cos_yaw * sine)
    out[13] = _clip(cos_yaw * cosine + sin_yaw * sine)
    _put3(out, 14, (reference[0] - x, reference[1] - y, reference[2] - z), frame, 1.0)
    out[17] = 1.0 if is_air(z) else -1.0
    out[18] = 1.0 if abs(z) <= p.zone else 0.0
    along, across = cosine, sine
    for side in range(19, 23):  # ahead, behind, left, right
        out[side] = _clip(_WALL * leave_box((x, y, z), (along, across, 0.0), p))
        along, across = (across, -along) if side == 20 else (-along, -across)
    out[23], out[24] = _clip(_WALL * (p.z_max - z)), _clip(_WALL * (z - p.z_min))
    out[25], out[26] = _clip(_COARSE * np.sqrt(across2)), _clip(_COARSE * abs(dz))


@inlined
def _remember(memory, state, goal, speeds):
    """Move a row's memory on by a period; its start and clock are set where an episode begins."""
    if memory[LEAST] == np.inf:
        for c in range(3):
            memory[c] = state[c]
    remaining = time_to_go(state[0], state[1], state[2], goal[0], goal[1], goal[2], speeds)
    memory[LEAST + 1] = 0.0 if remaining < memory[LEAST] else memory[LEAST + 1] + 1.0
    memory[LEAST] = remaining if remaining < memory[LEAST] else memory[LEAST]


@kernel
def observe_rows(told, obstacles, found, memory, order, values, seen):
    """Write `seen` (n, OBSERVATION_SIZE) of rows `order` (k,), and move `memory` (n, 5) on: once a period."""
    params = values[0]
    for k in range(order.size):
        n = order[k]
        row, own, spheres, out = told[n], memory[n], obstacles[n], seen[n]
        s, goal = row.state, row.goal
        _remember(own, s, goal, params.speeds)
        frame = mission_frame(own[0], own[1], goal[0], goal[1])
        _write_vehicle(out, row, frame, params)
        place = (s[0], s[1], s[2])
        cast_fixed(out, _RAYS, place, frame, spheres, found[n], params)
        ahead = (goal[0] - s[0], goal[1] - s[1], goal[2] - s[2])
        out[_RAYS + FIXED] = cast_along(place, ahead, spheres, found[n], params)
        out[_RAYS + FIXED + 1] = cast_along(place, (s[6], s[7], s[8]), spheres, found[n], params)
        out[_CLOCK] = _clip(_PERIODS * own[LEAST + 1])


@kernel
def place_references(told, actions, memory, values, out):
    """Write the references (n, 4), in m, m, m, rad and every number a float32, of relative actions (n, 3), float32.

    `told` is of a `Perceived`, `memory` (n, 3 or more) where the episodes started, x, y, z in m.
    """
    p = values[0]
    for n in range(out.shape[0]):
        row = told[n]
        s, goal = row.state, row.goal
        cosine, sine = mission_frame(memory[n, 0], memory[n, 1], goal[0], goal[1])
        ahead = STEP[0] * _unit(np.float64(actions[n, 0]))
        left = STEP[1] * _unit(np.float64(actions[n, 1]))
        out[n, 0] = _inside(s[0] + (cosine * ahead - sine * left), p.x_min, p.x_max)
        out[n, 1] = _inside(s[1] + (sine * ahead + cosine * left), p.y_min, p.y_max)
        out[n, 2] = _inside(s[2] + STEP[2] * _unit(np.float64(actions[n, 2])), p.z_min, p.z_max)
        out[n, 3] = np.float64(np.float32(row.reference[3] if is_air(s[2]) else s[5]))


def new_memory(count: int) -> NDArray[np.float64]:
    """Return (n, 5) a `EgocentricMemory` a row, of episodes that begin."""
    return np.tile([0.0, 0.0, 0.0, np.inf, 0.0], (count, 1))


class Egocentric:
    """Sees and acts as `interface="egocentric"` does: for environments, and through the raw interface, bit for bit."""

    def __init__(self, model: Any) -> None:
        """Pack what is believed: a model's vehicle, world and, if it has one, law."""
        law: Any = getattr(model, "controller", None) or getattr(model, "law", "paper")
        self.values = pack_egocentric(model.vehicle, model.world, law)

    def look(
        self, perceived: Perceived, memory: NDArray[np.float64], rows: NDArray[np.int64], seen: NDArray[np.float32]
    ) -> None:
        """Look at rows (k,) once a period: writes `seen` (n, OBSERVATION_SIZE), moves `memory` (n, 5) on."""
        observe_rows(*perceived, memory, rows, self.values, seen)

    def place(
        self, perceived: Perceived, memory: NDArray[np.float64], actions: NDArray[np.float32]
    ) -> NDArray[np.float64]:
        """Return the references (n, 4), every number a float32, of relative actions (n, 3), clipped to [-1, 1]."""
        out = np.empty((len(actions), 4))
        place_references(perceived.told, np.ascontiguousarray(actions), memory, self.values, out)
        return out

    def observe(
        self, observation: RawObservation, memory: EgocentricMemory | None = None, starting: ArrayLike | None = None
    ) -> tuple[NDArray[np.float32], EgocentricMemory]:
        """Return the flat observation, (68,) or (n, 68), and the new memory; call it once a period.

        `memory` is what the last call returned, None where all episodes begin; it is dropped where `starting`, () or
        (n,), is True. Nothing given is changed or shared. Raises ValueError for a missing key or a wrong shape.
        """
        perceived, single = _load(observation)
        count = len(perceived.told)
        memories, out = new_memory(count), np.empty((count, OBSERVATION_SIZE), np.float32)
        if memory is not None:
            parts = (memories[:, :LEAST], memories[:, LEAST], memories[:, LEAST + 1])
            for name, own, given in zip(EgocentricMemory._fields, parts, memory):
                own[:] = _shaped(f"memory.{name}", given, own.shape, single)
        if starting is not None:
            memories[_shaped("starting", starting, (count,), single) != 0.0, LEAST] = np.inf
        self.look(perceived, memories, np.arange(count), out)
        if single:
            memories, out = memories[0], out[0]
        return out, EgocentricMemory(memories[..., :LEAST].copy(), *memories[..., LEAST:].T.copy())

    def reference(
        self, action: ArrayLike, observation: RawObservation, memory: EgocentricMemory
    ) -> NDArray[np.float32]:
        """Return the raw action, (4,) or (n, 4) float32 in m, m, m, rad, that a relative action stands for.

        `action` is (3,) or (n, 3), clipped to [-1, 1]; `memory` is what `observe` returned for the observation. Raises
        ValueError for a missing key, a wrong shape, or an action that is not finite.
        """
        perceived, single = _load(observation)
        count = len(perceived.told)
        wanted = _shaped("action", action, (count, 3), single)
        if not np.isfinite(wanted).all():
            raise ValueError(f"action must be finite, got {action!r}")
        starts = np.ascontiguousarray(_shaped("memory.start", memory.start, (count, 3), single))
        out = self.place(perceived, starts, wanted.astype(np.float32))
        return (out[0] if single else out).astype(np.float32)


def _shaped(name: str, given: ArrayLike, shape: tuple[int, ...], single: bool) -> NDArray[np.float64]:
    """Check an array against (n, ...), or (...) for a single one, and return it as (n, ...) float64."""
    array, wanted = np.asarray(given, np.float64), shape[1:] if single else shape
    if array.shape != wanted:
        raise ValueError(f"{name} must have shape {wanted}, got {array.shape}")
    return array.reshape(shape)


def _load(observation: RawObservation) -> tuple[Perceived, bool]:
    """Return what a raw observation tells, and whether it was a single one."""
    missing = [key for key in ("state", "reference", "goal", "obstacles") if key not in observation]
    if missing:
        raise ValueError(f"observation lacks {', '.join(missing)}; it must be one of interface='world'")
    single = np.ndim(observation["state"]) == 1
    rows = new_rows(1 if single else len(observation["state"]))
    for key in ("state", "reference", "goal"):
        rows[key] = _shaped(f"observation[{key!r}]", observation[key], rows[key].shape, single)
    most = np.shape(observation["obstacles"])[-2:-1] or (0,)
    spheres = _shaped("observation['obstacles']", observation["obstacles"], (len(rows), *most, 4), single)
    found = np.count_nonzero(spheres[:, :, 3] > 0.0, axis=1)
    return perceive(rows, np.ascontiguousarray(spheres), found), single
