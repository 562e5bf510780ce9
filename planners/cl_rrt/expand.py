"""Algorithm 1: expand the tree."""

from typing import NamedTuple

import numpy as np

from hydrone_gym._jit import inlined, routine
from hydrone_gym.physics.trigonometry import sincos
from hydrone_gym.surface import is_air
from planners.check import AIR_GATE, WATER_GATE
from planners.cl_rrt.edge import left_to_go
from planners.cl_rrt.extend import extend, in_sight
from planners.cl_rrt.objective import cost_to_go
from planners.cl_rrt.tree import OPEN, node_state

DRAWS = 6  # uniform numbers a sample
# How far afield samples are sought
STRAIGHT_ON = 0
CAREFUL = 1  # also short steps around the vehicle
ANY_MEDIUM = 2  # also crossings that the mission does not need: the way out of a pocket may lead through them
# Kinds of samples
GOAL_SAMPLE = 0
COLUMN_SAMPLE = 1
CAREFUL_SAMPLE = 2  # near the root, with short steps
POINT_SAMPLE = 3
_ENOUGH = 800  # edges of a cycle in weather, where each takes 20 us; with half of them exits fail more often
EDGE_TIME = 0.5  # s of an edge, by which limits are counted: shorter periods take more edges to go as far
_GOAL_EXTENSION = 60  # such edges: a try at the goal may go all the way
_AROUND = 4.0  # m: most samples lie in the box of root and goal, widened by this
_AROUND_SHARE = 0.7
_ROAM_HEIGHT = 1.5  # m
_NEAR = 2.0  # m
_CAREFUL_SHARE = 0.3  # of the usual step: slow enough to leave a gap that is hardly wider than the vehicle
_OPTIMISM = 0.7  # the cost-to-go allows for turns and stops; this share of it bounds from below what a path may cost
_MEASURED = 0.97  # the same where joules count: that cost-to-go allows for nothing
_MEETING_SHARE = 0.5  # of the columns
_WALL = 0.5  # m: samples keep this far from the walls
_ASTRAY = 0.3  # m: a vehicle stops not quite where a column was drawn


class Sample(NamedTuple):
    """What to grow toward."""

    x: float  # m
    y: float
    z: float
    air: bool  # whether it is reached from air
    kind: int  # `GOAL_SAMPLE`, `COLUMN_SAMPLE`, `CAREFUL_SAMPLE` or `POINT_SAMPLE`


@inlined
def between(u, low, high):
    """Map a uniform number to an interval."""
    return low + u * (high - low)


@inlined
def draw_point(p, draws, k, air):
    """Sample a point of one medium outside the zone, mostly around root and goal (Alg. 1, line 1)."""
    w, root, goal = p.check.world, node_state(p, 0), p.check.goal
    near = draws[k + 2] < _AROUND_SHARE
    x_low = max(w.x_min + _WALL, min(root.x, goal.x) - _AROUND) if near else w.x_min + _WALL
    x_high = min(w.x_max - _WALL, max(root.x, goal.x) + _AROUND) if near else w.x_max - _WALL
    y_low = max(w.y_min + _WALL, min(root.y, goal.y) - _AROUND) if near else w.y_min + _WALL
    y_high = min(w.y_max - _WALL, max(root.y, goal.y) + _AROUND) if near else w.y_max - _WALL
    x = between(draws[k + 3], x_low, x_high)
    y = between(draws[k + 4], y_low, y_high)
    z = between(draws[k + 5], AIR_GATE, w.z_max - _WALL) if air else between(draws[k + 5], w.z_min + _WALL, -WATER_GATE)
    return x, y, z


@inlined
def draw_near(p, draws, k):
    """Sample a point around the root, in its medium: for the way out of a narrow place."""
    root = node_state(p, 0)
    x = root.x + between(draws[k + 3], -_NEAR, _NEAR)
    y = root.y + between(draws[k + 4], -_NEAR, _NEAR)
    z = root.z + between(draws[k + 5], -_NEAR, _NEAR)
    return x, y, max(z, AIR_GATE) if is_air(root.z) else min(z, -WATER_GATE)


