"""The task around the simulation, for any number of rows: what is known at the start, and how a period is judged."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import inlined, kernel
from hydrone_gym.control.laws import envelope_of
from hydrone_gym.envs.reward import TERMS, write_reward
from hydrone_gym.perception.perceived import detect
from hydrone_gym.simulation.clock import TICK
from hydrone_gym.simulation.outcome import RUNNING, TIMEOUT
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.simulation.storage import new_rows
from hydrone_gym.simulation.time_to_go import CruiseSpeeds, cruise_speeds, time_to_go
from hydrone_gym.world.bodies import segment_distance

# What is reported of each row, one column each.
REPORT = (*TERMS, "reward", "outcome", "time", "energy", "clearance", "time_to_go", "crossings")
OUTCOME = REPORT.index("outcome")


class Episodes(NamedTuple):
    """Everything that changes while episodes run, a row each; blocks of lanes as in `advance_rows`."""

    rows: np.ndarray  # (n,) dtype ROW
    obstacles: NDArray[np.float64]  # (blocks, 4 * M * lanes) spheres, m; `NOWHERE` beyond those of the scenario
    closest: NDArray[np.float64]  # (blocks, M * lanes) least distance so far to each surface, m
    seen: NDArray[np.uint8]  # (n, M) 1 for a detected obstacle
    found: NDArray[np.int64]  # (n,) number of detected obstacles
    known: NDArray[np.float64]  # (n, M, 4) detected spheres in order of detection, m
    report: NDArray[np.float64]  # (n, len(REPORT)) of the last period; times in s


class Missions(NamedTuple):
    """What episodes begin with."""

    starts: NDArray[np.float64]  # (k, 4) x, y, z in m and yaw in rad, in [-pi, pi]
    goals: NDArray[np.float64]  # (k, 3) m
    spheres: NDArray[np.float64]  # (k, M, 4) x, y, z, r in m


def new_episodes(count: int, obstacles: int, lanes: int) -> Episodes:
    """Return zeroed storage for a number of rows with so many obstacles each."""
    blocks = -(-count // lanes)
    return Episodes(
        new_rows(count),
        np.zeros((blocks, 4 * obstacles * lanes)),
        np.zeros((blocks, obstacles * lanes)),
        np.zeros((count, obstacles), np.uint8),
        np.zeros(count, np.int64),
        np.zeros((count, obstacles, 4)),
        np.zeros((count, len(REPORT))),
    )


_COUNTS = [(name, np.int64) for name in ("first", "last", "lanes")]  # rows [first, last) are settled; rows a block
_LIMITS = [(name, np.float64) for name in ("radius", "sensor_range", "limit")]  # m, m, ticks until a time-out
TASK = np.dtype([*_COUNTS, *_LIMITS, ("speeds", [(name, np.float64) for name in CruiseSpeeds._fields])])


def pack_task(simulation: Simulation, time_limit: float, part: slice) -> np.ndarray:
    """Return the constants of a task with a time limit in s, for a part of the rows: one record (1,), dtype `TASK`."""
    vehicle, ticks = simulation.vehicle, math.ceil(time_limit / TICK - 1e-9)
    limits = vehicle.radius, simulation.world.sensor_range, ticks
    speeds = tuple(cruise_speeds(envelope_of(vehicle, simulation.law)))
    return np.array([(part.start, part.stop, simulation.lanes, *limits, speeds)], TASK)


@inlined
def _place_row(row, missions, k):
    """Put a row at rest and level at start k, its reference where it is, memory and counters empty."""
    for c in range(12):
        row.state[c] = 0.0
    for c in range(4):
        row.integral[c] = 0.0
        row.reference[c] = missions.starts[k, c]
    for c in range(3):
        row.state[c] = missions.starts[k, c]
        row.goal[c] = missions.goals[k, c]
    row.state[5] = missions.starts[k, 3]
    row.ticks, row.energy, row.outcome, row.crossings = 0.0, 0.0, RUNNING, 0.0


@inlined
def _surround(now, n, missions, k, params):
    """Put the spheres of mission k around row n: distances, clearance, and nothing known yet."""
    row, lanes = now.rows[n], params.lanes
    block, lane = n // lanes, n % lanes
    place = (row.state[0], row.state[1], row.state[2])
    row.clearance = np.inf
    for j in range(now.seen.shape[1]):
        sphere = missions.spheres[k, j]
        for c in range(4):
            now.obstacles[block, (4 * j + c) * lanes + lane] = sphere[c]
            now.known[n, j, c] = 0.0
        distance = segment_distance(place, place, (sphere[0], sphere[1], sphere[2], sphere[3]))
        now.closest[block, j * lanes + lane] = distance
        row.clearance = min(row.clearance, distance - params.radius)
        now.seen[n, j] = 0
    now.found[n] = 0


@inlined
def _judge(now, n, params):
    """Judge row n after a period: time-out, reward, and what is reported."""
    row, report = now.rows[n], now.report[n]
    if row.outcome == RUNNING and row.ticks >= params.limit:
        row.outcome = TIMEOUT
    s, goal = row.state, row.goal
    after = time_to_go(s[0], s[1], s[2], goal[0], goal[1], goal[2], params.speeds)
    write_reward(report, report[OUTCOME + 4], after, (s[6], s[7], s[8]), row.outcome)
    report[OUTCOME], report[OUTCOME + 1], report[OUTCOME + 2] = row.outcome, row.ticks * TICK, row.energy
    report[OUTCOME + 3], report[OUTCOME + 4], report[OUTCOME + 5] = row.clearance, after, row.crossings
    row.crossings = 0.0


@kernel
def settle(rows, obstacles, closest, seen, found, known, report, values):
    """Settle a part of the rows after a period: reward, sensing, report; `values` are from `pack_task`.

    `Episodes` is updated; one by one its arrays reach a kernel in half the time that the tuple takes.
    """
    now, params = Episodes(rows, obstacles, closest, seen, found, known, report), values[0]
    for n in range(params.first, params.last):
        _judge(now, n, params)
        detect(now, n, params.lanes, params.sensor_range)


@kernel
def begin_rows(now, missions, order, values):
    """Begin episodes: at rest at their starts, with nothing known but what is in range there, no reward earned yet.

    Mission k of `Missions` is that of row order[k], int64, of the `Episodes`; `values` are from `pack_task`.
    """
    params = values[0]
    for k in range(order.size):
        n = order[k]
        _place_row(now.rows[n], missions, k)
        _surround(now, n, missions, k, params)
        _judge(now, n, params)
        for term in range(OUTCOME):
            now.report[n, term] = 0.0
        detect(now, n, params.lanes, params.sensor_range)
