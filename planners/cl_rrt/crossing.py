"""The crossing as one macro edge: brake before the zone, go vertically through it, and on sideways at its end.

All of it is propagated before any of it joins the tree (Alg. 1, lines 9-10), so a vehicle that starts to cross has
already been seen to come out on the other side. The rule of the zone, vertical motion only, is judged in every tick of
what is flown: no condition at the gate is waited for, the vehicle goes as soon as it is seen to keep the rule.
"""

import numpy as np

from hydrone_gym._jit import inlined, routine
from hydrone_gym._memory import pointer, view
from hydrone_gym.control.reference import clamp
from hydrone_gym.physics.trigonometry import arctan, wrap
from hydrone_gym.simulation.storage import REFERENCE, Point, Pose
from hydrone_gym.surface import is_air
from planners.check import AIR_GATE, OF_DRIFT, WATER_GATE, inside, near_walls
from planners.cl_rrt.edge import ARRIVED, BLOCKED, adopt, zone_edge
from planners.cl_rrt.printed import CROSS_LIMIT, SETTLE_LIMIT, cross_as_printed
from planners.cl_rrt.references import air_reference, water_reference
from planners.cl_rrt.tree import CROSSING, OPEN, SETTLING, node_state
from planners.clearance import clearance_between

_NEAR = 0.6  # m: a heading toward something nearer means nothing
_AHEAD = 0.1  # s: a vehicle under water drifts on while it rises to the gate
_CLEAR_OF_ZONE = 0.02  # m
_BRAKE = 0.75  # s of braking after which another way to brake is tried
_BRAKE_LEAD = 0.3  # s: where a reference that brakes leads the vehicle
_BRAKE_HEIGHTS = (0.9, 1.3)  # m: the lower one is quicker, and enters the zone too early from a steep descent
_BRAKE_SHARES = (0.0, 0.5, 1.0)  # of the reference in force in the one that brakes: the less, the harder
_RISING = 0.5  # m: depth of the reference that a vehicle swims on with, until it brakes before the zone
_BLOWN = 1.25  # of what crossings keep from walls: who comes out of the water is caught by the wind
_SLOW = 1.2  # m/s: a faster vehicle cannot be still at the edge of the zone within a period
_LEAD = 0.8  # s: within this the reference that leads a vehicle into the zone is sought
_BISECTIONS = 6
_LEADS = (2.0, 1.2, 0.8, 0.5, 0.3)  # s, tried in this order where a vehicle need not be still in the zone
_STILL = 0.1  # m/s: below this speed nothing is to be gained by where the reference leads
_OPPOSITE = 0.85, 1.4  # m: least depth and height of the reference beyond the surface, for full speed inside the zone
_LEAVING = 1.0  # m/s: no vehicle leaves the zone faster


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
def heading_under(p, x, y, psi):
    """Heading (rad) to enter the water with at a place: toward the goal.

    In a current that is not known, on the line to the middle of the box: whichever wall it pushes to is left at once.
    """
    w, goal = p.check.world, p.check.goal
    weathered = p.check.lane.weathered > 0
    to_x = 0.5 * (w.x_min + w.x_max) if weathered else goal.x
    to_y = 0.5 * (w.y_min + w.y_max) if weathered else goal.y
    return facing(x, y, to_x, to_y, psi)


@inlined
def column_is_free(p, x, y, down):
    """Whether a vertical path through the zone clears every known obstacle, and a drift into the water most of it."""
    room = p.margin + (OF_DRIFT * p.settings.drift if down else 0.0)
    return clearance_between((x, y, AIR_GATE), (x, y, -WATER_GATE), p.check.lane, 0, p.check.radius) >= room