@inlined
def draw_column(p, draws, k, roam):
    """Sample a crossing column near the water-side end, where joules count along the whole way; roaming, at the root.

    The point lies just beyond the surface.
    """
    w, root, goal = p.check.world, node_state(p, 0), p.check.goal
    from_air = is_air(root.z)
    at_goal = from_air and roam != ANY_MEDIUM
    cx = goal.x if at_goal else root.x
    cy = goal.y if at_goal else root.y
    share, angle = draws[k + 4], between(draws[k + 3], -np.pi, np.pi)
    if p.objective.per_joule > 0.0 and roam != ANY_MEDIUM:
        cx, cy = between(draws[k + 5], root.x, goal.x), between(draws[k + 5], root.y, goal.y)
        sine, cosine = sincos(angle)
        radius = p.settings.column_radius * share
    elif share < _MEETING_SHARE:  # where the swim takes as long as the dive, in the half that faces the other end
        dx, dy = root.x + goal.x - 2.0 * cx, root.y + goal.y - 2.0 * cy
        across, (s, c) = max(np.sqrt(dx * dx + dy * dy), 1e-9), sincos(0.5 * angle)
        cosine, sine = (dx * c - dy * s) / across, (dx * s + dy * c) / across
        depth = max(-WATER_GATE - min(root.z, goal.z), 0.0)
        speeds = p.objective.speeds
        # who need not be still in the zone runs on from the column
        most = 1.8 if from_air and w.vertical_mode == 0.0 else 1.1
        radius = speeds.water * depth / speeds.dive * between(share / _MEETING_SHARE, 0.7, most)
    else:
        sine, cosine = sincos(angle)
        radius = p.settings.column_radius * (share - _MEETING_SHARE) / (1.0 - _MEETING_SHARE)
    wall = max(_WALL, p.settings.drift + _ASTRAY) if p.settings.drift > 0.0 else _WALL
    x = min(max(cx + radius * cosine, w.x_min + wall), w.x_max - wall)
    y = min(max(cy + radius * sine, w.y_min + wall), w.y_max - wall)
    return x, y, -_ROAM_HEIGHT if from_air else _ROAM_HEIGHT


@inlined
def next_node(p, size, sample, by_cost, stamp):
    """Return the best untried open node for a sample, or -1: nearest, or least cost-to-come plus cost (sorted)."""
    best, least = -1, np.inf
    rate = p.objective.rates.air if sample.air else p.objective.rates.water
    for i in range(size):
        n = p.nodes[i]
        if n.dead or n.kind != OPEN or n.goal or p.path[i] == stamp:
            continue
        if sample.kind == GOAL_SAMPLE:
            if n.tried:
                continue
            score = n.to_go + (n.cost if by_cost else 0.0)
        else:
            s = node_state(p, i)
            if is_air(s.z) != sample.air:
                continue
            dx, dy, dz = s.x - sample.x, s.y - sample.y, s.z - sample.z
            score = np.sqrt(dx * dx + dy * dy + dz * dz) / rate + (n.cost if by_cost else 0.0)
        if score < least:
            best, least = i, score
    return best


@inlined
def least_cost(p, size):
    """Return the least cost of a node at the goal, infinite if there is none."""
    least = np.inf
    for i in range(size):
        if p.nodes[i].goal and not p.nodes[i].dead:
            least = min(least, p.nodes[i].cost)
    return least


@inlined
def any_beyond(p, size):
    """Whether the tree has an open node in the goal's medium."""
    found, air = False, is_air(p.check.goal.z)
    for i in range(size):
        n = p.nodes[i]
        found = found or (n.kind == OPEN and not n.dead and is_air(node_state(p, i).z) == air)
    return found


