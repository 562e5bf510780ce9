"""Flights straight through the surface, sixteen side by side, watched at every physics step.

The kernel is the environment's: its steps and ticks, with a look at every lane in between, since rows only show ticks.
"""

import functools
import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from hydrone_gym._jit import inlined, kernel, unit
from hydrone_gym._memory import call, gather, offsets_of, packed, pointer, scatter, select, size_of
from hydrone_gym.control.laws import named_law
from hydrone_gym.physics.kinematics import State, attitude_of
from hydrone_gym.simulation.advance import begin_ticks, end_tick, substep
from hydrone_gym.simulation.clock import DT, SUBSTEPS, TICK
from hydrone_gym.simulation.conditions import CONDITIONS, begin_conditions, climate_of
from hydrone_gym.simulation.outcome import RUNNING
from hydrone_gym.simulation.rows import set_move
from hydrone_gym.simulation.simulation import ticks_in
from hydrone_gym.simulation.storage import (
    AT,
    FLOWN_AT,
    LANE_AT,
    LANES,
    OUTCOME,
    TICKS,
    Crossing,
    Pose,
    Row,
    model_of,
    new_block,
    new_rows,
    pack_model,
)
from hydrone_gym.vehicle import Vehicle
from hydrone_gym.weather import Weather
from hydrone_gym.world.world import World

PERIOD = 0.5  # s
DEPTH = 5.0  # m
FAR = 500.0  # m: how far wind may carry a vehicle before its flight ends
WORLD = World(lower=(-FAR, -FAR, -DEPTH), upper=(FAR, FAR, 10.0), rough_transition="count")


class Passage(NamedTuple):
    """What was seen of a flight; peaks are those inside the transition zone until the vehicle is through it."""

    vx: float  # m/s, one physics step ago
    vy: float
    vz: float
    side: float  # where it began: 1 in air, -1 in water
    began: float  # s, when it was first inside the zone
    left: float  # s, when it was first beyond the zone on the other side; infinite before
    within: float  # s, when it last was not beyond
    acceleration2: float  # greatest |dv/dt|^2 over a physics step, m^2/s^4
    cos_tilt: float  # least


class Touched(NamedTuple):
    """What was seen of its crossings: number, and the worst of them until the vehicle is through the zone."""

    crossings: float
    speed2: float  # lateral, relative to the water, m^2/s^2
    cos_tilt: float
    vertical: float  # speed of the first one, relative to the water, m/s


class Watched(NamedTuple):
    """Both."""

    passage: Passage
    surface: Touched


SEEN = offsets_of(Watched)


@inlined
def watch(b, i, lanes, seen, time, zone):
    """Look at lane i after a physics step that ends at a time (s)."""
    s, p = gather(b, FLOWN_AT.state, i, lanes, State), gather(seen, SEEN.passage, i, lanes, Passage)
    attitude = attitude_of(s)
    ax, ay, az = (s.vx - p.vx) / DT, (s.vy - p.vy) / DT, (s.vz - p.vz) / DT
    a2, cosine = ax * ax + ay * ay + az * az, attitude.c_phi * attitude.c_theta
    beyond, inside = s.z * p.side < -zone, abs(s.z) <= zone and p.left == np.inf
    noted = Passage(
        s.vx,
        s.vy,
        s.vz,
        p.side,
        time if inside and time < p.began else p.began,
        time if beyond and time < p.left else p.left,
        p.within if beyond else time,
        a2 if inside and a2 > p.acceleration2 else p.acceleration2,
        cosine if inside and cosine < p.cos_tilt else p.cos_tilt,
    )
    scatter(seen, SEEN.passage, i, lanes, select(gather(b, OUTCOME, i, lanes, float) == RUNNING, noted, p))


