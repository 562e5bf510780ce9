"""The one kernel: advance every lane of a block by ticks of one period, in closed loop.

Reference ramp, control, dynamics and energy every 10 ms; swept collision, bounds, crossings, arrival and divergence
every tick of 50 ms. The environment's step, a row of the vector environment and the planner's tree edge all call this
code, so what the planner predicts is what the environment does.
"""

import functools
from typing import Any

import numpy as np
from numba import types

from hydrone_gym._jit import inlined, unit
from hydrone_gym._memory import gather, scatter, select, zero_like
from hydrone_gym.control.law import control, pre_spin
from hydrone_gym.control.laws import named_law
from hydrone_gym.control.reference import FLAT, Instant, Integral, Reference
from hydrone_gym.physics.dynamics import medium_at, step
from hydrone_gym.physics.kinematics import State, attitude_of, euler_rates
from hydrone_gym.physics.rotors import shaft_power
from hydrone_gym.physics.trigonometry import wrap
from hydrone_gym.simulation.clock import DT, SUBSTEPS, TICK
from hydrone_gym.simulation.in_weather import any_rare, sample, surface_below, takes_for_air, weathered_step
from hydrone_gym.simulation.outcome import COLLISION, DIVERGED, GOAL, OUT_OF_BOUNDS, ROUGH_TRANSITION, RUNNING
from hydrone_gym.simulation.storage import (
    AT,
    CLEARANCE,
    CROSSINGS,
    ENERGY,
    FLOWN_AT,
    LANE_AT,
    LOG,
    LOG_ENTRY,
    LOGGED_CROSSINGS,
    OUTCOME,
    Crossing,
    CrossingEntry,
    Episode,
    Flown,
    Point,
    Pose,
    model_of,
)
from hydrone_gym.surface import is_air
from hydrone_gym.world.bodies import inverse_square, path_distance

# Beyond these the model means nothing any more, and the outcome is DIVERGED.
SPEED_BOUND = 30.0  # m/s
RATE_BOUND = 100.0  # rad/s
COS_TILT_BOUND = 0.05  # 87 degrees: Euler angles are singular at 90


@inlined
def reference_at(b, i, lanes, fraction, inverse_period):
    """Return lane i's moving reference. Never accumulated: it is the same number however the period is cut up."""
    old = gather(b, AT.reference, i, lanes, Pose)
    move = gather(b, LANE_AT.move, i, lanes, Pose)
    return Reference(
        old.x + move.x * fraction,
        old.y + move.y * fraction,
        old.z + move.z * fraction,
        wrap(old.psi + move.psi * fraction),
        move.x * inverse_period,
        move.y * inverse_period,
        move.z * inverse_period,
    )


@inlined
def substep(b, i, lanes, part, inverses, model, weather):
    """Advance lane i by one physics step: `part` is how many of a period's are flown at its end, and of the tick's.

    In still air and flat water `weather` is None, and the vehicle is what its controller takes it to be.
    """
    state = gather(b, FLOWN_AT.state, i, lanes, State)
    integral = gather(b, FLOWN_AT.integral, i, lanes, Integral)
    attitude = attitude_of(state)
    air = is_air(state.z) if weather is None else takes_for_air(weather, i, lanes)
    medium = medium_at(model.vehicle, air)
    vertical = abs(state.z) <= model.world.zone and model.world.vertical_mode > 0.0
    rates = euler_rates(attitude, state.p, state.q, state.r)
    reference = reference_at(b, i, lanes, part[0] * inverses[0], inverses[1])
    surface = FLAT if weather is None else surface_below(weather, i, lanes, part[1])
    now = Instant(state, attitude, rates, reference, vertical, air, medium, surface)
    speeds, integral = control(now, integral, model, DT)
    if weather is None:
        new = step(state, attitude, speeds, model.vehicle, medium, air, DT)
        power = shaft_power(medium, speeds)
        noticed = air != is_air(new.z)
        note_crossing(b, i, lanes, noticed, is_air(new.z), (new.vx, new.vy, new.vz), attitude)
    else:
        new, power, noticed, crossing = weathered_step(weather, i, lanes, now, speeds, part[1], pre_spin(model.gains))
        note_crossing(b, i, lanes, crossing[0], crossing[1], crossing[2], attitude)
    scatter(b, ENERGY, i, lanes, gather(b, ENERGY, i, lanes, float) + power * DT)
    scatter(b, FLOWN_AT.integral, i, lanes, select(noticed, zero_like(integral), integral))
    scatter(b, FLOWN_AT.state, i, lanes, new)


