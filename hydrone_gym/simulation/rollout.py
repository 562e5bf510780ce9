"""Rollouts: vehicles flown from a state with references against known obstacles, one at a time or many.

A rollout owns the lane, the obstacles as they lie in memory and the distances; whoever predicts, plans or checks holds
vehicles and references and sees nothing of that. `Rollout` flies one vehicle, from Python with `fly` and from kernels
with `propagate`; `fly_many` is its sister for many at once.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import inlined, kernel, routine
from hydrone_gym._memory import call, gather, pointer, scatter, view
from hydrone_gym.physics.immersion import Fluid
from hydrone_gym.physics.kinematics import State
from hydrone_gym.simulation.clock import TICK
from hydrone_gym.simulation.conditions import AT as CONDITIONS_AT
from hydrone_gym.simulation.conditions import Noticed
from hydrone_gym.simulation.outcome import RUNNING
from hydrone_gym.simulation.rows import Engine, advance_rows, set_move
from hydrone_gym.simulation.simulation import STILL, Simulation
from hydrone_gym.simulation.storage import (
    AT,
    CROSSINGS,
    ENERGY,
    GOAL,
    LANES,
    LOG,
    LOG_ENTRY,
    LOGGED_CROSSINGS,
    REFERENCE,
    VESSEL,
    CrossingEntry,
    Episode,
    Point,
    Pose,
    new_block,
)
from hydrone_gym.surface import is_air


class Result(NamedTuple):
    """How one period went; the end of the flight is where the rollout was told to write it."""

    outcome: float  # an `Outcome`
    clearance: float  # least to a known obstacle, m
    crossings: float  # of the surface
    lateral_speed: float  # greatest at a crossing, m/s; 0 without one
    cos_tilt: float  # least at a crossing; 1 without one
    seconds: float  # flown
    energy: float  # of the rotors' shafts, J


class Lane(NamedTuple):
    """A rollout as kernels hold it, all of it pointers and numbers; see `lane_of`."""

    address: int
    ticks: int
    values: Any  # packed `Model`
    block: Any
    obstacles: Any  # flat: x, y, z, r in m
    closest: Any
    number: int  # of obstacles
    weather: Any  # `Conditions`
    weathered: int  # how many numbers they are; 0 without weather


def _check_lanes(simulation: Simulation, lanes: int) -> None:
    if simulation.lanes != lanes:
        raise ValueError(f"the simulation must have {lanes} lanes, got {simulation.lanes}")


class Rollout:
    """One vehicle, flown a period at a time.

    Args:
        simulation: of one lane: vehicle, world, law and period.
        obstacles: (M, 4) spheres x, y, z, r in m, those that are known.
        conditions: (CONDITIONS,) of a simulation with weather, as from `steady_conditions`; at the beginning of every
            period the medium is noticed.
    """

    def __init__(
        self,
        simulation: Simulation,
        obstacles: NDArray[np.float64],
        conditions: NDArray[np.float64] = STILL[0],
    ) -> None:
        """Lay out the obstacles; ValueError for many lanes, and for weather without conditions or the reverse."""
        _check_lanes(simulation, 1)
        if simulation.weathered != (conditions.size > 0):
            raise ValueError(f"a simulation with weathered={simulation.weathered} got {conditions.size} conditions")
        self._conditions = np.array(conditions, np.float64)
        self._engine = simulation.engine._replace(block=new_block(1))
        self._obstacles = np.array(obstacles, np.float64).reshape(-1)
        self._closest = np.zeros(len(obstacles))

    def __reduce__(self) -> Any:
        """Refuse to be sent elsewhere: what it holds, the address of a kernel, is of this process."""
        raise TypeError("a Rollout cannot be pickled: send the simulation and make it anew")

    @property
    def memory(self) -> tuple[Engine, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """What kernels take; `lane_of` makes a `Lane` of it."""
        return self._engine, self._obstacles, self._closest, self._conditions

    def fly(self, row: np.ndarray, reference: NDArray[np.float64]) -> Result:
        """Fly a row (1,) of dtype `ROW` for one period toward a reference (4,), in place; m, m, m, rad.

        State, memory, reference and energy move on; what else its episode collects stays as it is.
        """
        return Result(*_fly(self.memory, row, np.asarray(reference, np.float64)))


@inlined
def lane_of(memory):
    """Make a `Lane` of a rollout's memory."""
    engine, obstacles, closest, conditions = memory
    return Lane(
        engine.address,
        engine.ticks,
        pointer(engine.values),
        pointer(engine.block),
        pointer(obstacles),
        pointer(closest),
        closest.size,
        pointer(conditions),
        conditions.size,
    )


@inlined
def of_row(lane, number, weather):
    """The same rollout with the first so many of its obstacles, in other weather: a pointer to `Conditions`."""
    at, ticks, values, block = lane.address, lane.ticks, lane.values, lane.block
    return Lane(at, ticks, values, block, lane.obstacles, lane.closest, number, weather, lane.weathered)


