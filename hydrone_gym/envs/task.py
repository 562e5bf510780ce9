"""The task around the simulation, for any number of rows: what is known at the start, and how a period is judged."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import inlined, kernel
from hydrone_gym.envs.reward import TERMS, write_reward
from hydrone_gym.simulation.advance import TICK
from hydrone_gym.simulation.model import unpack_model
from hydrone_gym.simulation.outcome import RUNNING, TIMEOUT
from hydrone_gym.simulation.rows import new_rows
from hydrone_gym.simulation.time_to_go import cruise_speeds, time_to_go
from hydrone_gym.world.obstacles import swept_distance
from hydrone_gym.world.sensing import detect

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
    return Episodes(*(array.copy() for array in episodes))


@inlined
def _potential_of(row, speeds):
    """Time-to-go (s) of a row."""
    s, goal = row.state, row.goal
    return time_to_go(s[0], s[1], s[2], goal[0], goal[1], goal[2], speeds)


@inlined
def _begin(n, rows, obstacles, closest, potential, seen, found, known, lane, lanes, count, model, speeds):
    """Begin row n's episode: distances, clearance, time-to-go and first detections at its start."""
    row = rows[n]
    x, y, z = row.state[0], row.state[1], row.state[2]
    row.clearance = np.inf
    for j in range(count):
        k = 4 * j * lanes + lane
        centre = obstacles[k], obstacles[k + lanes], obstacles[k + 2 * lanes]
        distance = swept_distance(x, y, z, x, y, z, centre[0], centre[1], centre[2], obstacles[k + 3 * lanes])
        closest[j * lanes + lane] = distance
        row.clearance = min(row.clearance, distance - model.vehicle.radius)
        seen[n, j] = 0
    for k in range(known.shape[1]):
        for c in range(4):
            known[n, k, c] = 0.0
    found[n] = 0
    potential[n] = _potential_of(row, speeds)


@inlined
def _judge(n, rows, potential, limit, speeds, report):
    """Judge row n after a period: time-out, reward, and what is reported."""
    row = rows[n]
    if row.outcome == RUNNING and row.ticks >= limit:
        row.outcome = TIMEOUT
    s = row.state
    after = _potential_of(row, speeds)
    write_reward(report, n, potential[n], after, s[6], s[7], s[8], row.outcome)
    potential[n] = after
    report[n, _OUTCOME] = row.outcome
    report[n, _OUTCOME + 1] = row.ticks * TICK
    report[n, _OUTCOME + 2] = row.energy
    report[n, _OUTCOME + 3] = row.clearance
    report[n, _OUTCOME + 4] = row.crossings
    row.crossings = 0.0


@kernel
def settle(
    rows, obstacles, closest, potential, seen, found, known, count, lanes, values, limit, first, last, starting, report
):
    """Settle rows [first, last) before their first period or after each: distances, reward, sensing, report.

    Args:
        rows, obstacles, closest, potential, seen, found, known: fields of `Episodes`, updated.
        count: number of obstacles.
        lanes: rows a block.
        values: packed `Model`.
        limit: ticks after which a running episode times out.
        first, last: which rows.
        starting: True before the first period: the rows' states and goals and the obstacles are all that is read.
        report: (n, len(REPORT)) float64, written; the crossings counted are those of this period.
    """
    model = unpack_model(values)
    speeds = cruise_speeds(model)
    reach = model.world.sensor_range
    for n in range(first, last):
        block, lane = n // lanes, n % lanes
        near = closest[block]
        spheres = obstacles[block]
        if starting:
            _begin(n, rows, spheres, near, potential, seen, found, known, lane, lanes, count, model, speeds)
        _judge(n, rows, potential, limit, speeds, report)
        detect(spheres, near, lane, lanes, count, reach, n, seen, found, known)