@inlined
def column_from(p, s, sample):
    """Return the column (x, y, gate, psi) that a vehicle at the gate crosses in: where it stops, turned to go on."""
    down = is_air(s.z)
    ahead = p.check.envelope.stop_time if down else _AHEAD
    x, y, _ = inside(p.check, s.x + ahead * s.vx, s.y + ahead * s.vy, s.z)
    psi = s.psi
    if down:
        psi = facing(x, y, sample.x, sample.y, psi)
        psi = heading_under(p, x, y, psi) if psi == s.psi or p.check.lane.weathered > 0 else psi
    return x, y, AIR_GATE if down else -WATER_GATE, psi


@inlined
def _onward(p, column, sample):
    """Return the `Point` that a vehicle goes to once it has crossed: over the sample, or the goal if it is there."""
    goal = p.check.goal
    dx, dy = sample.x - column[0], sample.y - column[1]
    # who need not be still in the zone runs past the sample
    there = dx * dx + dy * dy < _NEAR * _NEAR or p.check.world.vertical_mode == 0.0
    return Point(goal.x if there else sample.x, goal.y if there else sample.y, goal.z)


@inlined
def _beyond(p, s, down):
    """Return the height (m) to send the reference to: beyond the surface, and far enough on for full speed."""
    w = p.check.world
    on = p.objective.speeds.dive * (1.1 + p.check.period)
    z = min(-_OPPOSITE[0], s.z - on) if down else max(_OPPOSITE[1], s.z + on)
    return clamp(z, w.z_min + 0.1, w.z_max - 0.1)


@inlined
def _zone(p):
    """Half-height (m) of the zone in which motion is vertical; nothing where it need not be."""
    return p.check.world.zone if p.check.world.vertical_mode > 0.0 else 0.0


@routine
def _leave(p, source, slot, column, onward):
    """Propagate an edge that leaves the zone and goes on sideways at once; BLOCKED if it ends inside the zone."""
    s, vessel, down = node_state(p, source), pointer(p.nodes[source]), is_air(column[2])
    if down:
        x, y, z, psi = water_reference(p, vessel, onward)
        z = min(z, _beyond(p, s, down))
    else:
        x, y, z, psi = air_reference(p, vessel, onward, column[3], p.settings.step)
        z = max(z, _beyond(p, s, down))
    ended, flown, sway = zone_edge(p, source, slot, (x, y, z, psi), p.margin)
    clear = abs(node_state(p, slot).z) > _zone(p) + _CLEAR_OF_ZONE
    return ended if clear or ended == ARRIVED else BLOCKED, flown, sway


@routine
def _through(p, source, size, column, onward):
    """Append the way through the zone; return (new size, or the old one if it fails; lateral velocity then, m/s)."""
    first, current, down = size, source, is_air(column[2])
    zone, sway = _zone(p), (0.0, 0.0)
    for _ in range(int(CROSS_LIMIT / p.check.period)):
        if size >= p.path.size - 1:
            break
        s, ended = node_state(p, current), BLOCKED
        if is_air(s.z) != down and abs(s.z) + _LEAVING * p.check.period > zone:
            ended, flown, sway = _leave(p, current, size, column, onward)
        if ended == BLOCKED:
            vertical = (column[0], column[1], _beyond(p, s, down), column[3])
            ended, flown, sway = zone_edge(p, current, size, vertical, p.margin)
        if ended == BLOCKED:
            break
        z = node_state(p, size).z
        clear = is_air(z) != down and abs(z) > zone + _CLEAR_OF_ZONE
        kind = OPEN if clear or ended == ARRIVED else CROSSING
        adopt(p, current, size, kind, ended, flown)
        current = size
        size += 1
        if kind == OPEN:
            return size, sway
    return first, sway


