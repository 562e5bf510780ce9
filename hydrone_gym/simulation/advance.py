"""The one kernel: advance every lane of a block by ticks of one period, in closed loop.

Reference ramp, control, dynamics and energy every 10 ms; swept collision, sensing, bounds, crossings, arrival and
divergence every tick of 50 ms. The environment's step, a row of the vector environment and the planner's tree edge all
run this code, so what the planner predicts is what the environment does.
"""

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym.control.law import control
from hydrone_gym.control.reference import Integral, Reference
from hydrone_gym.physics.dynamics import medium_at, step
from hydrone_gym.physics.kinematics import attitude_of
from hydrone_gym.physics.rotors import shaft_power
from hydrone_gym.physics.trigonometry import wrap
from hydrone_gym.simulation.block import LOGGED_CROSSINGS, keep_or_restore, load_state, save_lane, store_state
from hydrone_gym.simulation.outcome import COLLISION, DIVERGED, GOAL, OUT_OF_BOUNDS, ROUGH_TRANSITION, RUNNING
from hydrone_gym.surface import is_air
from hydrone_gym.world.bodies import inverse_square, path_distance

DT = 0.01  # s: physics and control
SUBSTEPS = 5  # physics steps a tick
TICK = DT * SUBSTEPS  # s: collision, sensing and outcome
# Beyond these the model means nothing any more, and the outcome is DIVERGED.
SPEED_BOUND = 30.0  # m/s
RATE_BOUND = 100.0  # rad/s
COS_TILT_BOUND = 0.05  # 87 degrees: Euler angles are singular at 90


@inlined
def substep(b, i, fraction, inverse_period, model):
    """Advance lane i by one physics step; `fraction` is how far the reference has moved by its end."""
    state = load_state(b, i)
    attitude = attitude_of(state)
    air = is_air(state.z)
    medium = medium_at(model.vehicle, air)
    vertical = abs(state.z) <= model.world.zone and model.world.vertical_mode > 0.0
    # never accumulated: old + move * fraction is the same number however the period is cut up
    reference = Reference(
        b.old_x[i] + b.move_x[i] * fraction,
        b.old_y[i] + b.move_y[i] * fraction,
        b.old_z[i] + b.move_z[i] * fraction,
        wrap(b.old_psi[i] + b.move_psi[i] * fraction),
        b.move_x[i] * inverse_period,
        b.move_y[i] * inverse_period,
        b.move_z[i] * inverse_period,
    )
    integral = Integral(b.integral_z[i], b.integral_phi[i], b.integral_theta[i], b.integral_psi[i])
    speeds, integral = control(state, attitude, integral, reference, vertical, model, medium, air, DT)
    new = step(state, attitude, speeds, model.vehicle, medium, air, DT)
    b.energy[i] += shaft_power(medium, speeds) * DT
    crossed = air != is_air(new.z)
    b.integral_z[i] = 0.0 if crossed else integral.z
    b.integral_phi[i] = 0.0 if crossed else integral.phi
    b.integral_theta[i] = 0.0 if crossed else integral.theta
    b.integral_psi[i] = 0.0 if crossed else integral.psi
    note_crossing(b, i, crossed, air, new, attitude)
    store_state(b, i, new)


@inlined
def note_crossing(b, i, crossed, air, new, attitude):
    """Remember this tick's crossing: its last direction and its worst lateral speed and tilt."""
    speed2 = new.vx * new.vx + new.vy * new.vy
    cosine = attitude.c_phi * attitude.c_theta
    b.crossed[i] += 1.0 if crossed else 0.0
    b.cross_direction[i] = (-1.0 if air else 1.0) if crossed else b.cross_direction[i]
    b.cross_vz[i] = new.vz if crossed else b.cross_vz[i]
    b.cross_speed2[i] = speed2 if crossed and not speed2 <= b.cross_speed2[i] else b.cross_speed2[i]
    b.cross_cos[i] = cosine if crossed and not cosine >= b.cross_cos[i] else b.cross_cos[i]


@inlined
def begin_tick(b, i):
    """Save lane i and clear what a tick collects."""
    save_lane(b, i)
    b.crossed[i] = 0.0
    b.cross_speed2[i] = 0.0
    b.cross_cos[i] = 1.0


