"""The crossing as one macro edge: settle at the gate, go vertically through the zone, end open beyond it.

All of it is propagated before any of it joins the tree (Alg. 1, lines 9-10), so a vehicle that starts to cross has
already been seen to come out on the other side.
"""

import numpy as np

from hydrone_gym._jit import inlined, routine
from hydrone_gym._memory import pointer
from hydrone_gym.control.reference import clamp
from hydrone_gym.physics.trigonometry import arctan, wrap
from hydrone_gym.simulation.storage import Point
from hydrone_gym.surface import is_air
from planners.cl_rrt.edge import ARRIVED, BLOCKED, adopt, edge, zone_edge
from planners.cl_rrt.references import air_reference, water_reference
from planners.cl_rrt.tree import CROSSING, OPEN, SETTLING, node_state
from planners.clearance import clearance_between
from planners.stop_check import AIR_GATE, WATER_GATE, inside

_SETTLE_LIMIT = 9.0  # s
_CROSS_LIMIT = 12.0  # s
_BEYOND = 1.3  # m: where the reference goes on the other side
# Lateral and vertical speed (m/s) at which the vehicle may leave the gate
_STILL_AIR, _LEVEL_AIR = 0.3, 0.3
_STILL_WATER, _LEVEL_WATER = 1.0, 0.8
_APART = 0.12  # m from the column: what is left would pull the vehicle sideways inside the zone
_HEIGHT = 0.2  # m from the gate
_FACING = 0.15  # rad
_NEAR = 0.6  # m: a heading toward something nearer means nothing
_CLEAR_OF_ZONE = 0.05  # m
_HEIGHTS = (0.9, 1.1, 1.3)  # m
_MOST_LEAD = 0.8  # s
_BISECTIONS = 6
_FULL_RATE = 0.55  # m
_SLOW = 1.2
_BRAKE_LIMIT = 0.75  # s
_SPARE = 0.1  # m
_DOWN, _UP = 0.85, 1.4
_LEAVING = 1.0  # m/s
_AHEAD = 0.1  # s: a vehicle under water drifts on while it rises to the gate


@inlined
def facing(x, y, to_x, to_y, psi):
    """Heading (rad) for swimming from a point toward another, bow or stern first, whichever turns less."""
    dx, dy = to_x - x, to_y - y
    if dx * dx + dy * dy < _NEAR * _NEAR:
        return psi
    heading = arctan(dy / dx) if dx != 0.0 else 0.5 * np.pi
    turn = wrap(heading - psi)
    turn = turn - np.pi if turn > 0.5 * np.pi else turn
    turn = turn + np.pi if turn < -0.5 * np.pi else turn
    return wrap(psi + turn)


@inlined
def column_is_free(p, x, y):
    """Whether a vertical path through the zone clears every known obstacle."""
    return clearance_between((x, y, AIR_GATE), (x, y, -WATER_GATE), p.check.lane, 0, p.check.radius) >= p.margin


@inlined
def at_gate(s, column):
    """Whether a vehicle may leave the gate of a column (x, y, gate, psi): too slow to move sideways in the zone.

    From below it need not lie still: water brakes it before the zone, and it cannot hold a place sideways anyway.
    """
    x, y, gate, psi = column
    down = is_air(gate)
    still, level = (_STILL_AIR, _LEVEL_AIR) if down else (_STILL_WATER, _LEVEL_WATER)
    slow = s.vx * s.vx + s.vy * s.vy < still * still and abs(s.vz) < level
    dx, dy = s.x - x, s.y - y
    placed = dx * dx + dy * dy < _APART * _APART and abs(wrap(s.psi - psi)) < _FACING
    return slow and abs(s.z - gate) < _HEIGHT and (placed or not down)


@inlined
def column_from(p, s, sample):
    """Return the column (x, y, gate, psi) that a vehicle at the gate crosses in: where it stops, turned to go on."""
    w, goal, down = p.check.world, p.check.goal, is_air(s.z)
    ahead = p.check.envelope.stop_time if down else _AHEAD
    x, y = inside(s.x + ahead * s.vx, w.x_min, w.x_max), inside(s.y + ahead * s.vy, w.y_min, w.y_max)
    psi = s.psi
    if down:
        psi = facing(x, y, sample.x, sample.y, psi)
        psi = facing(x, y, goal.x, goal.y, psi) if psi == s.psi else psi
    return x, y, AIR_GATE if down else -WATER_GATE, psi


@inlined
def onward_from(p, column, sample):
    """Return the `Point` that a vehicle goes to once it has crossed: the sample, or the goal if that is the column's."""
    goal = p.check.goal
    dx, dy = sample.x - column[0], sample.y - column[1]
    at_column = dx * dx + dy * dy < _NEAR * _NEAR
    return Point(goal.x if at_column else sample.x, goal.y if at_column else sample.y, goal.z)


@inlined
def beyond_from(p, s, column):
    """Return the height (m) to send the reference to: on the other side, and far enough on for full speed."""
    w, down = p.check.world, is_air(column[2])
    z = min(-_DOWN, s.z - _FULL_RATE) if down else max(_UP, s.z + _FULL_RATE)
    return clamp(z, w.z_min + 0.1, w.z_max - 0.1)


@routine
def leave(p, source, slot, column, onward):
    """Propagate an edge that leaves the zone and goes on sideways already; return what `edge` does."""
    s, vessel, down = node_state(p, source), pointer(p.nodes[source]), is_air(column[2])
    if down:
        x, y, z, psi = water_reference(p, vessel, onward)
        z = min(z, beyond_from(p, s, column))
    else:
        x, y, z, psi = air_reference(p, vessel, onward, column[3], p.settings.step)
        z = max(z, beyond_from(p, s, column))
    ended, flown = zone_edge(p, source, slot, (x, y, z, psi), p.margin)
    clear = abs(node_state(p, slot).z) > p.check.world.zone + _CLEAR_OF_ZONE
    return ended if clear or ended == ARRIVED else BLOCKED, flown


