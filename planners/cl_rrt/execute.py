"""Algorithm 2: one cycle of the execution loop.

Take in what was sensed, expand, choose the best path, re-propagate it, verify that its first edge can be followed by
a stop, send it; prune and choose again where that fails; else go on with the stop that was verified before.
"""

import numpy as np

from hydrone_gym._jit import inlined, kernel
from hydrone_gym.simulation.model import unpack_model
from planners.cl_rrt.edge import ARRIVED, BLOCKED, adopt, edge
from planners.cl_rrt.expand import expand_tree
from planners.cl_rrt.objective import cost_to_go
from planners.cl_rrt.references import hover_reference
from planners.cl_rrt.tree import BACKUP, CROSSING, OPEN, copy_node, prune_orphans, reroot
from planners.clearance import clearance_between

_BEND = 0.1  # m: how far an edge may leave its chord
_AT_GOAL = 1e9  # any path that arrives is better than any that does not
_DETOUR = 0.05  # share of the cost-to-come that tells apart branches that end equally near
_FULL = 0.8  # share of the tree's capacity
_GIVE = 0.02  # m: how much nearer than now an edge may come when the vehicle is within the margin
_LEAST_MARGIN = 0.005  # m
_DRIFT_TIME = 12.0  # s: sway is unactuated in water, so what is left of it at the end of a stop goes on for a while


@inlined
def take_root(work, size, goal, objective, now, root):
    """Root the tree where the vehicle is: at the predicted node if there is one, with the observed state in it."""
    if root >= 0 and root < size:
        size = reroot(work.nodes, size, root, work.path)
    else:
        size = 1
        work.nodes[0].parent, work.nodes[0].next, work.nodes[0].kind = -1, -1, OPEN
        work.nodes[0].dead, work.nodes[0].goal = 0, 0
    n = work.nodes[0]
    for c in range(12):
        n.state[c] = now[c]
    for c in range(4):
        n.integral[c] = now[12 + c]
        n.reference[c] = now[16 + c]
    n.time, n.cost, n.unsafe, n.tried, n.dead = 0.0, 0.0, 0, 0, 0
    n.to_go = cost_to_go(now[0], now[1], now[2], goal[0], goal[1], goal[2], objective)
    return size


@inlined
def prune_blocked(work, size, known_before, radius, margin):
    """Kill the edges that obstacles detected since the last cycle stand in the way of (Alg. 2, line 16)."""
    count = work.closest.size
    if known_before >= count:
        return
    for i in range(1, size):
        a, b = work.nodes[work.nodes[i].parent].state, work.nodes[i].state
        if clearance_between(a, b, work.obstacles, known_before, work.closest.size, radius) < margin - _BEND:
            work.nodes[i].dead = 1
    prune_orphans(work.nodes, size)


@inlined
def margin_here(work, radius, settings):
    """The margin edges keep this cycle: the full one, or what a vehicle already nearer to an obstacle has left.

    Without this a vehicle that drifted or stopped within the margin could never move again.
    """
    state = work.nodes[0].state
    left = clearance_between(state, state, work.obstacles, 0, work.closest.size, radius) - _GIVE
    return max(min(settings.margin, left), _LEAST_MARGIN)


@inlined
def best_node(work, size):
    """Return the end of the best path: least cost at the goal, else least cost-to-go among safe nodes; -1 if none."""
    best, least = -1, np.inf
    fallback, fallback_least = -1, np.inf
    for i in range(1, size):
        n = work.nodes[i]
        if n.dead:
            continue
        score = n.cost - _AT_GOAL if n.goal else n.to_go + _DETOUR * n.cost
        if n.unsafe and not n.goal:
            if score < fallback_least:
                fallback, fallback_least = i, score
        elif score < least:
            best, least = i, score
    return best if best >= 0 else fallback


@inlined
def trim(work, size):
    """Cut a tree that has filled up back to its best path, so that it can grow again; return its size."""
    end = best_node(work, size)
    for i in range(1, size):
        work.nodes[i].dead = 1
    while end > 0:
        work.nodes[end].dead = 0
        end = work.nodes[end].parent
    return reroot(work.nodes, size, 0, work.path)


@inlined
def first_of(work, end):
    """Return the first node of the path to node `end`."""
    while work.nodes[end].parent > 0:
        end = work.nodes[end].parent
    return end


@inlined
def re_propagate(work, values, goal, objective, end, margin, ticks):
    """Propagate the path to node `end` again from the root; return its first node, or minus the node that fails."""
    depth = 0
    i = end
    while i > 0:
        work.path[depth] = i
        depth += 1
        i = work.nodes[i].parent
    for k in range(depth - 1, -1, -1):
        i = work.path[k]
        n = work.nodes[i]
        r = n.reference
        may_cross = n.kind == CROSSING or work.nodes[n.parent].kind == CROSSING
        r0, r1, r2, r3 = r[0], r[1], r[2], r[3]
        kept_next, kept_unsafe, kept_tried = n.next, n.unsafe, n.tried
        # edges were grown with the full margin; half of it allows for obstacles seen since
        result, crossed = edge(work, values, goal, n.parent, i, r0, r1, r2, r3, 0.5 * margin, ticks)
        if result == BLOCKED or (crossed and not may_cross):
            return -i
        adopt(work, goal, objective, n.parent, i, n.kind, result == ARRIVED)
        n.next, n.unsafe, n.tried = kept_next, kept_unsafe, kept_tried
    return work.path[depth - 1]