@inlined
def draw_sample(p, draws, k, roam, onward):
    """Draw a `Sample` (Alg. 1, line 1). `onward`: the goal's medium is reached, the goal is not, so most go there."""
    goal, root_air = p.check.goal, is_air(node_state(p, 0).z)
    goal_air, paper = is_air(goal.z), p.objective.paper > 0.0
    change = roam == ANY_MEDIUM or root_air != goal_air
    if draws[k] < p.settings.goal_bias:
        return Sample(goal.x, goal.y, goal.z, goal_air, GOAL_SAMPLE)
    columns = change and (roam == ANY_MEDIUM or not paper) and not (onward and draws[k + 2] < 0.5)
    if columns and draws[k] < p.settings.goal_bias + p.settings.column_bias:
        x, y, z = draw_column(p, draws, k, roam)
        return Sample(x, y, z, not is_air(z), COLUMN_SAMPLE)
    if roam != STRAIGHT_ON and draws[k + 2] < 0.5:
        x, y, z = draw_near(p, draws, k)
        return Sample(x, y, z, root_air, CAREFUL_SAMPLE)
    # whether this draw lies below a half also tells how nodes are sorted, but for the paper's rule, which never sorts
    coin = draws[k + 1] if paper else draws[k + 1] * 2.0 % 1.0
    air = coin < 0.5 if change and not onward else goal_air
    x, y, z = draw_point(p, draws, k, air)
    # as printed, a sample in the other medium is reached through the surface where the line meets it
    return Sample(x, y, z, root_air if paper else air, POINT_SAMPLE)


@inlined
def worth_trying(p, i, sample, best):
    """Whether an extension of node i toward a sample could beat the best path, and is not seen to be blocked."""
    s, o = node_state(p, i), p.objective
    via = cost_to_go(s.x, s.y, s.z, sample.x, sample.y, sample.z, o) + left_to_go(p, sample)
    via *= _OPTIMISM if o.per_joule == 0.0 else _MEASURED
    if p.settings.prune > 0.0 and p.nodes[i].cost + via >= best:
        return False
    seek = sample.kind <= COLUMN_SAMPLE and not o.paper > 0.0
    return not seek or in_sight(p, i, sample)


@routine
def expand_tree(p, size, draws, iterations, roam):
    """Expand the tree by a number of samples (Alg. 1); return its new size.

    Args:
        p: `Planner`.
        size: nodes in use.
        draws: (iterations * DRAWS,) uniform numbers.
        iterations: samples.
        roam: `STRAIGHT_ON`, `CAREFUL` or `ANY_MEDIUM`, the more the longer the vehicle has waited for a path.
    """
    for i in range(p.path.size):
        p.path[i] = -1
    goal_air, paper = is_air(p.check.goal.z), p.objective.paper > 0.0
    best, beyond = least_cost(p, size), any_beyond(p, size)
    for iteration in range(iterations):
        if p.check.lane.weathered > 0 and p.edges[0] > _ENOUGH:
            break
        k = iteration * DRAWS
        sample = draw_sample(p, draws, k, roam, beyond and best == np.inf and not paper)
        by_cost = draws[k + 1] < 0.5 and not paper
        step = _CAREFUL_SHARE * p.settings.step if sample.kind == CAREFUL_SAMPLE else p.settings.step
        far = sample.kind == GOAL_SAMPLE or (sample.kind == COLUMN_SAMPLE and not paper)
        limit = _GOAL_EXTENSION if far else int(p.settings.extension)
        limit = int(limit * EDGE_TIME / p.check.period)
        for _ in range(int(p.settings.tries)):
            i = next_node(p, size, sample, by_cost, iteration)
            if i < 0:
                break
            p.path[i] = iteration
            p.nodes[i].tried = 1 if sample.kind == GOAL_SAMPLE else p.nodes[i].tried
            if not worth_trying(p, i, sample, best):
                continue
            grown = extend(p, i, size, sample, limit, step)
            if grown > size:
                if sample.kind == GOAL_SAMPLE and p.objective.per_joule > 0.0:  # from these it would go the same way
                    for j in range(size, grown):
                        p.nodes[j].tried = 1
                size = grown
                end = p.nodes[size - 1]
                best = min(best, end.cost) if end.goal else best
                beyond = beyond or is_air(node_state(p, size - 1).z) == goal_air
                break
    return size