@inlined
def note_crossing(b, i, lanes, crossed, air, velocity, attitude):
    """Remember this tick's crossing: its last direction and its worst lateral speed and tilt.

    `velocity` (x, y, z in m/s) is that of the vehicle relative to the water.
    """
    speed2 = velocity[0] * velocity[0] + velocity[1] * velocity[1]
    cosine = attitude.c_phi * attitude.c_theta
    c = gather(b, LANE_AT.crossing, i, lanes, Crossing)
    noted = Crossing(
        c.number + (1.0 if crossed else 0.0),
        (1.0 if air else -1.0) if crossed else c.direction,
        speed2 if crossed and not speed2 <= c.speed2 else c.speed2,
        cosine if crossed and not cosine >= c.cos_tilt else c.cos_tilt,
        velocity[2] if crossed else c.vz,
    )
    scatter(b, LANE_AT.crossing, i, lanes, noted)


@inlined
def begin_tick(b, i, lanes):
    """Keep what lane i must fall back to if it is finished already or diverges; clear what a tick collects."""
    scatter(b, LANE_AT.saved, i, lanes, gather(b, 0, i, lanes, Flown))
    scatter(b, LANE_AT.crossing, i, lanes, Crossing(0.0, 0.0, 0.0, 1.0, 0.0))


@inlined
def begin_ticks(b, lanes, width, weather, extra):
    """Begin a tick of all lanes, and move their weather on; `width` is that many, see `advance`."""
    for i in range(width):
        begin_tick(b, i, lanes)
    if weather is not None:
        rare = any_rare(weather, lanes)
        for i in range(width):
            sample(weather, i, lanes, b, rare, extra)


@inlined
def judge(b, i, lanes, w):
    """Return the outcome of lane i at the end of a tick, and whether its numbers mean anything; `w`: `WorldParams`."""
    s = gather(b, FLOWN_AT.state, i, lanes, State)
    c = gather(b, LANE_AT.crossing, i, lanes, Crossing)
    goal = gather(b, AT.goal, i, lanes, Point)
    attitude = attitude_of(s)
    speed2 = s.vx * s.vx + s.vy * s.vy + s.vz * s.vz
    rate2 = s.p * s.p + s.q * s.q + s.r * s.r
    upright = attitude.c_phi * attitude.c_theta > COS_TILT_BOUND and abs(s.phi) < 1.6 and abs(s.theta) < 1.6
    # every comparison with NaN is false, so this is also the test for not-a-number
    sane = speed2 < SPEED_BOUND**2 and rate2 < RATE_BOUND**2 and upright and s.x * s.x + s.y * s.y + s.z * s.z < 1e12
    inside = (
        w.x_min <= s.x and s.x <= w.x_max and w.y_min <= s.y and s.y <= w.y_max and w.z_min <= s.z and s.z <= w.z_max
    )
    rough = c.number > 0.0 and w.rough_fails > 0.0
    rough = rough and (c.speed2 > w.rough_speed * w.rough_speed or c.cos_tilt < w.rough_cos_tilt)
    gx, gy, gz = s.x - goal.x, s.y - goal.y, s.z - goal.z
    arrived = gx * gx + gy * gy + gz * gz <= w.goal_radius * w.goal_radius
    outcome = GOAL if arrived else RUNNING
    outcome = ROUGH_TRANSITION if rough else outcome
    outcome = outcome if inside else OUT_OF_BOUNDS
    outcome = COLLISION if gather(b, CLEARANCE, i, lanes, float) <= 0.0 else outcome
    return outcome if sane else DIVERGED, sane


@inlined
def end_tick(b, i, lanes, world):
    """Judge lane i: outcome, and the state it keeps. A finished lane stays frozen where it ended."""
    outcome, sane = judge(b, i, lanes, world)
    episode = gather(b, AT.episode, i, lanes, Episode)
    running = episode.outcome == RUNNING
    keep = running and sane
    scatter(
        b,
        AT.episode,
        i,
        lanes,
        Episode(
            episode.ticks + (1.0 if running else 0.0),
            episode.clearance,
            outcome if running else episode.outcome,
            episode.crossings,
        ),
    )
    count = gather(b, LANE_AT.crossing, i, lanes, float)
    scatter(b, LANE_AT.crossing, i, lanes, count if keep else 0.0)
    saved = gather(b, LANE_AT.saved, i, lanes, Flown)
    scatter(b, 0, i, lanes, select(keep, gather(b, 0, i, lanes, Flown), saved))


