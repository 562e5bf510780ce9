"""The extension of a node toward a sample: edges of one period, and a crossing where the media differ."""

import numpy as np

from hydrone_gym._jit import inlined, routine
from hydrone_gym._memory import pointer, view
from hydrone_gym.simulation.storage import REFERENCE, Point, Pose
from hydrone_gym.surface import is_air
from planners.check import AIR_GATE, WATER_GATE
from planners.cl_rrt.crossing import column_is_free, cross, heading_under
from planners.cl_rrt.edge import ARRIVED, BLOCKED, adopt, edge, zone_edge
from planners.cl_rrt.objective import crossing_point
from planners.cl_rrt.references import air_reference, water_reference
from planners.cl_rrt.tree import OPEN, node_state
from planners.clearance import clearance_between

_AIR_REACHED = 0.4  # m
_WATER_REACHED = 0.5  # m: more than the hold radius


@inlined
def aim_at(p, s, sample):
    """Return the `Point` to go to for a sample, and whether the surface lies between: then the gate before it."""
    change = is_air(s.z) != is_air(sample.z)
    gate = AIR_GATE if is_air(s.z) else -WATER_GATE
    if change and p.objective.paper > 0.0:  # where the line to the sample meets the gate
        share = (s.z - gate) / (s.z - sample.z)
        return Point(s.x + share * (sample.x - s.x), s.y + share * (sample.y - s.y), gate), change
    goal = p.check.goal
    if change and p.objective.per_joule > 0.0 and sample.x == goal.x and sample.y == goal.y:  # where that costs least
        x, y = crossing_point(s.x, s.y, s.z, sample.x, sample.y, sample.z, p.objective.rates)
        return Point(x, y, gate), change
    return Point(sample.x, sample.y, gate if change else sample.z), change


@inlined
def in_sight(p, i, sample):
    """Whether the straight way from a node to a point, through the column above or below it, clears what is known.

    A line costs a hundredth of the edges along it, so tries that would end at an obstacle are not begun.
    """
    s = node_state(p, i)
    aim, change = aim_at(p, s, sample)
    near = clearance_between((s.x, s.y, s.z), (aim.x, aim.y, aim.z), p.check.lane, 0, p.check.radius)
    return near >= p.margin and (not change or column_is_free(p, aim.x, aim.y, is_air(s.z)))


@inlined
def is_there(p, s, aim, change):
    """Whether a vehicle has come to the point it was sent to: near enough to cross there, or to end there."""
    dx, dy, dz = aim.x - s.x, aim.y - s.y, aim.z - s.z
    across2 = dx * dx + dy * dy
    if change:
        speed = np.sqrt(s.vx * s.vx + s.vy * s.vy)
        near = (0.3 + p.check.envelope.stop_time * speed) if is_air(s.z) else _WATER_REACHED
        return across2 < near * near and abs(dz) < 0.7
    near = _AIR_REACHED if is_air(s.z) else _WATER_REACHED
    return across2 + dz * dz < near * near


@inlined
def next_reference(p, i, aim, step):
    """Return where an edge from node i toward a point sends the reference (x, y, z, psi)."""
    vessel, goal = pointer(p.nodes[i]), p.check.goal
    if not is_air(node_state(p, i).z):
        return water_reference(p, vessel, aim)
    psi = view(vessel, REFERENCE, Pose).psi
    # a vehicle on its way to the water turns in the air, where it is free to
    psi = psi if is_air(goal.z) else heading_under(p, aim.x, aim.y, psi)
    return air_reference(p, vessel, aim, psi, step)


@routine
def extend(p, source, size, sample, limit, step):
    """Connect a node to a sample by edges of one period, crossing if the media differ (Alg. 1, lines 3-17).

    Returns the new size. Nodes of an extension that runs into something are kept and marked unsafe.
    """
    current, first, goal = source, size, p.check.goal
    sample = Point(sample.x, sample.y, sample.z)
    for _ in range(limit):
        if size >= p.path.size - 1:
            break
        s = node_state(p, current)
        aim, change = aim_at(p, s, sample)
        if is_there(p, s, aim, change):
            grown = cross(p, current, size, sample) if change else size
            if grown == size:
                break
            size = grown
            current = size - 1
            there = is_air(goal.z) == is_air(node_state(p, current).z)
            if there and p.objective.paper == 0.0 and p.objective.per_joule == 0.0:  # slow swims would fill the tree
                sample = Point(goal.x, goal.y, goal.z)  # what it was crossed for
            if p.nodes[current].goal:
                break
            continue
        reference = next_reference(p, current, aim, step)
        if p.objective.paper > 0.0:
            ended, flown = edge(p, current, size, reference, p.margin)
        else:
            ended, flown, _ = zone_edge(p, current, size, reference, p.margin)
        if ended == BLOCKED or flown.crossings > 0.0:
            for i in range(first, size):
                p.nodes[i].unsafe = 1
            p.nodes[source].unsafe = 1 if size == first else p.nodes[source].unsafe
            break
        adopt(p, current, size, OPEN, ended, flown)
        current = size
        size += 1
        if ended == ARRIVED:
            break
    return size