@routine
def _enter(p, source, size, column, onward):
    """Append the way through the zone from a vehicle that may still move; return the new size, or the old one.

    How far the reference leads it before the zone is sought by bisection, until it enters without lateral speed.
    """
    w, s, down = p.check.world, node_state(p, source), is_air(column[2])
    speed2 = s.vx * s.vx + s.vy * s.vy
    if not down:  # water brakes whoever rises: at most a period before the zone
        x, y, _ = inside(p.check, s.x + _AHEAD * s.vx, s.y + _AHEAD * s.vy, s.z)
        return _through(p, source, size, (x, y, column[2], column[3]), onward)[0]
    if speed2 < _STILL * _STILL:
        return _through(p, source, size, column, onward)[0]
    if w.vertical_mode == 0.0:  # the law slows down before the surface by itself
        for lead in _LEADS:
            x, y, _ = inside(p.check, s.x + lead * s.vx, s.y + lead * s.vy, s.z)
            grown = _through(p, source, size, (x, y, column[2], column[3]), onward)[0]
            if grown > size:
                return grown
        return size
    if speed2 > _SLOW * _SLOW:
        return size
    low, high = -_LEAD, _LEAD
    for _ in range(_BISECTIONS):
        lead = 0.5 * (low + high)
        x, y, _ = inside(p.check, s.x + lead * s.vx, s.y + lead * s.vy, s.z)
        grown, sway = _through(p, source, size, (x, y, column[2], column[3]), onward)
        if grown > size:
            return grown
        on = s.vx * sway[0] + s.vy * sway[1]
        if on == 0.0:  # something else was in the way
            break
        low, high = (low, lead) if on > 0.0 else (lead, high)
    return size


@routine
def _settle(p, source, size, brake, onward, limit):
    """Append edges that brake before the zone until the vehicle is seen to keep its rule, and the way through it.

    Args:
        p: `Planner`.
        source: open node.
        size: nodes in use.
        brake: reference (x, y, z, psi).
        onward: `Point` to go to beyond the zone.
        limit: s.

    Returns the new size, or the old one if that fails.
    """
    first, current = size, source
    column = (brake[0], brake[1], AIR_GATE if is_air(brake[2]) else -WATER_GATE, brake[3])
    for _ in range(max(1, int(limit / p.check.period))):
        if size >= p.path.size - 1:
            break
        ended, flown, _ = zone_edge(p, current, size, brake, p.margin)
        if ended == BLOCKED or flown.crossings > 0.0:
            break
        adopt(p, current, size, OPEN if ended == ARRIVED else SETTLING, ended, flown)
        current = size
        size += 1
        if ended == ARRIVED:
            return size
        grown = _enter(p, current, size, column, onward)
        if grown > size:
            return grown
    return first


@routine
def cross(p, source, size, sample):
    """Append a whole crossing from open node `source`; return the new size, or the old one if it fails."""
    s, down = node_state(p, source), is_air(node_state(p, source).z)
    column = column_from(p, s, sample)
    away = 1.0 if down else _BLOWN
    if not column_is_free(p, column[0], column[1], down) or near_walls(p.check, column[0], column[1], away):
        return size
    if p.objective.paper > 0.0:
        return cross_as_printed(p, source, size, column)
    onward = _onward(p, column, sample)
    if not down:  # swim on while rising
        x, y, _, psi = water_reference(p, pointer(p.nodes[source]), onward)
        grown = _settle(p, source, size, (x, y, -_RISING, psi), onward, p.check.period)
        if grown > size:
            return grown
    grown = _enter(p, source, size, column, onward)
    if grown > size:
        return grown
    if down:
        old = view(pointer(p.nodes[source]), REFERENCE, Pose)
        for height in _BRAKE_HEIGHTS:
            for share in _BRAKE_SHARES:
                x = share * old.x + (1.0 - share) * (s.x + _BRAKE_LEAD * s.vx)
                y = share * old.y + (1.0 - share) * (s.y + _BRAKE_LEAD * s.vy)
                x, y, _ = inside(p.check, x, y, height)
                brake = x, y, height, column[3]
                grown = _settle(p, source, size, brake, onward, _BRAKE)
                if grown > size:
                    return grown
    return _settle(p, source, size, column, onward, SETTLE_LIMIT)