@inlined
def sweep(b, i, lanes, j, obstacles, closest, radius):
    """Measure lane i's path of this tick against obstacle j."""
    a = gather(b, LANE_AT.saved, i, lanes, Point)  # a state begins with the position
    s = gather(b, 0, i, lanes, Point)
    body = gather(obstacles, 4 * j, i, lanes, Pose)
    distance = path_distance(a, (s.x - a.x, s.y - a.y, s.z - a.z), b[LANE_AT.inverse_length2 * lanes + i], body)
    running = gather(b, OUTCOME, i, lanes, float) == RUNNING
    near, least, clearance = (
        gather(closest, j, i, lanes, float),
        gather(b, CLEARANCE, i, lanes, float),
        distance - radius,
    )
    scatter(closest, j, i, lanes, distance if running and distance < near else near)
    scatter(b, CLEARANCE, i, lanes, clearance if running and clearance < least else least)


@inlined
def measure_path(b, i, lanes):
    """Work out what all obstacles share of lane i's path of this tick."""
    a, s = gather(b, LANE_AT.saved, i, lanes, Point), gather(b, 0, i, lanes, Point)
    scatter(b, LANE_AT.inverse_length2, i, lanes, inverse_square(s.x - a.x, s.y - a.y, s.z - a.z))


@inlined
def log_crossings(b, lanes):
    """Write this tick's crossings to the lanes' logs: rare, so not vectorised."""
    for i in range(lanes):
        c = gather(b, LANE_AT.crossing, i, lanes, Crossing)
        if c.number > 0.0:
            episode = gather(b, AT.episode, i, lanes, Episode)
            slot = int(episode.crossings)
            if slot < LOGGED_CROSSINGS:
                entry = CrossingEntry(episode.ticks * TICK, c.direction, np.sqrt(c.speed2), min(c.cos_tilt, 1.0), c.vz)
                scatter(b, LOG + slot * LOG_ENTRY, i, lanes, entry)
            scatter(b, CROSSINGS, i, lanes, episode.crossings + 1.0)


@inlined
def advance(b, lanes, obstacles, closest, count, model, part, weather, extra):
    """Advance all lanes through a part of a period.

    Args:
        b: a block from `new_block`; rows and the moves of their references already loaded.
        lanes: how many, a constant of the compilation.
        obstacles: entry (j, c) of lane i at ``(4 j + c) lanes + i``: x, y, z, radius in m.
        closest: (count * lanes), least distance so far from each obstacle's surface, m; updated.
        count: number of obstacles.
        model: `Model`.
        part: (first, last, ticks): ticks [first, last) of a period of `ticks` ticks.
        weather: the lanes' `Conditions`, or None for the nominal vehicle in still air and flat water.
        extra: the class of a disturbance in that weather, or None.
    """
    first, last, ticks = part
    inverses = (1.0 / (ticks * SUBSTEPS), 1.0 / (ticks * TICK))
    # all lanes; were it a constant to LLVM, it would unroll the short loops to scalars before it could vectorise them
    width = lanes if lanes == 1 or ticks > 0 else 0
    for tick in range(first, last):
        begin_ticks(b, lanes, width, weather, extra)
        for sub in range(SUBSTEPS):
            part = (tick * SUBSTEPS + sub + 1, sub + 1)
            for i in range(lanes):
                substep(b, i, lanes, part, inverses, model, weather)
        for i in range(width):
            measure_path(b, i, lanes)
        for j in range(count):
            for i in range(width):
                sweep(b, i, lanes, j, obstacles, closest, model.vehicle.radius)
        for i in range(lanes):
            end_tick(b, i, lanes, model.world)
        log_crossings(b, lanes)


@functools.cache
def compiled(law: str, lanes: int, weathered: bool = False, extra: type | None = None) -> Any:
    """Return `advance` compiled for a law and a number of lanes, with weather or without.

    Its `address` is what kernels call, ``call(address, block, obstacles, closest, weather, values, count, first, last,
    ticks)``; without weather that pointer is never read. `extra` is the class of a disturbance.
    """
    gains = named_law(law).gains

    def unit_of_law(block, obstacles, closest, weather, values, count, first, last, ticks):
        advance(block, lanes, obstacles, closest, count, model_of(values, gains), (first, last, ticks), None, None)

    def unit_with_weather(block, obstacles, closest, weather, values, count, first, last, ticks):
        model, part = model_of(values, gains), (first, last, ticks)
        advance(block, lanes, obstacles, closest, count, model, part, weather, extra)

    numbers, whole = types.CPointer(types.float64), types.int64
    signature = types.void(numbers, numbers, numbers, numbers, numbers, whole, whole, whole, whole)
    modules = {__name__, gains.__module__, __name__ if extra is None else extra.__module__}
    return unit(signature, unit_with_weather if weathered else unit_of_law, *sorted(modules))
