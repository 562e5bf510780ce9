"""What there is to draw: what has been flown at every tick, and a mission at a moment of it.

A track keeps what was sent, and is flown again only when it is drawn.
"""

import copy
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.rendering.outdoors import Outdoors, outdoors
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.simulation import STILL, TICK, Simulation, trajectory
from hydrone_gym.surface import in_air
from hydrone_gym.world.bodies import distances
from hydrone_gym.world.scenario import Scenario
from hydrone_gym.world.world import World

# (N, 16) a row a tick: state (12), and reference x, y, z in m and yaw in rad (4); in weather its `Conditions` after
Ticks = NDArray[np.float64]
CONDITIONS_AT = 16  # where they begin
_ENDS = {
    Outcome.GOAL: "goal reached",
    Outcome.COLLISION: "collision",
    Outcome.OUT_OF_BOUNDS: "out of bounds",
    Outcome.ROUGH_TRANSITION: "rough crossing",
    Outcome.TIMEOUT: "time is up",
    Outcome.DIVERGED: "out of control",
}
_SLACK = 1e-3  # m: ticks are samples, sensing is continuous


class Track:
    """The flight of one vehicle from where it was first seen: a row (1,) of dtype `ROW`, and obstacles (M, BODY)."""

    def __init__(
        self, row: np.ndarray, obstacles: NDArray[np.float64], conditions: NDArray[np.float64] = STILL
    ) -> None:
        self.goal: NDArray[np.float64] = row["goal"][0].copy()
        self.obstacles = np.array(obstacles, dtype=np.float64)
        self._parts: list[Ticks] = [np.concatenate((row["state"][0], row["reference"][0], conditions[0]))[None]]
        self._waiting: list[tuple[np.ndarray, NDArray[np.float64], NDArray[np.float64]]] = []

    def add(self, row: np.ndarray, reference: NDArray[np.float64], conditions: NDArray[np.float64] = STILL) -> None:
        """Note a period about to be flown: the row (1,) before it, the reference (4,) sent, conditions; all copied."""
        self._waiting.append((row.copy(), reference.copy(), conditions.copy()))

    def ticks(self, simulation: Simulation) -> Ticks:
        """Return every tick so far, the start included; the same kernel gives the same numbers as the flight itself.

        `simulation` is of the flight's vehicle, world and period, with one lane.
        """
        for row, reference, conditions in self._waiting:
            around: list[NDArray[np.float64]] = []
            _, states, moving, _ = trajectory(simulation, row, reference[None], self.obstacles, conditions, around)
            self._parts.append(np.hstack((states, moving, around))[1:])
        self._waiting = []
        self._parts = [np.concatenate(self._parts)]
        return self._parts[0]

    def copy(self) -> "Track":
        """Return a track that goes on by itself; arrays are shared, as none is ever changed."""
        twin = copy.copy(self)
        twin._parts, twin._waiting = self._parts.copy(), self._waiting.copy()
        return twin


class Moment(NamedTuple):
    """A mission at a moment."""

    ticks: Ticks  # (N, 16) flown so far, the last one now
    goal: NDArray[np.float64]  # (3,) m
    obstacles: NDArray[np.float64]  # (M, BODY)
    detected: NDArray[np.bool_]  # (M,)
    time: float  # s
    outcome: Outcome

    def words(self, zone: float) -> tuple[str, str]:
        """Return the time, and how the mission ended or else where it is; `zone` (m) is half of the transition zone."""
        z = float(self.ticks[-1, 2])
        medium = "crossing" if abs(z) <= zone else "in the air" if in_air(z) else "under water"
        return f"{self.time:.1f} s", _ENDS.get(self.outcome, medium)

    def outdoors(self, world: World) -> Outdoors | None:
        """Return what there is to draw of the weather, None without any."""
        now = self.ticks[-1]
        return outdoors(now[CONDITIONS_AT:], now[:3], self.time, world) if len(now) > CONDITIONS_AT else None


def moments(last: Moment, counts: Iterable[int], sensor_range: float) -> Iterator[Moment]:
    """Yield a mission, given as it is now, when so many of its ticks, the start included, had been flown.

    What has been detected without having come nearer than the sensor range (m) was known from the start.
    """
    since = np.argmax(distances(last.ticks[:, :3], last.obstacles) <= sensor_range + _SLACK, axis=0)
    total = len(last.ticks)
    for count in counts:
        time, detected = last.time - (total - count) * TICK, last.detected & (since < count)
        earlier = Moment(last.ticks[:count], last.goal, last.obstacles, detected, time, Outcome.RUNNING)
        yield last if count == total else earlier


class Flown(Protocol):
    """What pictures need of a flight, such as `hydrone_gym.evaluation.fly` returns."""

    @property
    def scenario(self) -> Scenario:
        """What was flown."""

    @property
    def outcome(self) -> Outcome:
        """How it ended."""

    @property
    def time(self) -> float:
        """When it ended, s."""

    @property
    def detected(self) -> NDArray[np.float64]:
        """Obstacles detected by then, (k, BODY)."""

    @property
    def trace(self) -> Any:
        """Every tick: `times` (N,), `states` (N, 12), `references` (N, 4), `conditions` (N, CONDITIONS) or (N, 0)."""


def moment_of(flight: Flown) -> Moment:
    """Return the end of a flight as a moment to be drawn."""
    trace, obstacles = flight.trace, flight.scenario.obstacles
    ticks = np.hstack((trace.states, trace.references, trace.conditions))
    detected = (obstacles[:, None] == flight.detected).all(axis=2).any(axis=1)
    return Moment(ticks, np.array(flight.scenario.goal), obstacles, detected, flight.time, flight.outcome)


class Tree(Protocol):
    """A planner's tree in one period, such as `planners.TreeView`."""

    @property
    def edges(self) -> NDArray[np.float64]:
        """References at both ends of each edge, (E, 2, 3) in m."""

    @property
    def air(self) -> NDArray[np.bool_]:
        """Whether an edge ends in air, (E,)."""

    @property
    def path(self) -> NDArray[np.intp]:
        """Edges of the path that is followed, in order."""
