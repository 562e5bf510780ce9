"""The check behind the shield, as kernels: can a reference be followed to rest, and if not, what can instead."""

import numpy as np

from hydrone_gym._jit import inlined, kernel, routine
from hydrone_gym.physics.trigonometry import sincos
from hydrone_gym.simulation.advance import advance
from hydrone_gym.simulation.model import unpack_model
from hydrone_gym.simulation.outcome import GOAL, RUNNING
from hydrone_gym.simulation.rows import load_row, store_row
from hydrone_gym.world.bodies import segment_distance
from planners.cl_rrt.references import AIR_GATE, WATER_GATE, hover_reference, inside
from planners.clearance import clearance_between

HELD = -1  # choice: no candidate was safe, what was verified last goes on
RETREAT = -2  # choice: nor was that any more, the vehicle turns under water and swims against its drift
MARGIN = 0.05  # m of clearance that checked motion keeps
LOOK_AHEAD = 12  # periods that a hover is simulated for
RETREAT_AHEAD = 20  # periods that a retreat is simulated for: a quarter turn takes ten
_RETREAT = 1.0  # m against the drift: beyond the hold radius, within which nobody drives
_TURNS = (0.0, 0.6, -0.6, 1.2, -1.2)  # rad from the direction against the drift, tried in this order
_REST = 0.03  # m/s: slower than this is rest, but for the drift under water
_LEVEL = 0.02  # rad and rad/s: who is tilted more stands still for a moment only
_NEAR = 5.0  # m: spheres whose surface is farther are out of reach of a period, a stop and the drift after it
_DRIFT = 12.0  # s: what is left of sway at the end of a stop in water goes on for a while
_GIVE = 0.002  # m: how much nearer than now a vehicle within the margin may come; more would add up
_LEAST = 0.001  # m


@routine
def _follow(row, eye, rx, ry, rz, psi, spheres, closest, count, margin, ticks, model, block, log):
    """Propagate a row one period toward a reference; return (whether that is safe, whether it arrives).

    Args:
        row: record of dtype `ROW`, changed in place.
        eye: (3,) where obstacles were sensed from, m.
        rx, ry, rz, psi: the reference, m and rad.
        spheres, closest, count: flat known spheres of one lane, as in `advance`.
        margin: clearance to keep, m.
        ticks: of a period.
        model: `Model`.
        block, log: working storage of one lane.
    """
    b, w = block[0], model.world
    row.ticks, row.clearance, row.outcome, row.crossings = 0.0, np.inf, RUNNING, 0.0
    load_row(b, 0, row, (rx, ry, rz, psi))
    advance(block, log, spheres, closest, count, model, 0, ticks, ticks)
    store_row(b, 0, row)
    row.reference[0], row.reference[1], row.reference[2], row.reference[3] = rx, ry, rz, psi
    smooth = True
    for slot in range(min(int(row.crossings), log.shape[1])):
        smooth = smooth and log[0, slot, 2] <= w.rough_speed and np.cos(log[0, slot, 3]) >= w.rough_cos_tilt
    s = row.state
    dx, dy, dz = s[0] - eye[0], s[1] - eye[1], s[2] - eye[2]
    reach = w.sensor_range - model.vehicle.radius
    sensed = dx * dx + dy * dy + dz * dz <= reach * reach
    arrives = row.outcome == GOAL
    return (row.outcome == RUNNING or arrives) and row.clearance >= margin and smooth and sensed, arrives


