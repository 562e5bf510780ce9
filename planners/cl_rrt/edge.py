"""One edge: the simulation kernel over one period, from a node to a slot."""

import numpy as np

from hydrone_gym._jit import inlined, routine
from hydrone_gym._memory import pointer
from hydrone_gym.simulation.outcome import GOAL, RUNNING
from hydrone_gym.simulation.rollout import propagate, propagate_watched
from planners.check import keeps_room, single
from planners.cl_rrt.objective import cost_to_go
from planners.cl_rrt.tree import OPEN, node_state

# How an edge ended
BLOCKED = 0
FREE = 1
ARRIVED = 2

SMOOTH = 0.9  # share of a rough crossing's speed and tilt, where motion in the zone need not be vertical


@inlined
def _judged(p, end, flown, margin):
    """Return how an edge to a vessel ended: BLOCKED, FREE or ARRIVED."""
    w, o, vertical = p.check.world, p.settings, p.check.world.vertical_mode > 0.0
    fast = flown.lateral_speed > (o.crossing_speed if vertical else SMOOTH * w.rough_speed)
    level = o.crossing_cos_tilt if vertical else 1.0 - SMOOTH * SMOOTH * (1.0 - w.rough_cos_tilt)
    if flown.clearance < margin or fast or flown.cos_tilt < level or not keeps_room(p.check, end):
        return BLOCKED
    if flown.outcome == GOAL:
        return ARRIVED
    return FREE if flown.outcome == RUNNING else BLOCKED


@routine
def edge(p, source, slot, reference, margin):
    """Propagate node `source` over one period toward a reference and write the end to `slot`.

    References are rounded to single precision first, the precision of the action space, so that the environment gets
    the very numbers that were checked.

    Returns (BLOCKED, FREE or ARRIVED, the `Result`). BLOCKED: an obstacle within `margin` m, a wall, a crossing that is
    not smoother than one that counts as rough, or divergence.
    """
    p.edges[0] += 1.0
    start, end = pointer(p.nodes[source]), pointer(p.nodes[slot])
    rounded = single(reference[0], reference[1], reference[2], reference[3])
    flown = propagate(p.check.lane, start, end, p.check.goal, rounded)
    return _judged(p, end, flown, margin), flown


@routine
def zone_edge(p, source, slot, reference, margin):
    """Do what `edge` does, and be BLOCKED also by a breach of the rule of the zone, where the world has it.

    That is more lateral speed inside the transition zone than a planned crossing may have. Returns as third the
    lateral velocity through the water (x, y in m/s) where it was greatest inside the zone.
    """
    p.edges[0] += 1.0
    start, end = pointer(p.nodes[source]), pointer(p.nodes[slot])
    rounded = single(reference[0], reference[1], reference[2], reference[3])
    world, limit = p.check.world, p.settings.crossing_speed
    flown, sway = propagate_watched(p.check.lane, start, end, p.check.goal, rounded, world.zone)
    fast = world.vertical_mode > 0.0 and sway[0] * sway[0] + sway[1] * sway[1] > limit * limit
    return BLOCKED if fast else _judged(p, end, flown, margin), flown, sway


@inlined
def adopt(p, parent, slot, kind, ended, flown):
    """Make the end of an edge, in `slot`, a node of the tree; `ended` and `flown` are what `edge` returned.

    Inside a crossing the next slot follows it.
    """
    node, before = p.nodes[slot], p.nodes[parent]
    s, a = node_state(p, slot), node_state(p, parent)
    node.parent, node.next, node.kind = parent, -1 if kind == OPEN else slot + 1, kind
    node.dead, node.unsafe, node.tried = 0, 0, 0
    node.goal = 1 if ended == ARRIVED else 0
    dx, dy, dz = s.x - a.x, s.y - a.y, s.z - a.z
    length, o = np.sqrt(dx * dx + dy * dy + dz * dz), p.objective
    spent = o.per_second * flown.seconds + o.per_joule * flown.energy + o.per_metre * length
    node.time = before.time + flown.seconds
    node.cost = before.cost + spent
    node.to_go = 0.0 if ended == ARRIVED else left_to_go(p, s)


@inlined
def left_to_go(p, s):
    """Cost from a place (with x, y, z in m) to the goal in an empty world."""
    goal = p.check.goal
    return cost_to_go(s.x, s.y, s.z, goal.x, goal.y, goal.z, p.objective)