@inlined
def watch_surface(b, i, lanes, seen):
    """Look at the crossings of lane i's tick before it is judged."""
    c, s = gather(b, LANE_AT.crossing, i, lanes, Crossing), gather(seen, SEEN.surface, i, lanes, Touched)
    crossed = c.number > 0.0 and gather(b, OUTCOME, i, lanes, float) == RUNNING
    counts = crossed and gather(seen, SEEN.passage, i, lanes, Passage).left == np.inf
    noted = Touched(
        s.crossings + (c.number if crossed else 0.0),
        c.speed2 if counts and c.speed2 > s.speed2 else s.speed2,
        c.cos_tilt if counts and c.cos_tilt < s.cos_tilt else s.cos_tilt,
        abs(c.vz) if crossed and s.crossings == 0.0 else s.vertical,
    )
    scatter(seen, SEEN.surface, i, lanes, noted)


@functools.cache
def compiled(law: str) -> Any:
    """Return a period of a law in weather, watched; `advance` of the simulation without obstacles."""
    gains, lanes = named_law(law).gains, LANES

    def period(b, weather, seen, values, ticks):
        model = model_of(values, gains)
        inverses = (1.0 / (ticks * SUBSTEPS), 1.0 / (ticks * TICK))
        width = lanes if ticks > 0 else 0
        for tick in range(ticks):
            begin_ticks(b, lanes, width, weather, None)
            for sub in range(SUBSTEPS):
                part = (tick * SUBSTEPS + sub + 1, sub + 1)
                for i in range(lanes):
                    substep(b, i, lanes, part, inverses, model, weather)
                for i in range(lanes):
                    now = gather(b, TICKS, i, lanes, float) * TICK + (sub + 1) * DT
                    watch(b, i, lanes, seen, now, model.world.zone)
            for i in range(width):
                watch_surface(b, i, lanes, seen)
            for i in range(lanes):
                end_tick(b, i, lanes, model.world)

    numbers = types.CPointer(types.float64)
    signature = types.void(numbers, numbers, numbers, numbers, types.int64)
    return unit(signature, period, __name__, gains.__module__)


@kernel
def fly_blocks(address, rows, path, times, block, weather, values, seen):
    """Fly rows until all of a block are through or have ended, or time is up.

    Args:
        address: of `compiled`.
        rows: (n,) dtype `ROW`, n a multiple of the lanes; updated.
        path: (2, n, 4) the references that vehicles hold first, and those that they then go to within a period.
        times: (4,) int64: periods that they hold, periods in all, 1 to stop once all are through, ticks a period.
        block: from `new_block`.
        weather: (n / lanes, CONDITIONS * lanes), updated.
        values: from `pack_model`.
        seen: (n / lanes, numbers of `Watched` * lanes), updated.
    """
    b = pointer(block)
    for k in range(len(weather)):
        for i in range(LANES):
            scatter(b, 0, i, LANES, gather(pointer(rows[k * LANES + i]), 0, 0, 1, Row))
        for period in range(times[1]):
            wanted = path[1 if period >= times[0] else 0]
            for i in range(LANES):
                set_move(b, i, LANES, gather(wanted[k * LANES + i], 0, 0, 1, Pose))
            call(address, block, weather[k], seen[k], values, times[3])
            busy = 0
            for i in range(LANES):
                scatter(b, AT.reference, i, LANES, gather(wanted[k * LANES + i], 0, 0, 1, Pose))
                through = times[2] > 0 and gather(seen[k], SEEN.passage, i, LANES, Passage).left < np.inf
                busy += 1 if gather(b, OUTCOME, i, LANES, float) == RUNNING and not through else 0
            if busy == 0:
                break
        for i in range(LANES):
            scatter(pointer(rows[k * LANES + i]), 0, 0, 1, gather(b, 0, i, LANES, Row))


class Flights(NamedTuple):
    """What came of flights, an entry each (n,); times in s count from when the reference moves."""

    outcome: NDArray[np.float64]
    began: NDArray[np.float64]  # inside the zone first; infinite if never
    through: NDArray[np.float64]  # beyond it on the other side first; infinite if never
    within: NDArray[np.float64]  # last not beyond it
    acceleration: NDArray[np.float64]  # greatest in the zone until through, m/s^2
    tilt: NDArray[np.float64]  # the same, rad
    crossings: NDArray[np.float64]
    lateral: NDArray[np.float64]  # greatest at the surface until through, relative to the water, m/s
    surface_tilt: NDArray[np.float64]  # the same, rad
    vertical: NDArray[np.float64]  # at the first crossing, m/s
    states: NDArray[np.float64]  # (n, 12) at the end