@inlined
def end_tick(b, i, model):
    """Judge lane i: outcome, and the state it keeps. A finished lane stays frozen where it ended."""
    w = model.world
    s = load_state(b, i)
    before = b.outcome[i]
    running = before == RUNNING
    attitude = attitude_of(s)
    speed2 = s.vx * s.vx + s.vy * s.vy + s.vz * s.vz
    rate2 = s.p * s.p + s.q * s.q + s.r * s.r
    upright = attitude.c_phi * attitude.c_theta > COS_TILT_BOUND and abs(s.phi) < 1.6 and abs(s.theta) < 1.6
    # every comparison with NaN is false, so this is also the test for not-a-number
    sane = speed2 < SPEED_BOUND**2 and rate2 < RATE_BOUND**2 and upright and s.x * s.x + s.y * s.y + s.z * s.z < 1e12
    inside = (
        w.x_min <= s.x and s.x <= w.x_max and w.y_min <= s.y and s.y <= w.y_max and w.z_min <= s.z and s.z <= w.z_max
    )
    rough = b.crossed[i] > 0.0 and w.rough_fails > 0.0
    rough = rough and (b.cross_speed2[i] > w.rough_speed * w.rough_speed or b.cross_cos[i] < w.rough_cos_tilt)
    gx, gy, gz = s.x - b.goal_x[i], s.y - b.goal_y[i], s.z - b.goal_z[i]
    arrived = gx * gx + gy * gy + gz * gz <= w.goal_radius * w.goal_radius
    outcome = GOAL if arrived else RUNNING
    outcome = ROUGH_TRANSITION if rough else outcome
    outcome = outcome if inside else OUT_OF_BOUNDS
    outcome = COLLISION if b.clearance[i] <= 0.0 else outcome
    outcome = outcome if sane else DIVERGED
    b.outcome[i] = outcome if running else before
    b.ticks[i] += 1.0 if running else 0.0
    b.crossed[i] = b.crossed[i] if running and sane else 0.0
    keep_or_restore(b, i, running and sane)


@inlined
def sweep(b, i, j, lanes, obstacles, closest, radius):
    """Measure lane i's path of this tick against obstacle j."""
    k = 4 * j * lanes + i
    a = (b.saved_x[i], b.saved_y[i], b.saved_z[i])
    d = (b.x[i] - a[0], b.y[i] - a[1], b.z[i] - a[2])
    body = (obstacles[k], obstacles[k + lanes], obstacles[k + 2 * lanes], obstacles[k + 3 * lanes])
    distance = path_distance(a, d, b.inverse_length2[i], body)
    running = b.outcome[i] == RUNNING
    near = closest[j * lanes + i]
    closest[j * lanes + i] = distance if running and distance < near else near
    clearance = distance - radius
    b.clearance[i] = clearance if running and clearance < b.clearance[i] else b.clearance[i]


@inlined
def log_crossings(b, log, lanes):
    """Write this tick's crossings to the rows' logs: rare, so not vectorised."""
    for i in range(lanes):
        if b.crossed[i] > 0.0:
            slot = int(b.crossings[i])
            if slot < LOGGED_CROSSINGS:
                log[i, slot, 0] = b.ticks[i] * TICK
                log[i, slot, 1] = b.cross_direction[i]
                log[i, slot, 2] = np.sqrt(b.cross_speed2[i])
                log[i, slot, 3] = np.arccos(min(b.cross_cos[i], 1.0))
                log[i, slot, 4] = b.cross_vz[i]
            b.crossings[i] += 1.0


@inlined
def advance(block, log, obstacles, closest, count, model, first, last, ticks):
    """Advance all lanes through ticks [first, last) of a period of `ticks` ticks.

    Args:
        block: from `new_block`; references already loaded as old and move.
        log: (lanes, LOGGED_CROSSINGS, 5) crossing log.
        obstacles: flat, entry (j, c) of lane i at ``(4 j + c) lanes + i``: x, y, z, radius in m.
        closest: flat (count * lanes), least distance so far from each obstacle's surface, m; updated.
        count: number of obstacles.
        model: `Model`.
        first, last, ticks: which part of the period.
    """
    b = block[0]
    lanes = b.x.size
    inverse_substeps = 1.0 / (ticks * SUBSTEPS)
    inverse_period = 1.0 / (ticks * TICK)
    for tick in range(first, last):
        for i in range(lanes):
            begin_tick(b, i)
        for sub in range(SUBSTEPS):
            fraction = (tick * SUBSTEPS + sub + 1) * inverse_substeps
            for i in range(lanes):
                substep(b, i, fraction, inverse_period, model)
        for i in range(lanes):
            b.inverse_length2[i] = inverse_square(b.x[i] - b.saved_x[i], b.y[i] - b.saved_y[i], b.z[i] - b.saved_z[i])
        for j in range(count):
            for i in range(lanes):
                sweep(b, i, j, lanes, obstacles, closest, model.vehicle.radius)
        for i in range(lanes):
            end_tick(b, i, model)
        log_crossings(b, log, lanes)