@routine
def through(p, source, size, column, onward):
    """Append the way from the gate through the zone; return (the new size, or the old one if it fails, last slot flown).

    As printed it is vertical and ends beyond the zone. Else the vehicle is watched in every tick, and the edge that leaves the zone goes
    on to `onward` already.
    """
    w, first, current = p.check.world, size, source
    x, y, gate, psi = column
    down, printed = is_air(gate), p.objective.paper > 0.0
    printed_z = clamp(-_BEYOND if down else _BEYOND, w.z_min + 0.1, w.z_max - 0.1)
    for _ in range(int(_CROSS_LIMIT / p.check.period)):
        if size >= p.path.size - 1:
            break
        if printed:
            ended, flown = edge(p, current, size, (x, y, printed_z, psi), p.margin)
        else:
            s, ended = node_state(p, current), BLOCKED
            if is_air(s.z) != down and abs(s.z) + _LEAVING * p.check.period > w.zone:
                ended, flown = leave(p, current, size, column, onward)
            if ended == BLOCKED:
                ended, flown = zone_edge(p, current, size, (x, y, beyond_from(p, s, column), psi), p.margin)
        if ended == BLOCKED:
            break
        z = node_state(p, size).z
        clear = is_air(z) != down and abs(z) > w.zone + _CLEAR_OF_ZONE
        kind = OPEN if clear or ended == ARRIVED else CROSSING
        adopt(p, current, size, kind, ended, flown)
        p.nodes[size].next = -1 if kind == OPEN else size + 1
        current = size
        size += 1
        if kind == OPEN:
            return size, current
    return first, size


@inlined
def lead(p, s, seconds, z, psi):
    """Return the reference (x, y, z, psi) that leads a vehicle by so many seconds along its velocity."""
    w = p.check.world
    return inside(s.x + seconds * s.vx, w.x_min, w.x_max), inside(s.y + seconds * s.vy, w.y_min, w.y_max), z, psi


@routine
def enter(p, source, size, column, onward):
    """Append the way through the zone from a vehicle that still moves sideways; return the new size, or the old one.

    How far the reference leads it is sought by bisection, until it enters the zone without lateral speed.
    """
    s, low, high = node_state(p, source), -_MOST_LEAD, _MOST_LEAD
    for _ in range(_BISECTIONS):
        seconds = 0.5 * (low + high)
        grown, last = through(p, source, size, lead(p, s, seconds, column[2], column[3]), onward)
        if grown > size:
            return grown
        end = node_state(p, last)
        ahead = s.vx * end.vx + s.vy * end.vy > 0.0
        high = seconds if ahead else high
        low = low if ahead else seconds
    return size


@routine
def cross(p, source, size, sample):
    """Append a whole crossing from open node `source`; return the new size, or the old one if it fails."""
    s = node_state(p, source)
    column = column_from(p, s, sample)
    if not column_is_free(p, column[0], column[1]):
        return size
    onward = onward_from(p, column, sample)
    if p.objective.paper > 0.0:
        return cross_as_printed(p, source, size, column, onward)
    down = is_air(s.z)
    if not down or s.vx * s.vx + s.vy * s.vy < _SLOW * _SLOW:
        grown = enter(p, source, size, column, onward)
        if grown > size:
            return grown
    for k in range(len(_HEIGHTS)):
        last = k == len(_HEIGHTS) - 1 or not down
        limit = _SETTLE_LIMIT if last else _BRAKE_LIMIT
        brake = lead(p, s, 0.65*p.check.envelope.stop_time if down else _AHEAD, _HEIGHTS[k] if down else column[2], column[3])
        grown = settle(p, source, size, brake, onward, int(limit / p.check.period))
        if grown > size or not down:
            return grown
    return size


@routine
def settle(p, source, size, brake, onward, limit):
    """Append edges that brake before the zone until the vehicle may enter it, and those through it."""
    first, current = size, source
    for step in range(limit):
        if size >= p.path.size - 1:
            break
        ended, flown = zone_edge(p, current, size, brake, p.margin)
        if ended == BLOCKED or flown.crossings > 0.0:
            break
        adopt(p, current, size, SETTLING, ended, flown)
        p.nodes[size].next = size + 1
        current = size
        size += 1
        if ended == ARRIVED:
            p.nodes[current].kind = OPEN
            return size
        s = node_state(p, current)
        if s.vx * s.vx + s.vy * s.vy < _SLOW * _SLOW:
            gate = AIR_GATE if is_air(s.z) else -WATER_GATE
            grown, _ = through(p, current, size, (brake[0], brake[1], gate, brake[3]), onward)
            if grown > size:
                return grown
            grown = enter(p, current, size, (brake[0], brake[1], gate, brake[3]), onward)
            if grown > size:
                return grown
    return first


@routine
def cross_as_printed(p, source, size, column, onward):
    """Append a crossing that comes to rest at the gate first; return the new size, or the old one if it fails."""
    first, current = size, source
    for _ in range(int(_SETTLE_LIMIT / p.check.period)):
        if at_gate(node_state(p, current), column):
            grown, _ = through(p, current, size, column, onward)
            return grown if grown > size else first
        if size >= p.path.size - 1:
            break
        ended, flown = edge(p, current, size, column, p.margin)
        if ended == BLOCKED or flown.crossings > 0.0:
            break
        adopt(p, current, size, SETTLING, ended, flown)
        p.nodes[size].next = size + 1
        current = size
        size += 1
        if ended == ARRIVED:
            p.nodes[current].kind = OPEN
            return size
    return first
