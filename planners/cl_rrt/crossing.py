"""The crossing as one macro edge: settle at the gate, go vertically through the zone, end open beyond it.

All of it is propagated before any of it joins the tree (Alg. 1, lines 9-10), so a vehicle that starts to cross has
already been seen to come out on the other side.
"""

import numpy as np

from hydrone_gym._jit import inlined, routine
from hydrone_gym.control.reference import clamp
from hydrone_gym.physics.trigonometry import arctan, wrap
from hydrone_gym.surface import is_air
from planners.cl_rrt.edge import ARRIVED, BLOCKED, adopt, edge
from planners.cl_rrt.tree import CROSSING, OPEN, SETTLING, node_state
from planners.clearance import clearance_between
from planners.stop_check import AIR_GATE, WATER_GATE, inside

_SETTLE_LIMIT = 9.0  # s
_CROSS_LIMIT = 12.0  # s
_BEYOND = 1.3  # m: where the reference goes on the other side
# Lateral and vertical speed (m/s) at which the vehicle may leave the gate
_STILL_AIR, _LEVEL_AIR = 0.3, 0.3
_STILL_WATER, _LEVEL_WATER = 1.0, 0.8
_HEIGHT = 0.2  # m from the gate
_FACING = 0.15  # rad
_NEAR = 0.6  # m: a heading toward something nearer means nothing
_CLEAR_OF_ZONE = 0.05  # m
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
def at_gate(p, s, column):
    """Whether a vehicle may leave the gate of a column (x, y, gate, psi): too slow to move sideways in the zone.

    From below it need not lie still: water brakes it before the zone, and it cannot hold a place sideways anyway.
    """
    x, y, gate, psi = column
    down = is_air(gate)
    still, level = (_STILL_AIR, _LEVEL_AIR) if down else (_STILL_WATER, _LEVEL_WATER)
    slow = s.vx * s.vx + s.vy * s.vy < still * still and abs(s.vz) < level
    dx, dy = s.x - x, s.y - y
    placed = dx * dx + dy * dy < p.settings.apart * p.settings.apart and abs(wrap(s.psi - psi)) < _FACING
    return slow and abs(s.z - gate) < _HEIGHT and (placed or not down)


@inlined
def column_from(p, s, sample):
    """Return the column (x, y, gate, psi) that a vehicle at the gate crosses in: where it stops, turned to go on."""
    goal, down = p.check.goal, is_air(s.z)
    ahead = p.check.envelope.stop_time if down else _AHEAD
    x, y, _ = inside(p.check, s.x + ahead * s.vx, s.y + ahead * s.vy, s.z)
    psi = s.psi
    if down:
        psi = facing(x, y, sample.x, sample.y, psi)
        psi = facing(x, y, goal.x, goal.y, psi) if psi == s.psi else psi
    return x, y, AIR_GATE if down else -WATER_GATE, psi


@routine
def settle(p, source, size, column):
    """Append edges that come to rest at the gate; return (last node or -1 if they fail, new size)."""
    current = source
    for _ in range(int(_SETTLE_LIMIT / p.check.period)):
        if at_gate(p, node_state(p, current), column):
            return current, size
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
            return current, size
    return -1, size


@routine
def cross(p, source, size, sample):
    """Append a whole crossing from open node `source`; return the new size, or the old one if it fails."""
    w, s, first = p.check.world, node_state(p, source), size
    column = column_from(p, s, sample)
    x, y, gate, psi = column
    down = is_air(gate)
    if not column_is_free(p, x, y):
        return first
    current, size = settle(p, source, size, column)
    if current < 0 or p.nodes[current].goal:
        return size if current >= 0 else first
    beyond = clamp(-_BEYOND if down else _BEYOND, w.z_min + 0.1, w.z_max - 0.1)
    for _ in range(int(_CROSS_LIMIT / p.check.period)):
        if size >= p.path.size - 1:
            return first
        ended, flown = edge(p, current, size, (x, y, beyond, psi), p.margin)
        if ended == BLOCKED:
            return first
        z = node_state(p, size).z
        through = is_air(z) != down and abs(z) > w.zone + _CLEAR_OF_ZONE
        kind = OPEN if through or ended == ARRIVED else CROSSING
        adopt(p, current, size, kind, ended, flown)
        p.nodes[size].next = -1 if kind == OPEN else size + 1
        current = size
        size += 1
        if kind == OPEN:
            return size
    return first