@inlined
def _near(x, y, z, spheres, near):
    """Copy the spheres near a point to the front of `near`; return how many they are."""
    count = 0
    for j in range(spheres.size // 4):
        k = 4 * j
        body = (spheres[k], spheres[k + 1], spheres[k + 2], spheres[k + 3])
        if segment_distance((x, y, z), (x, y, z), body) <= _NEAR:
            for c in range(4):
                near[4 * count + c] = spheres[k + c]
            count += 1
    return count


@inlined
def _single(value):
    """Round to the precision of the action space: what is checked is what is flown."""
    return float(np.float32(value))


@inlined
def _copy(source, destination):
    """Copy what a stop begins from, field by field: record assignment compiles slowly."""
    for c in range(12):
        destination.state[c] = source.state[c]
    for c in range(4):
        destination.integral[c], destination.reference[c] = source.integral[c], source.reference[c]
    for c in range(3):
        destination.goal[c] = source.goal[c]


@inlined
def _resting(s, hover, model):
    """Whether a state that a hover reference has been flown to for a period stays: slow, level, not about to drive."""
    dx, dy, hold = hover[0] - s[0], hover[1] - s[1], model.water_gains.hold_radius
    slow = s[6] * s[6] + s[7] * s[7] + s[8] * s[8] < _REST * _REST
    level = s[3] * s[3] + s[4] * s[4] + s[9] * s[9] + s[10] * s[10] < _LEVEL * _LEVEL
    return slow and level and abs(s[2]) > model.world.zone and (s[2] > 0.0 or dx * dx + dy * dy < hold * hold)


@routine
def _rests(row, eye, hover, periods, spheres, closest, count, margin, ticks, model, block, log):
    """Whether a row comes to rest safely at a hover reference (4,) within periods; the row is changed in place."""
    s = row.state
    for _ in range(periods):
        hx, hy, hz, heading = hover[0], hover[1], hover[2], hover[3]
        safe, arrives = _follow(
            row, eye, hx, hy, hz, heading, spheres, closest, count, margin, ticks, model, block, log
        )
        if arrives or not safe:
            return safe
        if _resting(s, hover, model):
            break
    if s[2] < 0.0:
        x, y = s[0] + _DRIFT * s[6], s[1] + _DRIFT * s[7]
        w = model.world
        if not (w.x_min < x < w.x_max and w.y_min < y < w.y_max):
            return False
        return clearance_between(s, (x, y, s[2]), spheres, 0, count, model.vehicle.radius) >= margin
    return True


@routine
def _verify(row, scratch, rx, ry, rz, psi, hover, spheres, closest, count, margin, ticks, model, block, log):
    """Whether a reference can be followed to rest; writes the hover that does it to `hover` (4,).

    Near the surface there are two ways to stop: go back to the side one is on, or finish the crossing.
    """
    eye, end, spare = row.state, scratch[0], scratch[1]
    _copy(row, end)
    safe, arrives = _follow(end, eye, rx, ry, rz, psi, spheres, closest, count, margin, ticks, model, block, log)
    hx, hy, hz, heading = hover_reference(end, model)
    hover[0], hover[1], hover[2], hover[3] = _single(hx), _single(hy), _single(hz), _single(heading)
    if arrives or not safe:
        return safe
    _copy(end, spare)
    if _rests(spare, eye, hover, LOOK_AHEAD, spheres, closest, count, margin, ticks, model, block, log):
        return True
    if abs(end.state[2]) > AIR_GATE:
        return False
    hover[2] = _single(AIR_GATE if hz < 0.0 else -WATER_GATE)
    return _rests(end, eye, hover, LOOK_AHEAD, spheres, closest, count, margin, ticks, model, block, log)


@routine
def _goes_on(row, scratch, held, spheres, closest, count, margin, ticks, model, block, log):
    """Return HELD or RETREAT where no candidate verifies; a retreat is written to `held` (4,).

    Under water a hover drifts, so what was safe when it was verified may no longer be; then the vehicle swims against
    the drift, as nearly as is free. While it turns it may come nearer to spheres than the margin.
    """
    s, end = row.state, scratch[0]
    if s[2] > 0.0:
        return HELD
    _copy(row, end)
    if _rests(end, s, held, RETREAT_AHEAD, spheres, closest, count, margin, ticks, model, block, log):
        return HELD
    w, back = model.world, np.empty(4)
    back[2], back[3] = _single(inside(min(s[2], -WATER_GATE), w.z_min, w.z_max)), _single(s[5])
    scale = -_RETREAT / max(np.sqrt(s[6] * s[6] + s[7] * s[7]), 1e-9)
    for turn in _TURNS:
        sine, cosine = sincos(turn)
        back[0] = _single(inside(s[0] + scale * (cosine * s[6] - sine * s[7]), w.x_min, w.x_max))
        back[1] = _single(inside(s[1] + scale * (sine * s[6] + cosine * s[7]), w.y_min, w.y_max))
        _copy(row, end)
        if _rests(end, s, back, RETREAT_AHEAD, spheres, closest, count, _LEAST, ticks, model, block, log):
            for c in range(4):
                held[c] = back[c]
            return RETREAT
    return HELD


@kernel
def guard(rows, proposed, candidates, spheres, values, ticks, scratch, closest, block, log, sent, held, choice):
    """Check every row's reference and replace it where it is not safe.

    Args:
        rows: (n,) dtype `ROW`: state, memory, reference in force and goal.
        proposed: (n, 4) references, m and rad.
        candidates: (k, 3), see `CANDIDATES`.
        spheres: (n, 4 M) known spheres, unused ones far away.
        values: packed `Model`.
        ticks: of a period.
        scratch: (2,) dtype `ROW`.
        closest: (M,) working storage; block, log: that of one lane.
        sent: (n, 4) references to fly, written.
        held: (n, 4) hovers verified last, updated.
        choice: (n,) 0: as proposed, k: candidate k, HELD or RETREAT; written.
    """
    model = unpack_model(values)
    w = model.world
    hover, near = np.empty(4), np.empty(spheres.shape[1])
    for n in range(rows.size):
        row, s = rows[n], rows[n].state
        count = _near(s[0], s[1], s[2], spheres[n], near)
        left = clearance_between(s, s, near, 0, count, model.vehicle.radius) - _GIVE
        margin = max(min(MARGIN, left), _LEAST)
        dx, dy, dz = proposed[n, 0] - s[0], proposed[n, 1] - s[1], proposed[n, 2] - s[2]
        choice[n] = HELD
        for k in range(candidates.shape[0] + 1):
            rx, ry, rz, psi = proposed[n, 0], proposed[n, 1], proposed[n, 2], proposed[n, 3]
            if k > 0:
                scale, lift = candidates[k - 1, 0], candidates[k - 1, 2]
                sine, cosine = sincos(candidates[k - 1, 1])
                rx = inside(s[0] + scale * (cosine * dx - sine * dy), w.x_min, w.x_max)
                ry = inside(s[1] + scale * (sine * dx + cosine * dy), w.y_min, w.y_max)
                rz = inside(s[2] + scale * dz + lift, w.z_min, w.z_max)
            rx, ry, rz, psi = _single(rx), _single(ry), _single(rz), _single(psi)
            if _verify(row, scratch, rx, ry, rz, psi, hover, near, closest, count, margin, ticks, model, block, log):
                choice[n] = k
                sent[n, 0], sent[n, 1], sent[n, 2], sent[n, 3] = rx, ry, rz, psi
                for c in range(4):
                    held[n, c] = hover[c]
                break
        if choice[n] == HELD:
            choice[n] = _goes_on(row, scratch, held[n], near, closest, count, margin, ticks, model, block, log)
            for c in range(4):
                sent[n, c] = held[n, c]
