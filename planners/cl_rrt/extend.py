"""The extension of a node toward a sample: edges of one period, and a crossing where the media differ."""

import numpy as np

from hydrone_gym._jit import inlined, routine
from hydrone_gym.simulation.advance import TICK
from hydrone_gym.simulation.model import unpack_model
from planners.cl_rrt.crossing import STOP_TIME, column_is_free, cross, facing
from planners.cl_rrt.edge import ARRIVED, BLOCKED, adopt, edge
from planners.cl_rrt.references import AIR_GATE, WATER_GATE, air_reference, water_reference
from planners.cl_rrt.tree import OPEN
from planners.clearance import clearance_between

_AIR_REACHED = 0.4  # m
_WATER_REACHED = 0.5  # m: more than the hold radius


@inlined
def in_sight(work, node, x, y, z, radius, margin):
    """Whether the straight way from a node to a point, through the column above or below it, clears what is known.

    A line costs a hundredth of the edges along it, so tries that would end at an obstacle are not begun.
    """
    s = node.state
    change = (s[2] > 0.0) != (z > 0.0)
    gate = AIR_GATE if s[2] > 0.0 else -WATER_GATE
    point = (x, y, gate if change else z)
    near = clearance_between(s, point, work.obstacles, 0, work.closest.size, radius)
    return near >= margin and (not change or column_is_free(work, x, y, radius, margin))


@inlined
def aim_at(node, x, y, z, objective):
    """Return the point (m) to go to for a sample, and whether the surface lies between: then the gate before it."""
    s = node.state
    change = (s[2] > 0.0) != (z > 0.0)
    gate = AIR_GATE if s[2] > 0.0 else -WATER_GATE
    if change and objective.paper > 0.0:  # where the line to the sample meets the gate
        share = (s[2] - gate) / (s[2] - z)
        return s[0] + share * (x - s[0]), s[1] + share * (y - s[1]), gate, change
    return x, y, gate if change else z, change


@inlined
def is_there(node, x, y, z, change):
    """Whether a node has come to the point it was sent to: near enough to cross there, or to end there."""
    s = node.state
    air = s[2] > 0.0
    dx, dy, dz = x - s[0], y - s[1], z - s[2]
    across2 = dx * dx + dy * dy
    if change:
        speed = np.sqrt(s[6] * s[6] + s[7] * s[7])
        near = (0.3 + STOP_TIME * speed) if air else _WATER_REACHED
        return across2 < near * near and abs(dz) < 0.7
    near = _AIR_REACHED if air else _WATER_REACHED
    return across2 + dz * dz < near * near


@routine
def extend(work, values, goal, source, size, x, y, z, limit, step, objective, margin, ticks):
    """Connect a node to a sample by edges of one period, crossing if the media differ (Alg. 1, lines 3-17).

    Returns the new size. Nodes of an extension that runs into something are kept and marked unsafe.
    """
    model = unpack_model(values)
    speeds = objective.speeds
    period = ticks * TICK
    current, first = source, size
    for _ in range(limit):
        if size >= work.path.size - 1:
            break
        node = work.nodes[current]
        aim_x, aim_y, aim_z, change = aim_at(node, x, y, z, objective)
        if is_there(node, aim_x, aim_y, aim_z, change):
            grown = size
            if change:
                grown = cross(work, values, goal, current, size, x, y, objective, margin, ticks)
            if grown == size:
                break
            size = grown
            current = size - 1
            if work.nodes[current].goal:
                break
            continue
        if node.state[2] > 0.0:
            psi = facing(aim_x, aim_y, goal[0], goal[1], node.reference[3]) if goal[2] < 0.0 else node.reference[3]
            rx, ry, rz, psi = air_reference(node, aim_x, aim_y, aim_z, psi, model, step, period)
        else:
            rx, ry, rz, psi = water_reference(node, aim_x, aim_y, aim_z, speeds, model, period)
        result, crossed = edge(work, values, goal, current, size, rx, ry, rz, psi, margin, ticks)
        if result == BLOCKED or crossed:
            for i in range(first, size):
                work.nodes[i].unsafe = 1
            work.nodes[source].unsafe = 1 if size == first else work.nodes[source].unsafe
            break
        adopt(work, goal, objective, current, size, OPEN, result == ARRIVED)
        current = size
        size += 1
        if result == ARRIVED:
            break
    return size
