"""The extension of a node toward a sample: edges of one period, and a crossing where the media differ."""

import numpy as np

from hydrone_gym._jit import inlined, routine
from hydrone_gym.simulation.advance import TICK
from hydrone_gym.simulation.model import unpack_model
from hydrone_gym.simulation.time_to_go import cruise_speeds
from planners.cl_rrt.clearance import clearance_between
from planners.cl_rrt.crossing import column_is_free, cross, facing
from planners.cl_rrt.edge import ARRIVED, BLOCKED, adopt, edge
from planners.cl_rrt.references import AIR_GATE, WATER_GATE, air_reference, water_reference
from planners.cl_rrt.tree import OPEN

_AIR_REACHED = 0.4  # m
_WATER_REACHED = 0.5  # m: more than the hold radius


@inlined
def in_sight(work, node, x, y, z, radius, margin):
    """Whether the straight way from a node to a point, through the column above or below it, clears what is known.

    A line costs a hundredth of the edges along it, so tries that would end at an obstacle are not begun.
    """
    s = node.state
    air = s[2] > 0.0
    if air == (z > 0.0):
        return clearance_between(work, s, (x, y, z), 0, radius) >= margin
    gate = AIR_GATE if air else -WATER_GATE
    return clearance_between(work, s, (x, y, gate), 0, radius) >= margin and column_is_free(work, x, y, radius, margin)


@routine
def extend(work, values, goal, source, size, x, y, z, limit, step, objective, margin, ticks):
    """Connect a node to a sample by edges of one period, crossing if the media differ (Alg. 1, lines 3-17).

    Returns the new size. Nodes of an extension that runs into something are kept and marked unsafe.
    """
    model = unpack_model(values)
    speeds = cruise_speeds(model)
    period = ticks * TICK
    current, first = source, size
    for _ in range(limit):
        if size >= work.path.size - 1:
            break
        node = work.nodes[current]
        air = node.state[2] > 0.0
        change = air != (z > 0.0)
        aim_z = (AIR_GATE if air else -WATER_GATE) if change else z
        aim_x, aim_y = x, y
        if change and objective.paper > 0.0:
            share = (node.state[2] - aim_z) / (node.state[2] - z)
            aim_x = node.state[0] + share * (x - node.state[0])
            aim_y = node.state[1] + share * (y - node.state[1])
        dx, dy, dz = aim_x - node.state[0], aim_y - node.state[1], aim_z - node.state[2]
        across2 = dx * dx + dy * dy
        if change:
            speed = np.sqrt(node.state[6] * node.state[6] + node.state[7] * node.state[7])
            near = (0.3 + 0.45 * speed) if air else _WATER_REACHED
            if across2 < near * near and abs(dz) < 0.7:
                grown = cross(work, values, goal, current, size, x, y, objective, margin, ticks)
                if grown == size:
                    break
                size = grown
                current = size - 1
                if work.nodes[current].goal:
                    break
                continue
        else:
            near = _AIR_REACHED if air else _WATER_REACHED
            if across2 + dz * dz < near * near:
                break
        if air:
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
