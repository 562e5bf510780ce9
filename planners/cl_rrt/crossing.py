"""The crossing as one macro edge: settle at the gate, go vertically through the zone, end open beyond it.

All of it is propagated before any of it joins the tree (Alg. 1, lines 9-10), so a vehicle that starts to cross has
already been seen to come out on the other side.
"""

import numpy as np

from hydrone_gym._jit import inlined, routine
from hydrone_gym.control.reference import clamp
from hydrone_gym.physics.trigonometry import arctan, wrap
from hydrone_gym.simulation.advance import TICK
from hydrone_gym.simulation.model import unpack_model
from planners.cl_rrt.edge import ARRIVED, BLOCKED, adopt, edge
from planners.cl_rrt.references import AIR_GATE, WATER_GATE, inside
from planners.cl_rrt.tree import CROSSING, OPEN, SETTLING
from planners.clearance import clearance_between

_SETTLE_LIMIT = 9.0  # s
_CROSS_LIMIT = 12.0  # s
_BEYOND = 1.3  # m: where the reference goes on the other side
STOP_TIME = 0.45  # s: stop distance over speed in air
# Lateral and vertical speed (m/s) at which the vehicle may leave the gate
_STILL_AIR, _LEVEL_AIR = 0.3, 0.3
_STILL_WATER, _LEVEL_WATER = 1.0, 0.8
_APART = 0.12  # m from the column: what is left would pull the vehicle sideways inside the zone
_HEIGHT = 0.2  # m from the gate
_FACING = 0.15  # rad
_NEAR = 0.6  # m: a heading toward something nearer means nothing
_CLEAR_OF_ZONE = 0.05  # m


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
def column_is_free(work, x, y, radius, margin):
    """Whether a vertical path through the zone clears every known obstacle."""
    above, below = (x, y, AIR_GATE), (x, y, -WATER_GATE)
    return clearance_between(above, below, work.obstacles, 0, work.closest.size, radius) >= margin


@inlined
def at_gate(state, x, y, gate, psi):
    """Whether a vehicle may leave the gate in column (x, y): so slow that it moves only vertically inside the zone.

    From below it need not lie still: water brakes it before the zone, and it cannot hold a place sideways anyway.
    """
    down = gate > 0.0
    still, level = (_STILL_AIR, _LEVEL_AIR) if down else (_STILL_WATER, _LEVEL_WATER)
    slow = state[6] * state[6] + state[7] * state[7] < still * still and abs(state[8]) < level
    dx, dy = state[0] - x, state[1] - y
    placed = dx * dx + dy * dy < _APART * _APART and abs(wrap(state[5] - psi)) < _FACING
    return slow and abs(state[2] - gate) < _HEIGHT and (placed or not down)


@routine
def cross(work, values, goal, source, size, sample_x, sample_y, objective, margin, ticks):
    """Append a whole crossing from open node `source`; return the new size, or the old one if it fails."""
    model = unpack_model(values)
    period = ticks * TICK
    s = work.nodes[source].state
    down = s[2] > 0.0
    ahead = STOP_TIME if down else 0.1
    x = inside(s[0] + ahead * s[6], model.world.x_min, model.world.x_max)
    y = inside(s[1] + ahead * s[7], model.world.y_min, model.world.y_max)
    if not column_is_free(work, x, y, model.vehicle.radius, margin):
        return size
    psi = s[5]
    if down:
        psi = facing(x, y, sample_x, sample_y, psi)
        psi = facing(x, y, goal[0], goal[1], psi) if psi == s[5] else psi
    gate = AIR_GATE if down else -WATER_GATE
    current, first = source, size
    settled = False
    for _ in range(int(_SETTLE_LIMIT / period)):
        settled = at_gate(work.nodes[current].state, x, y, gate, psi)
        if settled or size >= work.path.size - 1:
            break
        result, crossed = edge(work, values, goal, current, size, x, y, gate, psi, margin, ticks)
        if result == BLOCKED or crossed:
            return first
        adopt(work, goal, objective, current, size, SETTLING, result == ARRIVED)
        work.nodes[size].next = size + 1
        current = size
        size += 1
        if result == ARRIVED:
            work.nodes[current].kind = OPEN
            return size
    if not settled:
        return first
    beyond = clamp(-_BEYOND if down else _BEYOND, model.world.z_min + 0.1, model.world.z_max - 0.1)
    for _ in range(int(_CROSS_LIMIT / period)):
        if size >= work.path.size - 1:
            return first
        result, _ = edge(work, values, goal, current, size, x, y, beyond, psi, margin, ticks)
        if result == BLOCKED:
            return first
        z = work.nodes[size].state[2]
        through = (z > 0.0) != down and abs(z) > model.world.zone + _CLEAR_OF_ZONE
        kind = OPEN if through or result == ARRIVED else CROSSING
        adopt(work, goal, objective, current, size, kind, result == ARRIVED)
        work.nodes[size].next = -1 if kind == OPEN else size + 1
        current = size
        size += 1
        if kind == OPEN:
            return size
    return first