@inlined
def _take_off(lane, start, goal, reference):
    """Load a vehicle and where it is to go."""
    b = lane.block
    for k in range(VESSEL):
        b[k] = start[k]
    b[ENERGY] = 0.0
    scatter(b, GOAL, 0, 1, gather(goal, 0, 0, 1, Point))
    scatter(b, AT.episode, 0, 1, Episode(0.0, np.inf, np.float64(RUNNING), 0.0))
    set_move(b, 0, 1, Pose(reference[0], reference[1], reference[2], reference[3]))
    if lane.weathered > 0:
        air = 1.0 if is_air(gather(start, 0, 0, 1, Point).z) else 0.0
        scatter(lane.weather, CONDITIONS_AT.noticed, 0, 1, Noticed(air, air, 0.0, 0.0))


@inlined
def _advance(lane, first, last):
    """Fly the vehicle that took off through ticks [first, last) of a period."""
    around = (lane.obstacles, lane.closest, lane.weather, lane.values, lane.number)
    call(lane.address, lane.block, *around, first, last, lane.ticks)


@inlined
def _land(lane, end, reference):
    """Write where the vehicle ends; return the `Result`."""
    b = lane.block
    for k in range(REFERENCE):
        end[k] = b[k]
    scatter(end, REFERENCE, 0, 1, Pose(reference[0], reference[1], reference[2], reference[3]))
    episode, speed, cosine = gather(b, AT.episode, 0, 1, Episode), 0.0, 1.0
    for slot in range(int(min(b[CROSSINGS], LOGGED_CROSSINGS))):
        entry = gather(b, LOG + slot * LOG_ENTRY, 0, 1, CrossingEntry)
        speed, cosine = max(speed, entry.lateral_speed), min(cosine, entry.cos_tilt)
    return Result(episode.outcome, episode.clearance, episode.crossings, speed, cosine, episode.ticks * TICK, b[ENERGY])


@routine
def propagate(lane, start, end, goal, reference):
    """Fly a vehicle for one period toward a reference and write where it ends; returns a `Result`.

    Args:
        lane: `Lane`.
        start: pointer to a vessel: its `Flown`, then its reference in force; the energy counts from zero.
        end: pointer to a vessel, written; may be `start`.
        goal: pointer to the goal, m.
        reference: (x, y, z, psi), m and rad.
    """
    _take_off(lane, start, goal, reference)
    _advance(lane, 0, lane.ticks)
    return _land(lane, end, reference)


@routine
def propagate_watched(lane, start, end, goal, reference, zone):
    """Do what `propagate` does, bit for bit, and look at every tick.

    Returns the `Result`, and the lateral velocity through the water (x, y in m/s) where it was greatest within `zone` m
    of the surface.
    """
    _take_off(lane, start, goal, reference)
    vx, vy = 0.0, 0.0
    for tick in range(lane.ticks):
        _advance(lane, tick, tick + 1)
        s = view(lane.block, 0, State)
        sx, sy = s.vx, s.vy
        if lane.weathered > 0:
            fluid = gather(lane.weather, CONDITIONS_AT.fluid, 0, 1, Fluid)
            sx, sy = sx - fluid.water_x, sy - fluid.water_y
        if abs(s.z) <= zone and sx * sx + sy * sy > vx * vx + vy * vy:
            vx, vy = sx, sy
    return _land(lane, end, reference), (vx, vy)


@kernel
def _fly(memory, row, reference):
    vessel, spent = pointer(row[0]), row[0].energy
    wanted = (reference[0], reference[1], reference[2], reference[3])
    flown = propagate(lane_of(memory), vessel, vessel, pointer(row[0].goal), wanted)
    row[0].energy = spent + flown.energy
    return flown


class Flock:
    """Many copies of one vehicle, flown side by side against the same known obstacles.

    Args:
        simulation: of `LANES` lanes.
        row: (1,) dtype `ROW`, what each of them begins with.
        count: how many.
        obstacles: (M, 4) spheres x, y, z, r in m.
    """

    def __init__(self, simulation: Simulation, row: np.ndarray, count: int, obstacles: NDArray[np.float64]) -> None:
        """Lay out rows and obstacles; ValueError for a simulation of another number of lanes."""
        _check_lanes(simulation, LANES)
        obstacles = np.array(obstacles, np.float64)
        self.rows = np.repeat(row, count)
        self._engine, self._count = simulation.engine._replace(block=new_block(LANES)), len(obstacles)
        blocks = -(-count // LANES)
        self._obstacles = np.tile(np.repeat(obstacles.reshape(-1), LANES), (blocks, 1))
        self._closest = np.full((blocks, self._count * LANES), np.inf)

    def fly(self, references: NDArray[np.float64]) -> None:
        """Fly all of them for one period, each toward its reference of (count, 4); m and rad."""
        references = np.ascontiguousarray(references, np.float64)
        ticks = self._engine.ticks
        around = (self._obstacles, self._closest, STILL)
        advance_rows(self._engine, self.rows, references, *around, self._count, 0, ticks)


__all__ = ["Flock", "Lane", "Result", "Rollout", "lane_of", "propagate", "propagate_watched"]
