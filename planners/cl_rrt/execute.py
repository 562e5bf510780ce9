"""Algorithm 2: one cycle of the execution loop.

Take in what was sensed, expand, choose the best path, re-propagate it, verify that its first edge can be followed by
a stop, send it; prune and choose again where that fails; else go on with the stop that was verified before.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import inlined, kernel
from hydrone_gym._memory import pointer, scatter, view
from hydrone_gym.control.envelope import Envelope
from hydrone_gym.simulation.clock import TICK
from hydrone_gym.simulation.rollout import lane_of
from hydrone_gym.simulation.storage import Point, Pose, vehicle_of, world_of
from hydrone_gym.surface import is_air
from planners.check import (
    LEAST_MARGIN,
    OF_DRIFT,
    Check,
    clearance_left,
    copy_vessel,
    from_walls,
    near_walls,
    place_of,
    reference_of,
    sensed,
    state_of,
)
from planners.cl_rrt.edge import BLOCKED, adopt, edge, left_to_go
from planners.cl_rrt.expand import expand_tree
from planners.cl_rrt.objective import ObjectiveParams
from planners.cl_rrt.settings import SettingParams
from planners.cl_rrt.tree import BACKUP, CROSSING, OPEN, ROOT, Planner, node_state, prune_orphans, reroot
from planners.clearance import clearance_between
from planners.hold import dips, goes_on
from planners.stop_check import can_hover, follow
from planners.tube import NO_TUBE

_BEND = 0.1  # m: how far an edge may leave its chord
_CARRIED_TO = 0.85  # of the distance that crossings keep from walls is enough to begin one that was planned
_AT_GOAL = 1e9  # any path that arrives is better than any that does not
_DETOUR = 0.05  # share of the cost-to-come that tells apart branches that end equally near
_FULL = 0.8  # share of the tree's capacity


class Constants(NamedTuple):
    """What a planner is made with: packed `Envelope`, `SettingParams`, `ObjectiveParams`, and its tube."""

    envelope: NDArray[np.float64]
    settings: NDArray[np.float64]
    objective: NDArray[np.float64]
    tube: NDArray[np.float64] = NO_TUBE  # (3, TUBE_LENGTH) m, by place of the look and time since


class Query(NamedTuple):
    """What one cycle is asked."""

    start: NDArray[np.float64]  # (VESSEL,) vehicle and reference in force where the first edge begins
    goal: NDArray[np.float64]  # (3,) m
    eye: NDArray[np.float64]  # (3,) where the obstacles were last sensed from, m
    draws: NDArray[np.float64]  # uniform numbers for `expand_tree`
    size: int  # nodes in use
    root: int  # predicted node to root the tree at, -1 to begin a new tree
    known_before: int  # obstacles the tree was grown with
    held: NDArray[np.float64]  # (4,) reference of the backup that is next
    holds: bool  # whether that is its last, a hover, which may not be safe for ever
    roam: int  # see `expand_tree`
    iterations: int  # samples to grow by
    begin: bool  # whether this part of a cycle takes in the observation
    finish: bool  # and whether it chooses
    since: float = 0.0  # s from the look to where the first edge begins


@inlined
def take_root(p, query):
    """Root the tree where the vehicle is: at the predicted node if there is one, with the observed state in it."""
    size = 1
    n = p.nodes[0]
    if query.root >= 0 and query.root < query.size:
        size = reroot(p.nodes, query.size, query.root, p.path)
    else:
        n.parent, n.next, n.kind, n.goal = -1, -1, OPEN, 0
    copy_vessel(pointer(query.start), pointer(n))
    n.time, n.cost, n.unsafe, n.tried, n.dead = 0.0, 0.0, 0, 0, 0
    n.to_go = left_to_go(p, node_state(p, 0))
    return size


@inlined
def prune_blocked(p, size, known_before):
    """Kill the edges that obstacles detected since the last cycle stand in the way of (Alg. 2, line 16)."""
    if known_before >= p.check.lane.number:
        return
    for i in range(1, size):
        a, b = node_state(p, p.nodes[i].parent), node_state(p, i)
        near = clearance_between((a.x, a.y, a.z), (b.x, b.y, b.z), p.check.lane, known_before, p.check.radius)
        entering = p.nodes[i].kind == CROSSING and not is_air(p.check.goal.z)
        if near < p.margin - _BEND + (OF_DRIFT * p.settings.drift if entering else 0.0):
            p.nodes[i].dead = 1
    prune_orphans(p, size)


@inlined
def best_node(p, size):
    """Return the end of the best path: least cost at the goal, else least cost-to-go among safe nodes; -1 if none."""
    best, least = -1, np.inf
    fallback, fallback_least = -1, np.inf
    for i in range(1, size):
        n = p.nodes[i]
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
def trim(p, size):
    """Cut a tree that has filled up back to its best path, so that it can grow again; return its size."""
    end = best_node(p, size)
    for i in range(1, size):
        p.nodes[i].dead = 1
    while end > 0:
        p.nodes[end].dead = 0
        end = p.nodes[end].parent
    return reroot(p.nodes, size, ROOT, p.path)


@inlined
def first_of(p, end):
    """Return the first node of the path to node `end`."""
    while p.nodes[end].parent > 0:
        end = p.nodes[end].parent
    return end


@inlined
def re_propagate(p, end):
    """Propagate the path to node `end` again from the root; return its first node, or minus the node that fails."""
    depth = 0
    i = end
    while i > 0:
        p.path[depth] = i
        depth += 1
        i = p.nodes[i].parent
    for k in range(depth - 1, -1, -1):
        i = p.path[k]
        n = p.nodes[i]
        may_cross = n.kind == CROSSING or p.nodes[n.parent].kind == CROSSING
        kept_next, kept_unsafe, kept_tried = n.next, n.unsafe, n.tried
        # edges were grown with the full margin; half of it allows for obstacles seen since
        ended, flown = edge(p, n.parent, i, reference_of(pointer(n)), 0.5 * p.margin)
        if ended == BLOCKED or (flown.crossings > 0.0 and not may_cross):
            return -i
        if n.parent == ROOT and n.kind == CROSSING and p.nodes[ROOT].kind != CROSSING:
            s = node_state(p, ROOT)
            if near_walls(p.check, s.x, s.y, _CARRIED_TO):
                return -i
        adopt(p, n.parent, i, n.kind, ended, flown)
        n.next, n.unsafe, n.tried = kept_next, kept_unsafe, kept_tried
    return p.path[depth - 1]


@inlined
def back_up(p, slot, reference):
    """Write a reference (x, y, z, psi) to the backup."""
    scatter(pointer(p.backup), 4 * slot, 0, 1, Pose(reference[0], reference[1], reference[2], reference[3]))


@inlined
def verify_stop(p, first):
    """Check that node `first` can be followed to rest in known free space; write the references to the backup.

    The stop is a hover on the side of the surface where the vehicle is; inside a crossing, where that is not safe, as
    much of the crossing as it takes until a hover is. In weather a crossing that has begun goes on wherever it can:
    who turns back is carried about at the surface.
    Returns the number of references, 0 if the stop fails. With `settings.verify` off every edge passes and is its own
    stop.
    """
    vessel = pointer(p.nodes[first])
    if p.settings.verify == 0.0:
        back_up(p, 0, reference_of(vessel))
        return 1
    if not sensed(p.check, vessel):
        return 0
    if p.nodes[first].goal:
        return 1
    end = pointer(p.nodes[p.nodes.size - 1])
    copy_vessel(vessel, end)
    after = p.check.period
    stays, back = can_hover(p.check, end, after)
    node, count, safe, hover = first, 0, stays and p.check.lane.weathered == 0, back
    while not safe and p.nodes[node].kind == CROSSING:
        node = p.nodes[node].next
        if node < 0 or count >= BACKUP - 1:  # what comes after it was pruned
            break
        reference = reference_of(pointer(p.nodes[node]))
        on, _, _ = follow(p.check, end, end, reference, after)
        if not on:
            break
        back_up(p, count, reference)
        count += 1
        after += p.check.period
        safe, hover = can_hover(p.check, end, after)
    if not safe and stays:
        count, safe, hover = 0, True, dips(p.check, vessel, back) if p.nodes[first].kind == CROSSING else back
    back_up(p, count, hover)
    return count + 1 if safe else 0


@inlined
def choose(p, size):
    """Choose, re-propagate and verify until a path's first edge may be sent (Alg. 2, lines 10-18).

    Returns (first node of the path or -1, length of its backup, end of the path).
    """
    for _ in range(size):
        end = best_node(p, size)
        if end < 0:
            break
        first = re_propagate(p, end) if p.settings.re_propagate > 0.0 else first_of(p, end)
        if first < 0:
            p.nodes[-first].dead = 1
            prune_orphans(p, size)
            continue
        stop = verify_stop(p, first)
        if stop > 0:
            return first, stop, end
        p.nodes[first].dead = 1
        prune_orphans(p, size)
    return -1, 0, -1


@inlined
def planner_of(work, query, constants):
    """Gather what a cycle works with; the margins are those that the vehicle has room for where it is."""
    lane = lane_of(work.rollout)
    world, radius = world_of(lane.values), vehicle_of(lane.values).radius
    settings = view(constants.settings, 0, SettingParams)
    vessel = pointer(query.start)
    left = clearance_left(vessel, lane, radius)
    check = Check(
        lane,
        view(query.goal, 0, Point),
        view(query.eye, 0, Point),
        world,
        view(constants.envelope, 0, Envelope),
        radius,
        min(settings.margin, settings.rest_margin),
        left,
        settings.room,
        from_walls(world, state_of(vessel)),
        settings.drift,
        pointer(constants.tube[place_of(state_of(vessel).z)]),
        query.since,
        lane.ticks * TICK,
        pointer(work.scratch),
    )
    objective = view(constants.objective, 0, ObjectiveParams)
    margin = max(min(settings.margin, left), LEAST_MARGIN)
    return Planner(work.nodes, work.path, work.backup, work.edges, check, settings, objective, margin)


@kernel
def cycle(work, query, constants):
    """Run one cycle, or a part of one.

    Args:
        work: `Workspace`; changed in place.
        query: `Query`.
        constants: `Constants`.

    Returns:
        (size, first, stop, end): nodes in use, the node to send (-1: use the backup), references in its backup, and
        the node its path ends at.
    """
    p = planner_of(work, query, constants)
    size = query.size
    if query.begin:
        size = take_root(p, query)
        prune_blocked(p, size, query.known_before)
        size = trim(p, size) if size > _FULL * p.path.size else size
    size = expand_tree(p, size, query.draws, query.iterations, query.roam)
    if not query.finish:
        return size, -1, 0, -1
    first, stop, end = choose(p, size)
    if first < 0 and query.holds:
        held = (query.held[0], query.held[1], query.held[2], query.held[3])
        back_up(p, 0, goes_on(p.check, pointer(query.start), held)[1])
    return size, first, stop, end