@dataclass(frozen=True, kw_only=True)
class Column:
    """What vehicles fly: from about `start` to `end` (m above the mean surface), straight up or down.

    Starts lie anywhere within `spread` of (0, 0) and of `start`, at rest; a seed draws the same ones in every weather.
    The reference stays at (0, 0) in their height for `hold` seconds, then moves within half a second to `end`.
    """

    start: float
    end: float
    limit: float  # s after the jump until the flight ends
    hold: float = 0.0  # s
    spread: tuple[float, float] = (0.2, 0.5)  # m, sideways and in height
    flights: int = 1024  # rounded up to whole sixteens
    stop: bool = True  # as soon as all sixteen side by side are through
    seed: int = 0


def ready(vehicle: Vehicle, column: Column, weather: Weather) -> tuple[np.ndarray, ...]:
    """Return rows (n,) at their starts, the (2, n, 4) references that they fly to, and their conditions."""
    rng, n = np.random.default_rng(column.seed), LANES * max(1, -(-column.flights // LANES))
    rows, path, order = new_rows(n), np.zeros((2, n, 4)), np.arange(n)
    sideways, upwards = column.spread
    offsets = rng.uniform(-1.0, 1.0, (n, 3)) * (sideways, sideways, upwards)
    rows["state"][:, :3] = offsets + (0.0, 0.0, column.start)
    rows["reference"][:, 2] = rows["state"][:, 2]
    rows["goal"], rows["clearance"] = np.inf, np.inf
    path[0], path[1, :, 2] = rows["reference"], column.end
    streams = rng.integers(0, 2**32, (n, 3)).astype(np.float64)
    climate = climate_of(vehicle, weather, weather.spread, DEPTH)[None]
    conditions = np.zeros((n // LANES, CONDITIONS * LANES))
    begin_conditions(conditions, LANES, rows, order, streams, climate, np.zeros(n, np.int64))
    return rows, path, conditions


def fly_column(vehicle: Vehicle, column: Column, weather: Weather | None = None, law: str = "paper") -> Flights:
    """Fly a vehicle as it is, under a law that believes the nominal one, through a column."""
    rows, path, conditions = ready(vehicle, column, weather or Weather())
    passage = Passage(0.0, 0.0, 0.0, math.copysign(1.0, column.start), np.inf, np.inf, 0.0, 0.0, 1.0)
    first = packed(Watched(passage, Touched(0.0, 0.0, 1.0, np.nan)))
    seen = np.tile(np.repeat(first, LANES), (len(conditions), 1))
    hold, most = (math.ceil(t / PERIOD - 1e-9) for t in (column.hold, column.hold + column.limit))
    times = np.array([hold, most, column.stop, ticks_in(PERIOD)], np.int64)
    values = pack_model(vehicle, WORLD, named_law(law))
    fly_blocks(compiled(law).address, rows, path, times, new_block(LANES), conditions, values, seen)
    found = seen.reshape(-1, size_of(Watched), LANES).transpose(0, 2, 1).reshape(len(rows), -1)
    return _flights(rows, found, hold * PERIOD)


def _flights(rows: np.ndarray, found: NDArray[np.float64], hold: float) -> Flights:
    """Name what was seen (n, numbers of `Watched`)."""
    passage, surface = Passage(*found[:, : SEEN.surface].T), Touched(*found[:, SEEN.surface :].T)
    tilt, surface_tilt = (np.arccos(np.minimum(least, 1.0)) for least in (passage.cos_tilt, surface.cos_tilt))
    return Flights(
        rows["outcome"].copy(),
        passage.began - hold,
        passage.left - hold,
        passage.within - hold,
        np.sqrt(passage.acceleration2),
        tilt,
        surface.crossings,
        np.sqrt(surface.speed2),
        surface_tilt,
        surface.vertical,
        rows["state"].copy(),
    )
