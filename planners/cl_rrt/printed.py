"""The crossing as the paper prints it: come to rest at the gate, go vertically, end beyond the zone."""

from hydrone_gym._jit import inlined, routine
from hydrone_gym.control.reference import clamp
from hydrone_gym.physics.trigonometry import wrap
from hydrone_gym.surface import is_air
from planners.cl_rrt.edge import ARRIVED, BLOCKED, adopt, edge
from planners.cl_rrt.tree import CROSSING, OPEN, SETTLING, node_state

SETTLE_LIMIT = 9.0  # s
CROSS_LIMIT = 12.0  # s
_BEYOND = 1.3  # m: where the reference goes on the other side
# Lateral and vertical speed (m/s) at which the vehicle may leave the gate
_STILL_AIR, _LEVEL_AIR = 0.3, 0.3
_STILL_WATER, _LEVEL_WATER = 1.0, 0.8
_APART = 0.12  # m from the column: what is left would pull the vehicle sideways inside the zone
_HEIGHT = 0.2  # m from the gate
_FACING = 0.15  # rad
_CLEAR_OF_ZONE = 0.05  # m


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


@routine
def _settle(p, source, size, column):
    """Append edges that come to rest at the gate; return (last node or -1 if they fail, new size)."""
    current = source
    for _ in range(int(SETTLE_LIMIT / p.check.period)):
        if at_gate(node_state(p, current), column):
            return current, size
        if size >= p.path.size - 1:
            break
        ended, flown = edge(p, current, size, column, p.margin)
        if ended == BLOCKED or flown.crossings > 0.0:
            break
        adopt(p, current, size, OPEN if ended == ARRIVED else SETTLING, ended, flown)
        current = size
        size += 1
        if ended == ARRIVED:
            return current, size
    return -1, size


@routine
def cross_as_printed(p, source, size, column):
    """Append a whole crossing from open node `source`; return the new size, or the old one if it fails."""
    w, first = p.check.world, size
    x, y, gate, psi = column
    down = is_air(gate)
    current, size = _settle(p, source, size, column)
    if current < 0 or p.nodes[current].goal:
        return size if current >= 0 else first
    beyond = clamp(-_BEYOND if down else _BEYOND, w.z_min + 0.1, w.z_max - 0.1)
    for _ in range(int(CROSS_LIMIT / p.check.period)):
        if size >= p.path.size - 1:
            return first
        ended, flown = edge(p, current, size, (x, y, beyond, psi), p.margin)
        if ended == BLOCKED:
            return first
        z = node_state(p, size).z
        through = is_air(z) != down and abs(z) > w.zone + _CLEAR_OF_ZONE
        kind = OPEN if through or ended == ARRIVED else CROSSING
        adopt(p, current, size, kind, ended, flown)
        current = size
        size += 1
        if kind == OPEN:
            return size
    return first
