"""The egocentric interface: what a learner wants to see and to say, made from what `interface="world"` gives.

One set of kernels serves the environments, row by row in their storage, and `Egocentric`, which takes a raw
observation: a policy trained here flies through the raw interface with the same numbers bit for bit. Besides the raw
observation it needs what a policy can carry itself (`Memory`): where the episode started and how progress goes.

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

Rays are those of `hydrone_gym.envs.rays`. The progress clock counts the periods since the time-to-go in an empty world
last fell below its least value so far: it tells a detour that goes on from one that has begun, which no single
observation does.

**Action** (3,) in [-1, 1]: the reference's offset from the vehicle, 2, 2 and 1.5 m along x', y', z; the reference is
kept 0.2 m inside the box and rounded to float32, so it is an action of the raw interface. Yaw is not chosen, because no
mission needs it: in air the yaw reference stays as it is, in water, where the heading follows the line of sight and the
yaw reference is unused, it is the heading of the moment, so that the vehicle does not turn when it leaves the water.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from hydrone_gym._jit import inlined, kernel
from hydrone_gym.envs.rays import FIXED, RAY_NAMES, cast_along, cast_fixed, leave_box
from hydrone_gym.envs.relative import (
    mission_frame,
    pack_egocentric,
    place_references,
    relative_action_space,
    unpack_egocentric,
)
from hydrone_gym.physics.trigonometry import sincos
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.simulation.storage import new_rows
from hydrone_gym.simulation.time_to_go import time_to_go
from hydrone_gym.surface import is_air

__all__ = [
    "NAMES",
    "OBSERVATION_SIZE",
    "Egocentric",
    "Memory",
    "egocentric_space",
    "observe",
    "observe_rows",
    "pack_egocentric",
    "place_references",
    "relative_action_space",
]

RawObservation = Mapping[str, NDArray]

LIMIT = 5.0  # of every entry

_AXES = ("ahead", "left", "up")
NAMES = (
    *(f"goal_{axis}" for axis in _AXES),
    *(f"goal_near_{axis}" for axis in _AXES),
    "height",
    *(f"velocity_{axis}" for axis in _AXES),
    "roll",
    "pitch",
    "sin_yaw",
    "cos_yaw",
    *(f"reference_{axis}" for axis in _AXES),
    "medium",
    "zone",
    *(f"wall_{side}" for side in ("ahead", "behind", "left", "right", "up", "down")),
    "goal_horizontal",
    "goal_vertical",
    *RAY_NAMES,
    "clock",
)
OBSERVATION_SIZE = len(NAMES)
_RAYS = NAMES.index(RAY_NAMES[0])
_CLOCK = NAMES.index("clock")
_COARSE, _HEIGHT, _ANGLE, _WALL, _PERIODS = 1.0 / 5.0, 1.0 / 3.0, 3.0, 1.0 / 5.0, 1.0 / 10.0


@inlined
def _clip(value):
    """Bring a value into [-LIMIT, LIMIT]; what is not a number reads -LIMIT."""
    return LIMIT if value > LIMIT else (value if value > -LIMIT else -LIMIT)


@inlined
def _put3(out, n, first, x, y, z, cosine, sine, scale):
    """Write a vector (world frame) to three columns of row n, in the mission frame."""
    out[n, first] = _clip((cosine * x + sine * y) * scale)
    out[n, first + 1] = _clip((cosine * y - sine * x) * scale)
    out[n, first + 2] = _clip(z * scale)


@inlined
def _write_vehicle(out, n, s, reference, goal, cosine, sine, p):
    """Write what row n says about the vehicle, its goal and the box: columns before the rays."""
    x, y, z = s[0], s[1], s[2]
    dx, dy, dz = goal[0] - x, goal[1] - y, goal[2] - z
    across2 = dx * dx + dy * dy
    _put3(out, n, 0, dx, dy, dz, cosine, sine, _COARSE)
    _put3(out, n, 3, dx, dy, dz, cosine, sine, 2.0 / max(np.sqrt(across2 + dz * dz), 1.0))
    out[n, 6] = _clip(z * _HEIGHT)
    _put3(out, n, 7, s[6], s[7], s[8], cosine, sine, 1.0)
    out[n, 10], out[n, 11] = _clip(_ANGLE * s[3]), _clip(_ANGLE * s[4])
    sin_yaw, cos_yaw = sincos(s[5])
    out[n, 12] = _clip(sin_yaw * cosine - cos_yaw * sine)
    out[n, 13] = _clip(cos_yaw * cosine + sin_yaw * sine)
    _put3(out, n, 14, reference[0] - x, reference[1] - y, reference[2] - z, cosine, sine, 1.0)
    out[n, 17] = 1.0 if is_air(z) else -1.0
    out[n, 18] = 1.0 if abs(z) <= p.zone else 0.0
    along, across = cosine, sine
    for side in range(19, 23):  # ahead, behind, left, right
        out[n, side] = _clip(_WALL * leave_box(x, y, z, along, across, 0.0, p))
        along, across = (across, -along) if side == 20 else (-along, -across)
    out[n, 23], out[n, 24] = _clip(_WALL * (p.z_max - z)), _clip(_WALL * (z - p.z_min))
    out[n, 25], out[n, 26] = _clip(_COARSE * np.sqrt(across2)), _clip(_COARSE * abs(dz))


@inlined
def observe(out, n, state, reference, goal, known, found, starts, least, clock, params):
    """Write row n of the observation and move its memory on: once a period, neither more nor less.

    Args:
        out: (rows, OBSERVATION_SIZE) float32, row n written.
        n: row of `out`, `known`, `found`, `starts`, `least` and `clock`.
        state, reference, goal: (12,), (4,), (3,) of that row, as in the raw observation.
        known, found: (rows, M, 4) detected spheres (m) and how many there are.
        starts: (rows, 3) where the episode started, m.
        least: (rows,) least time-to-go so far, s; infinity begins an episode: start and clock are set from here.
        clock: (rows,) periods since it last fell.
        params: `EgocentricParams`.
    """
    if least[n] == np.inf:
        for c in range(3):
            starts[n, c] = state[c]
    remaining = time_to_go(state[0], state[1], state[2], goal[0], goal[1], goal[2], params.speeds)
    clock[n] = 0.0 if remaining < least[n] else clock[n] + 1.0
    least[n] = remaining if remaining < least[n] else least[n]
    cosine, sine = mission_frame(starts[n, 0], starts[n, 1], goal[0], goal[1])
    _write_vehicle(out, n, state, reference, goal, cosine, sine, params)
    cast_fixed(out, n, _RAYS, state, cosine, sine, known, found, params, params.radius)
    dx, dy, dz = goal[0] - state[0], goal[1] - state[1], goal[2] - state[2]
    out[n, _RAYS + FIXED] = cast_along(n, state, dx, dy, dz, known, found, params, params.radius)
    vx, vy, vz = state[6], state[7], state[8]
    out[n, _RAYS + FIXED + 1] = cast_along(n, state, vx, vy, vz, known, found, params, params.radius)
    out[n, _CLOCK] = _clip(_PERIODS * clock[n])


@kernel
def observe_rows(rows, known, found, starts, least, clock, values, first, last, out):
    """Write the observation of rows [first, last) and move their memory on; arguments as in `observe`.

    Args:
        rows: (n,) dtype `ROW`.
        known, found: (n, M, 4) float64 and (n,) int64.
        starts, least, clock: (n, 3), (n,), (n,) float64, updated; least = infinity where an episode begins.
        values: from `pack_egocentric`.
        first, last: which rows.
        out: (n, OBSERVATION_SIZE) float32.
    """
    params = unpack_egocentric(values)
    for n in range(first, last):
        row = rows[n]
        observe(out, n, row.state, row.reference, row.goal, known, found, starts, least, clock, params)


def egocentric_space() -> spaces.Box:
    """Observations, (68,) float32 in [-5, 5]."""
    return spaces.Box(-LIMIT, LIMIT, (OBSERVATION_SIZE,), np.float32)


class Memory(NamedTuple):
    """What a policy carries from one observation to the next; a leading axis for a batch."""

    start: NDArray[np.float64]  # (3,) where the episode started, m
    least: NDArray[np.float64]  # () least time-to-go so far, s; infinity: an episode begins
    clock: NDArray[np.float64]  # () periods since it last fell


class Egocentric:
    """Sees and acts through the raw interface as `interface="egocentric"` does, bit for bit.

    Args:
        simulation: of the environment; vehicle and world are read from it.
    """

    def __init__(self, simulation: Simulation) -> None:
        """Pack the constants."""
        self.values = pack_egocentric(simulation.vehicle, simulation.world)

    def observe(
        self, observation: RawObservation, memory: Memory | None = None, starting: ArrayLike | None = None
    ) -> tuple[NDArray[np.float32], Memory]:
        """Return the flat observation and the new memory; call it once a period. Nothing given is changed or shared.

        Args:
            observation: raw Dict observation, single or batched along the first axis.
            memory: what the last call returned; None where all episodes begin.
            starting: () or (n,) True where an episode begins: that memory is dropped.

        Returns:
            (68,) or (n, 68) float32, and the `Memory`.

        Raises:
            ValueError: a missing key or a wrong shape.
        """
        rows, known, single = _load(observation)
        count = len(rows)
        starts, least, clock = np.zeros((count, 3)), np.full(count, np.inf), np.zeros(count)
        if memory is not None:
            for name, own, given in zip(Memory._fields, (starts, least, clock), memory):
                own[:] = _shaped(f"memory.{name}", given, own.shape, single)
        if starting is not None:
            least[_shaped("starting", starting, (count,), single) != 0.0] = np.inf
        out = np.empty((count, OBSERVATION_SIZE), np.float32)
        found = np.count_nonzero(known[:, :, 3] > 0.0, axis=1)
        observe_rows(rows, known, found, starts, least, clock, self.values, 0, count, out)
        if single:
            return out[0], Memory(starts[0], least[0], clock[0])
        return out, Memory(starts, least, clock)

    def reference(self, action: ArrayLike, observation: RawObservation, memory: Memory) -> NDArray[np.float32]:
        """Return the raw action, (4,) or (n, 4) float32 in m, m, m, rad, that a relative action stands for.

        Args:
            action: (3,) or (n, 3) in [-1, 1], clipped to it; read as float32.
            observation: the raw observation it answers.
            memory: what `observe` returned for that observation.

        Raises:
            ValueError: a missing key, a wrong shape, or an action that is not finite.
        """
        rows, _, single = _load(observation)
        wanted = _shaped("action", action, (len(rows), 3), single)
        if not np.isfinite(wanted).all():
            raise ValueError(f"action must be finite, got {action!r}")
        actions = np.ascontiguousarray(wanted, np.float32)
        starts = np.ascontiguousarray(_shaped("memory.start", memory.start, (len(rows), 3), single))
        out = np.empty((len(rows), 4))
        place_references(rows, actions, starts, self.values, 0, len(rows), out)
        return (out[0] if single else out).astype(np.float32)


def _shaped(name: str, given: ArrayLike, shape: tuple[int, ...], single: bool) -> NDArray[np.float64]:
    """Check an array against (n, ...), or (...) for a single one, and return it as (n, ...) float64."""
    array = np.asarray(given, np.float64)
    wanted = shape[1:] if single else shape
    if array.shape != wanted:
        raise ValueError(f"{name} must have shape {wanted}, got {array.shape}")
    return array.reshape(shape)


def _load(observation: RawObservation) -> tuple[np.ndarray, NDArray[np.float64], bool]:
    """Return rows (n,), known spheres (n, M, 4), and whether the observation was a single one."""
    missing = [key for key in ("state", "reference", "goal", "obstacles") if key not in observation]
    if missing:
        raise ValueError(f"observation lacks {', '.join(missing)}; it must be one of interface='world'")
    state = np.asarray(observation["state"], np.float64)
    single = state.ndim == 1
    rows = new_rows(1 if single else len(state))
    for key in ("state", "reference", "goal"):
        rows[key] = _shaped(f"observation[{key!r}]", observation[key], rows[key].shape, single)
    spheres = np.asarray(observation["obstacles"], np.float64)
    known = _shaped(
        "observation['obstacles']", spheres, (len(rows), spheres.shape[-2] if spheres.ndim > 1 else 0, 4), single
    )
    return rows, np.ascontiguousarray(known), single
