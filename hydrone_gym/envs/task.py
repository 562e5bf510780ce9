"""The task around the simulation, for any number of rows: what is known at the start, and how a period is judged."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import inlined, kernel
from hydrone_gym.control.laws import envelope_of
from hydrone_gym.envs.reward import TERMS, write_reward
from hydrone_gym.simulation.advance import TICK
from hydrone_gym.simulation.outcome import RUNNING, TIMEOUT
from hydrone_gym.simulation.storage import new_rows
from hydrone_gym.simulation.time_to_go import CruiseSpeeds, cruise_speeds, time_to_go
from hydrone_gym.vehicle import Vehicle
from hydrone_gym.world.bodies import segment_distance
from hydrone_gym.world.sensing import detect
from hydrone_gym.world.world import World

# What `judge` reports of each row, one column each.
REPORT = (*TERMS, "reward", "outcome", "time", "energy", "clearance", "crossings")
_OUTCOME = REPORT.index("outcome")


class Episodes(NamedTuple):
    """Everything that changes while episodes run, a row each; blocks of lanes as in `advance_rows`."""

    rows: np.ndarray  # (n,) dtype ROW
    obstacles: NDArray[np.float64]  # (blocks, 4 * M * lanes) spheres, m
    closest: NDArray[np.float64]  # (blocks, M * lanes) least distance so far to each surface, m
    potential: NDArray[np.float64]  # (n,) time-to-go at the end of the last period, s
    seen: NDArray[np.uint8]  # (n, M) 1 for a detected obstacle
    found: NDArray[np.int64]  # (n,) number of detected obstacles
    known: NDArray[np.float64]  # (n, M, 4) detected spheres in order of detection, m


def new_episodes(count: int, obstacles: int, lanes: int) -> Episodes:
    """Return zeroed storage for a number of rows with so many obstacles each."""
    blocks = -(-count // lanes)
    return Episodes(
        new_rows(count),
        np.zeros((blocks, 4 * obstacles * lanes)),
        np.zeros((blocks, obstacles * lanes)),
        np.zeros(count),
        np.zeros((count, obstacles), np.uint8),
        np.zeros(count, np.int64),
        np.zeros((count, obstacles, 4)),
    )


def copy_episodes(episodes: Episodes) -> Episodes:
    """Return a copy that shares no memory."""
    return Episodes._make(array.copy() for array in episodes)


class TaskParams(NamedTuple):
    """The constants of a task; far fewer than a `Model`, which would add a second to the first compilation."""

    radius: float  # m
    sensor_range: float  # m
    limit: float  # ticks after which a running episode times out
    speeds: CruiseSpeeds


def pack_task(vehicle: Vehicle, world: World, time_limit: float) -> NDArray[np.float64]:
    """Flatten the constants of a task with a time limit in s to one array, which reaches a kernel fastest."""
    speeds = cruise_speeds(envelope_of(vehicle))
    return np.array([vehicle.radius, world.sensor_range, math.ceil(time_limit / TICK - 1e-9), *speeds])


@inlined
def _unpack_task(values):
    """Rebuild the `TaskParams` of a packed array inside a kernel."""
    speeds = CruiseSpeeds(values[3], values[4], values[5], values[6], values[7])
    return TaskParams(values[0], values[1], values[2], speeds)


@inlined
def _potential_of(row, speeds):
    """Time-to-go (s) of a row."""
    s, goal = row.state, row.goal
    return time_to_go(s[0], s[1], s[2], goal[0], goal[1], goal[2], speeds)


@inlined
def _begin(n, rows, obstacles, closest, potential, seen, found, known, lane, lanes, count, params):
    """Begin row n's episode: distances, clearance, time-to-go and first detections at its start."""
    row = rows[n]
    x, y, z = row.state[0], row.state[1], row.state[2]
    row.clearance = np.inf
    for j in range(count):
        k = 4 * j * lanes + lane
        body = (obstacles[k], obstacles[k + lanes], obstacles[k + 2 * lanes], obstacles[k + 3 * lanes])
        distance = segment_distance((x, y, z), (x, y, z), body)
        closest[j * lanes + lane] = distance
        row.clearance = min(row.clearance, distance - params.radius)
        seen[n, j] = 0
    for k in range(known.shape[1]):
        for c in range(4):
            known[n, k, c] = 0.0
    found[n] = 0
    potential[n] = _potential_of(row, params.speeds)


