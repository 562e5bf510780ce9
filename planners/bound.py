"""The privileged bound: the fastest flight that a search finds where the whole world is known.

No policy flies here. A flight is a sequence of references; every candidate is flown by the environment's own kernel, in
closed loop and under its rules, and the fastest so far are varied. They begin as flights of the CL-RRT that knows every
sphere from the start. What is found can be flown, so the optimum is at least as fast; how much faster, nobody has
proved.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import kernel
from hydrone_gym.simulation.clock import TICK
from hydrone_gym.simulation.outcome import GOAL, RUNNING
from hydrone_gym.simulation.rollout import Rollout
from hydrone_gym.simulation.rows import advance_rows
from hydrone_gym.simulation.simulation import STILL, row_at
from hydrone_gym.simulation.storage import LANES
from planners.belief import Belief
from planners.cl_rrt.policy import CLRRT
from planners.policy import Known

EVERYWHERE = 100.0  # m: a range of sensing that leaves nothing unknown
_STARTS = 8  # flights of the CL-RRT, a seed each
_LONGEST = 60.0  # s that one of them may take
_CANDIDATES = 128  # flown a round
_ROUNDS = ((8, 10), (4, 15), (2, 25), (1, 80))  # so many of the fastest flights are varied, for so many rounds
_ROUNDS_MORE = ((1, 50),)  # without the rule of the zone, beginning with the fastest flight that keeps it
_IN_TIME = (0.25, 0.5, 1.0, 1.0, 2.0, -0.5, -1.0)  # periods that the rest of a plan may be shifted by
_SHIFTED = 0.4  # share of the candidates that are
_BUMPED = 0.75  # share of the bumps that are not flat
_SIZES = (-1.7, 0.3)  # powers of ten of a bump, m
_SLOWEST = 0.1  # m/s, where the time of arrival within a tick is guessed


class Place(NamedTuple):
    """What is known of a world: all of it."""

    start: tuple[float, float, float, float]  # x, y, z in m and yaw in rad, at rest
    goal: NDArray[np.float64]  # (3,) m
    obstacles: NDArray[np.float64]  # (M, 4) spheres x, y, z, r in m

    @property
    def row(self) -> np.ndarray:
        """A row (1,) of dtype `ROW` at the start."""
        x, y, z, psi = self.start
        return row_at(np.array([x, y, z, 0.0, 0.0, psi, *[0.0] * 6]), self.goal)


class Found(NamedTuple):
    """A flight that arrives."""

    references: NDArray[np.float64]  # (K, 4) one a period: m, m, m, rad
    time: float  # s
    energy: float  # of the rotors' shafts, J


def fastest_flights(
    belief: Belief, place: Place, *, grid: float, effort: int = 1, seed: int = 0
) -> tuple[Found | None, Found | None]:
    """Search for the fastest flight that keeps the rule of the zone, and for the fastest of all.

    The rule: inside the transition zone the lateral speed never exceeds that of a smooth crossing, 0.2 m/s, which
    leaves room for no more than stopping. The CL-RRT keeps it; the environment only ends flights that cross so fast.

    Args:
        belief: vehicle, world, period and law, all of them true; still air and flat water.
        place: the world.
        grid: references are multiples of 1 / `grid` m and rad; a power of two keeps them exact in single precision.
        effort: how often every round of the search is gone through; 1 flies 23,000 flights.
        seed: of the random stream and of the planner's first flight.

    Returns None where nothing arrives, which does not mean that nothing could.

    Raises ValueError for a vehicle that is not flown by the nominal equations.
    """
    if not belief.vehicle.ideal:
        raise ValueError(f"the search flies the nominal equations, vehicle {belief.vehicle.name!r} has lag or height")
    random = np.random.default_rng(seed)
    starts = [_planned(belief, place, seed + k) for k in range(_STARTS)]
    first, more = ([(best, effort * rounds) for best, rounds in stages] for stages in (_ROUNDS, _ROUNDS_MORE))
    kept = _improved(_Trial(belief, place, grid, belief.world.rough_speed), starts, first, random)
    free = _Trial(belief, place, grid, math.inf)
    return kept, _improved(free, starts if kept is None else [kept.references], more, random)


def _planned(belief: Belief, place: Place, seed: int) -> NDArray[np.float64]:
    """Return the references (K, 4) of a flight of the CL-RRT that knows every sphere."""
    planner = CLRRT(replace(belief, world=replace(belief.world, sensor_range=EVERYWHERE)), seed=seed)
    rollout, row, memory, sent = Rollout(planner.simulation, place.obstacles), place.row, None, list[Any]()
    for _ in range(int(_LONGEST / belief.period)):
        state, integral, held = (row[name][0].copy() for name in ("state", "integral", "reference"))
        reference, memory = planner.act(Known(state, integral, held, place.goal, place.obstacles), memory)
        sent.append(reference.astype(np.float32).astype(np.float64))
        if rollout.fly(row, sent[-1]).outcome != RUNNING:
            break
    return np.array(sent)


class _Trial:
    """Flies plans in one world, `LANES` at a time; `zone_speed` is the greatest lateral speed in the zone, m/s."""

    def __init__(self, belief: Belief, place: Place, grid: float, zone_speed: float) -> None:
        self.belief, self._place, self._grid, self._zone_speed = belief, place, grid, zone_speed
        self._engine = belief.simulation(LANES).engine
        self._obstacles = np.repeat(place.obstacles.reshape(-1), LANES)[None]
        world = belief.world
        self._low, self._high = np.array([*world.lower, -math.pi]), np.array([*world.upper, math.pi])

    def on_grid(self, plans: NDArray[np.float64]) -> NDArray[np.float64]:
        """Round plans to the grid, inside the box of references."""
        n = self._grid
        return np.clip(np.round(n * plans), np.ceil(n * self._low), np.floor(n * self._high)) / n

    def fly(self, plans: NDArray[np.float64]) -> tuple[NDArray[np.float64], np.ndarray]:
        """Fly plans (n, K, 4); return their times in s (n,), finer than a tick, and the rows (n,) they end as.

        The time is infinite for what does not arrive in K periods, or is too fast sideways in the zone.
        """
        rows, world = np.repeat(self._place.row, len(plans)), self.belief.world
        zone, closest = np.zeros(len(plans)), np.full((1, self._obstacles.size // 4), np.inf)
        by_period = np.ascontiguousarray(plans.transpose(1, 0, 2))
        _fly(self._engine, rows, by_period, self._obstacles, closest, STILL, world.zone, zone)
        state = rows["state"]
        inside = world.goal_radius - np.linalg.norm(self._place.goal - state[:, :3], axis=1)
        speed = np.maximum(np.linalg.norm(state[:, 6:9], axis=1), _SLOWEST)
        times = rows["ticks"] * TICK - np.clip(inside / speed, 0.0, TICK)
        return np.where((rows["outcome"] == GOAL) & (zone <= self._zone_speed), times, np.inf), rows


@kernel
def _fly(engine, rows, plans, obstacles, closest, still, zone, lateral):
    """Fly rows (n,) along plans (K, n, 4); `lateral` (n,) gets the greatest lateral speed within the zone, m/s.

    The obstacles (1, 4 M lanes) are the same for all; `zone` is the zone's half-height in m.
    """
    lanes, count = engine.lanes, closest.shape[1] // engine.lanes
    for first in range(0, rows.size, lanes):
        block = rows[first : first + lanes]
        for k in range(plans.shape[0]):
            references, running = plans[k, first : first + lanes], False
            for tick in range(engine.ticks):
                advance_rows(engine, block, references, obstacles, closest, still, count, tick, tick + 1)
                for i in range(block.size):
                    s = block[i].state
                    if abs(s[2]) <= zone:
                        lateral[first + i] = max(lateral[first + i], np.sqrt(s[6] * s[6] + s[7] * s[7]))
                    running = running or block[i].outcome == RUNNING
            if not running:
                break


def _improved(
    trial: _Trial, starts: Sequence[NDArray[np.float64]], stages: Sequence[tuple[int, int]], random: np.random.Generator
) -> Found | None:
    """Vary the fastest of some plans (K, 4) in stages, and replace each by its fastest variant where that is faster."""
    length = max(map(len, starts))
    plans = trial.on_grid(np.stack([np.concatenate([s, np.repeat(s[-1:], length - len(s), 0)]) for s in starts]))
    times = trial.fly(plans)[0]
    for kept, rounds in stages:
        best = np.argsort(times, kind="stable")[:kept]
        plans, times = plans[best], times[best]
        for _ in range(rounds):
            if np.isfinite(times).all():  # a period to spare
                plans = plans[:, : math.ceil(times.max() / trial.belief.period) + 1]
            tried = trial.on_grid(_varied(np.repeat(plans, _CANDIDATES // len(plans), axis=0), random))
            found = trial.fly(tried)[0].reshape(len(plans), -1)
            for k, choice in enumerate(found.argmin(axis=1)):
                if found[k, choice] < times[k]:
                    plans[k], times[k] = tried[k * found.shape[1] + choice], found[k, choice]
    fastest = plans[times.argmin()]
    if not np.isfinite(times).any():
        return None
    row = trial.fly(fastest[None])[1][0]
    time = float(row["ticks"] * TICK)
    return Found(fastest[: math.ceil(time / trial.belief.period - 1e-9)], time, float(row["energy"]))


def _varied(plans: NDArray[np.float64], random: np.random.Generator) -> NDArray[np.float64]:
    """Return plans (n, K, 4) whose rest is shifted in time, and two of whose stretches are in space, at random."""
    n, length, _ = plans.shape
    index, row = np.arange(length), np.arange(n)[:, None]
    shift = random.choice(_IN_TIME, (n, 1)) * (random.random((n, 1)) < _SHIFTED)
    first, ramp = random.integers(0, length, (n, 1)), random.integers(1, 9, (n, 1))
    at = np.clip(index + shift * np.clip((index - first) / ramp, 0.0, 1.0), 0.0, length - 1.0)
    before = at.astype(np.int64)
    share = (at - before)[..., None]
    plans = (1.0 - share) * plans[row, before] + share * plans[row, np.minimum(before + 1, length - 1)]
    for _ in range(2):
        rise, fall = random.integers(1, 7, (n, 1)), random.integers(1, 7, (n, 1))
        top, width = random.integers(0, length, (n, 1)), random.integers(0, 13, (n, 1))
        bump = np.clip(np.minimum((index - top + rise) / rise, (top + width + fall - index) / fall), 0.0, 1.0)
        size = 10.0 ** random.uniform(*_SIZES, (n, 1)) * (random.random((n, 1)) < _BUMPED)
        move = size * random.standard_normal((n, 4)) * (random.random((n, 4)) < 0.5) * [1.0, 1.0, 1.0, 0.5]
        plans = plans + bump[..., None] * move[:, None]
    return plans
