"""One edge: the simulation kernel over one period, from a node to a slot."""

import numpy as np

from hydrone_gym._jit import inlined, routine
from hydrone_gym.simulation.advance import TICK, advance
from hydrone_gym.simulation.model import unpack_model
from hydrone_gym.simulation.outcome import GOAL, RUNNING
from hydrone_gym.simulation.rows import load_vehicle, store_vehicle
from planners.cl_rrt.objective import cost_to_go

# How an edge ended
BLOCKED = 0
FREE = 1
ARRIVED = 2

CROSSING_SPEED = 0.1  # m/s: a planned crossing is smoother than the one that counts as rough
CROSSING_COS_TILT = np.cos(np.radians(2.0))


@routine
def edge(work, values, goal, source, slot, rx, ry, rz, psi, margin, ticks):
    """Propagate node `source` over one period toward a reference and write the end to `slot`.

    References are rounded to single precision first, the precision of the action space, so that the environment gets
    the very numbers that were checked.

    Returns (BLOCKED, FREE or ARRIVED, whether the surface was passed). BLOCKED: an obstacle within `margin` m, the
    bounds, a rough crossing, or divergence.
    """
    model = unpack_model(values)
    work.edges[0] += 1
    b = work.block[0]
    start, end = work.nodes[source], work.nodes[slot]
    rx, ry, rz, psi = float(np.float32(rx)), float(np.float32(ry)), float(np.float32(rz)), float(np.float32(psi))
    load_vehicle(b, 0, start.state, start.integral, start.reference, (rx, ry, rz, psi))
    b.goal_x[0], b.goal_y[0], b.goal_z[0] = goal[0], goal[1], goal[2]
    b.ticks[0], b.energy[0], b.clearance[0], b.outcome[0], b.crossings[0] = 0.0, 0.0, np.inf, 0.0, 0.0
    count = work.closest.size
    advance(work.block, work.log, work.obstacles, work.closest, count, model, 0, ticks, ticks)
    store_vehicle(b, 0, end.state, end.integral)
    end.reference[0], end.reference[1], end.reference[2], end.reference[3] = rx, ry, rz, psi
    crossed = b.crossings[0] > 0.0
    if b.clearance[0] < margin:
        return BLOCKED, crossed
    for slot_index in range(min(int(b.crossings[0]), work.log.shape[1])):
        tilt_cosine = np.cos(work.log[0, slot_index, 3])
        if work.log[0, slot_index, 2] > CROSSING_SPEED or tilt_cosine < CROSSING_COS_TILT:
            return BLOCKED, crossed
    if b.outcome[0] == GOAL:
        return ARRIVED, crossed
    return FREE if b.outcome[0] == RUNNING else BLOCKED, crossed


@inlined
def adopt(work, goal, objective, parent, slot, kind, arrived):
    """Make the end of the edge propagated last, in `slot`, a node of the tree."""
    node, b = work.nodes[slot], work.block[0]
    before = work.nodes[parent]
    s = node.state
    node.parent, node.next, node.kind = parent, -1, kind
    node.dead, node.unsafe, node.tried = 0, 0, 0
    node.goal = 1 if arrived else 0
    dx, dy, dz = s[0] - before.state[0], s[1] - before.state[1], s[2] - before.state[2]
    length = np.sqrt(dx * dx + dy * dy + dz * dz)
    seconds = b.ticks[0] * TICK
    spent = objective.per_second * seconds + objective.per_joule * b.energy[0] + objective.per_metre * length
    node.time = before.time + seconds
    node.cost = before.cost + spent
    node.to_go = 0.0 if arrived else cost_to_go(s[0], s[1], s[2], goal[0], goal[1], goal[2], objective)