@inlined
def _place_row(row, starts, goals, k):
    """Put a row at rest and level at start k, its reference where it is, memory and counters empty."""
    for c in range(12):
        row.state[c] = 0.0
    for c in range(4):
        row.integral[c] = 0.0
        row.reference[c] = starts[k, c]
    for c in range(3):
        row.state[c] = starts[k, c]
        row.goal[c] = goals[k, c]
    row.state[5] = starts[k, 3]
    row.ticks, row.energy, row.outcome, row.crossings = 0.0, 0.0, RUNNING, 0.0


@inlined
def _judge(n, rows, potential, params, report):
    """Judge row n after a period: time-out, reward, and what is reported."""
    row = rows[n]
    if row.outcome == RUNNING and row.ticks >= params.limit:
        row.outcome = TIMEOUT
    s = row.state
    after = _potential_of(row, params.speeds)
    write_reward(report, n, potential[n], after, s[6], s[7], s[8], row.outcome)
    potential[n] = after
    report[n, _OUTCOME] = row.outcome
    report[n, _OUTCOME + 1] = row.ticks * TICK
    report[n, _OUTCOME + 2] = row.energy
    report[n, _OUTCOME + 3] = row.clearance
    report[n, _OUTCOME + 4] = row.crossings
    row.crossings = 0.0


@kernel
def settle(rows, obstacles, closest, potential, seen, found, known, count, lanes, values, order, report):
    """Settle rows after a period: reward, sensing, report.

    Args:
        rows, obstacles, closest, potential, seen, found, known: fields of `Episodes`, updated.
        count: number of obstacles.
        lanes: rows a block.
        values: from `pack_task`.
        order: (k,) which rows.
        report: (n, len(REPORT)) float64, written; the crossings counted are those of this period.
    """
    params = _unpack_task(values)
    for k in range(order.size):
        n = order[k]
        block, lane = n // lanes, n % lanes
        _judge(n, rows, potential, params, report)
        detect(obstacles[block], closest[block], lane, lanes, count, params.sensor_range, n, seen, found, known)


@kernel
def begin_rows(
    rows,
    obstacles,
    closest,
    potential,
    seen,
    found,
    known,
    count,
    lanes,
    values,
    order,
    starts,
    goals,
    spheres,
    report,
):
    """Begin episodes: at rest at their starts, with nothing known but what is in range there.

    Args:
        rows, obstacles, closest, potential, seen, found, known: fields of `Episodes`, written.
        count: number of obstacles.
        lanes: rows a block.
        values: from `pack_task`.
        order: (k,) which rows.
        starts: (k, 4) x, y, z in m and yaw in rad, in [-pi, pi].
        goals: (k, 3) m.
        spheres: (k, count, 4) x, y, z, r in m.
        report: (n, len(REPORT)) float64, written; no reward has been earned yet.
    """
    params = _unpack_task(values)
    for k in range(order.size):
        n = order[k]
        block, lane = n // lanes, n % lanes
        _place_row(rows[n], starts, goals, k)
        for j in range(count):
            for c in range(4):
                obstacles[block, (4 * j + c) * lanes + lane] = spheres[k, j, c]
        near, centres = closest[block], obstacles[block]
        _begin(n, rows, centres, near, potential, seen, found, known, lane, lanes, count, params)
        _judge(n, rows, potential, params, report)
        for term in range(_OUTCOME):
            report[n, term] = 0.0
        detect(centres, near, lane, lanes, count, params.sensor_range, n, seen, found, known)