@inlined
def sensed(work, slot, eye, reach):
    """Whether a node lies in space sensed from `eye` (3,): nothing unknown can be in the way there."""
    s = work.nodes[slot].state
    dx, dy, dz = s[0] - eye[0], s[1] - eye[1], s[2] - eye[2]
    return dx * dx + dy * dy + dz * dz <= reach * reach


@inlined
def verify_stop(work, values, goal, eye, first, settings, margin, ticks, model, scratch):
    """Check that node `first` can be followed to rest in known free space; write the references to `backup`.

    An open or settling node stops by hovering; inside a crossing the stop is the rest of the crossing, then hovering.
    The clearance kept is `margin` (m). Returns the number of references, 0 if the stop fails. With `settings.verify`
    off every edge passes and is its own stop.
    """
    reach = model.world.sensor_range - model.vehicle.radius
    if settings.verify == 0.0:
        for c in range(4):
            work.backup[0, c] = work.nodes[first].reference[c]
        return 1
    if not sensed(work, first, eye, reach):
        return 0
    if work.nodes[first].goal:
        return 1
    copy_node(work.nodes, first, scratch)
    node, count = first, 0
    while work.nodes[node].kind == CROSSING:
        node = work.nodes[node].next
        r = work.nodes[node].reference
        r0, r1, r2, r3 = r[0], r[1], r[2], r[3]
        result, _ = edge(work, values, goal, scratch, scratch, r0, r1, r2, r3, margin, ticks)
        if result == BLOCKED:
            return 0
        if not sensed(work, scratch, eye, reach) or count >= BACKUP - 1:
            return 0
        for c in range(4):
            work.backup[count, c] = work.nodes[scratch].reference[c]
        count += 1
    rx, ry, rz, psi = hover_reference(work.nodes[scratch], model)
    for _ in range(settings.look_ahead):
        result, crossed = edge(work, values, goal, scratch, scratch, rx, ry, rz, psi, margin, ticks)
        if result == BLOCKED or crossed or not sensed(work, scratch, eye, reach):
            return 0
        if result == ARRIVED:
            break
    end = work.nodes[scratch].state
    if end[2] < 0.0:
        drifted = (end[0] + _DRIFT_TIME * end[6], end[1] + _DRIFT_TIME * end[7], end[2])
        if clearance_between(end, drifted, work.obstacles, 0, work.closest.size, model.vehicle.radius) < margin:
            return 0
    for c in range(4):
        work.backup[count, c] = work.nodes[scratch].reference[c]
    return count + 1


@inlined
def choose(work, values, goal, eye, size, settings, objective, margin, ticks, model, scratch):
    """Choose, re-propagate and verify until a path's first edge may be sent (Alg. 2, lines 10-18).

    Returns (first node of the path or -1, length of its backup, end of the path).
    """
    for _ in range(size):
        end = best_node(work, size)
        if end < 0:
            break
        first = first_of(work, end)
        if settings.replay > 0.0:
            first = re_propagate(work, values, goal, objective, end, margin, ticks)
        if first < 0:
            work.nodes[-first].dead = 1
            prune_orphans(work.nodes, size)
            continue
        stop = verify_stop(
            work, values, goal, eye, first, settings, min(margin, settings.rest_margin), ticks, model, scratch
        )
        if stop > 0:
            return first, stop, end
        work.nodes[first].dead = 1
        prune_orphans(work.nodes, size)
    return -1, 0, -1


@kernel
def cycle(
    work,
    values,
    goal,
    now,
    eye,
    size,
    root,
    known_before,
    draws,
    iterations,
    settings,
    objective,
    roam,
    ticks,
    begin,
    finish,
):
    """Run one cycle, or a part of one.

    Args:
        work: `Workspace`; changed in place.
        values: packed `Model`.
        goal: (3,) m.
        now: (20,) state, controller memory and reference in force where the first edge begins.
        eye: (3,) where the obstacles were last sensed from, m.
        size: nodes in use.
        root: predicted node to root the tree at, -1 to begin a new tree.
        known_before: obstacles the tree was grown with.
        draws: uniform numbers for `expand_tree`.
        iterations: samples to grow by.
        settings: `SettingParams`.
        objective: `ObjectiveParams`.
        roam: see `expand_tree`.
        ticks: ticks a period.
        begin, finish: whether this part takes in the observation, and whether it chooses.

    Returns:
        (size, first, stop, end): nodes in use, the node to send (-1: use the backup), references in its backup, and
        the node its path ends at.
    """
    model = unpack_model(values)
    if begin:
        size = take_root(work, size, goal, objective, now, root)
    margin = margin_here(work, model.vehicle.radius, settings)
    if begin:
        prune_blocked(work, size, known_before, model.vehicle.radius, margin)
        size = trim(work, size) if size > _FULL * work.path.size else size
    size = expand_tree(work, values, goal, size, draws, iterations, settings, objective, margin, roam, ticks)
    first, stop, end = -1, 0, -1
    if finish:
        scratch = work.nodes.size - 1
        first, stop, end = choose(work, values, goal, eye, size, settings, objective, margin, ticks, model, scratch)
    return size, first, stop, end
