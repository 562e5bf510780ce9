"""Algorithm 1: expand the tree."""

import numpy as np

from hydrone_gym._jit import inlined, routine
from hydrone_gym.physics.trigonometry import sincos
from hydrone_gym.simulation.model import unpack_model
from planners.cl_rrt.extend import extend, in_sight
from planners.cl_rrt.objective import cost_to_go
from planners.cl_rrt.references import AIR_GATE, WATER_GATE
from planners.cl_rrt.tree import OPEN

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
_GOAL_EXTENSION = 60  # edges: a try at the goal may go all the way
_AROUND = 4.0  # m: most samples lie in the box of root and goal, widened by this
_AROUND_SHARE = 0.7
_ROAM_HEIGHT = 1.5  # m
_NEAR = 2.0  # m
_CAREFUL_SHARE = 0.3  # of the usual step: slow enough to leave a gap that is hardly wider than the vehicle
_OPTIMISM = 0.7  # the cost-to-go allows for turns and stops; this share of it bounds from below what a path may cost
_WALL = 0.5  # m: samples keep this far from the walls


@inlined
def between(u, low, high):
    """Map a uniform number to an interval."""
    return low + u * (high - low)


@inlined
def draw_point(draws, k, root, goal, air, model):
    """Sample a point of one medium outside the zone, mostly around root and goal (Alg. 1, line 1)."""
    w = model.world
    near = draws[k + 2] < _AROUND_SHARE
    x_low = max(w.x_min + _WALL, min(root.state[0], goal[0]) - _AROUND) if near else w.x_min + _WALL
    x_high = min(w.x_max - _WALL, max(root.state[0], goal[0]) + _AROUND) if near else w.x_max - _WALL
    y_low = max(w.y_min + _WALL, min(root.state[1], goal[1]) - _AROUND) if near else w.y_min + _WALL
    y_high = min(w.y_max - _WALL, max(root.state[1], goal[1]) + _AROUND) if near else w.y_max - _WALL
    x = between(draws[k + 3], x_low, x_high)
    y = between(draws[k + 4], y_low, y_high)
    z = between(draws[k + 5], AIR_GATE, w.z_max - _WALL) if air else between(draws[k + 5], w.z_min + _WALL, -WATER_GATE)
    return x, y, z


@inlined
def draw_near(draws, k, root):
    """Sample a point around the root, in its medium: for the way out of a narrow place."""
    x = root.state[0] + between(draws[k + 3], -_NEAR, _NEAR)
    y = root.state[1] + between(draws[k + 4], -_NEAR, _NEAR)
    z = root.state[2] + between(draws[k + 5], -_NEAR, _NEAR)
    return x, y, max(z, AIR_GATE) if root.state[2] > 0.0 else min(z, -WATER_GATE)


@inlined
def draw_column(draws, k, root, goal, roam, settings, model):
    """Sample a crossing column near the water-side end; the point lies at the goal's height on the far side.

    Roaming, the columns lie around the root and the point just beyond the surface.
    """
    w = model.world
    from_air = root.state[2] > 0.0
    at_goal = from_air and roam != ANY_MEDIUM
    cx = goal[0] if at_goal else root.state[0]
    cy = goal[1] if at_goal else root.state[1]
    sine, cosine = sincos(between(draws[k + 3], -np.pi, np.pi))
    radius = settings.column_radius * draws[k + 4]
    x = min(max(cx + radius * cosine, w.x_min + _WALL), w.x_max - _WALL)
    y = min(max(cy + radius * sine, w.y_min + _WALL), w.y_max - _WALL)
    z = -_ROAM_HEIGHT if from_air else _ROAM_HEIGHT
    return x, y, z if roam == ANY_MEDIUM else goal[2]


@inlined
def next_node(work, size, x, y, z, to_goal, from_air, by_cost, stamp, objective):
    """Return the best untried open node for a point, or -1: nearest, or least cost-to-come plus cost (sorted order)."""
    best, least = -1, np.inf
    rate = objective.rates.air if from_air else objective.rates.water
    for i in range(size):
        n = work.nodes[i]
        if n.dead or n.kind != OPEN or n.goal or work.path[i] == stamp:
            continue
        if to_goal:
            if n.tried:
                continue
            score = n.to_go + (n.cost if by_cost else 0.0)
        else:
            if (n.state[2] > 0.0) != from_air:
                continue
            dx, dy, dz = n.state[0] - x, n.state[1] - y, n.state[2] - z
            score = np.sqrt(dx * dx + dy * dy + dz * dz) / rate + (n.cost if by_cost else 0.0)
        if score < least:
            best, least = i, score
    return best


@inlined
def least_cost(work, size):
    """Return the least cost of a node at the goal, infinite if there is none."""
    least = np.inf
    for i in range(size):
        if work.nodes[i].goal and not work.nodes[i].dead:
            least = min(least, work.nodes[i].cost)
    return least


@inlined
def any_beyond(work, size, goal):
    """Whether the tree has an open node in the goal's medium."""
    found = False
    for i in range(size):
        n = work.nodes[i]
        found = found or (n.kind == OPEN and not n.dead and (n.state[2] > 0.0) == (goal[2] > 0.0))
    return found


@inlined
def draw_sample(draws, k, root, goal, roam, onward, settings, objective, model):
    """Draw what to grow toward (Alg. 1, line 1).

    Returns (x, y, z, whether it is reached from air, kind), the kind `GOAL_SAMPLE`, `COLUMN_SAMPLE`, `CAREFUL_SAMPLE`
    or `POINT_SAMPLE`. `onward`: the goal's medium is reached, the goal is not, so most samples go there.
    """
    paper = objective.paper > 0.0
    from_air = root.state[2] > 0.0
    change = roam == ANY_MEDIUM or from_air != (goal[2] > 0.0)
    if draws[k] < settings.goal_bias:
        return goal[0], goal[1], goal[2], goal[2] > 0.0, GOAL_SAMPLE
    columns = change and (roam == ANY_MEDIUM or not paper) and not (onward and draws[k + 2] < 0.5)
    if columns and draws[k] < settings.goal_bias + settings.column_bias:
        x, y, z = draw_column(draws, k, root, goal, roam, settings, model)
        return x, y, z, not z > 0.0, COLUMN_SAMPLE
    if roam != STRAIGHT_ON and draws[k + 2] < 0.5:
        x, y, z = draw_near(draws, k, root)
        return x, y, z, from_air, CAREFUL_SAMPLE
    air = draws[k + 1] * 2.0 % 1.0 < 0.5 if change and not onward else goal[2] > 0.0
    x, y, z = draw_point(draws, k, root, goal, air, model)
    # as printed, a sample in the other medium is reached through the surface where the line meets it
    return x, y, z, from_air if paper else air, POINT_SAMPLE


@routine
def expand_tree(work, values, goal, size, draws, iterations, settings, objective, margin, roam, ticks):
    """Expand the tree by a number of samples (Alg. 1); return its new size.

    Args:
        work: `Workspace`.
        values: packed `Model`.
        goal: (3,) m.
        size: nodes in use.
        draws: (iterations * DRAWS,) uniform numbers.
        iterations: samples.
        settings: `SettingParams`.
        objective: `ObjectiveParams`.
        margin: clearance in m that edges keep.
        roam: `STRAIGHT_ON`, `CAREFUL` or `ANY_MEDIUM`, the more the longer the vehicle has waited for a path.
        ticks: ticks a period.
    """
    model = unpack_model(values)
    root = work.nodes[0]
    for i in range(work.path.size):
        work.path[i] = -1
    paper = objective.paper > 0.0
    best = least_cost(work, size)
    beyond = any_beyond(work, size, goal)
    for iteration in range(iterations):
        k = iteration * DRAWS
        onward = beyond and best == np.inf and not paper
        x, y, z, from_air, kind = draw_sample(draws, k, root, goal, roam, onward, settings, objective, model)
        to_goal = kind == GOAL_SAMPLE
        by_cost = draws[k + 1] < 0.5 and not paper
        step = _CAREFUL_SHARE * settings.step if kind == CAREFUL_SAMPLE else settings.step
        left = cost_to_go(x, y, z, goal[0], goal[1], goal[2], objective)
        for _ in range(settings.tries):
            i = next_node(work, size, x, y, z, to_goal, from_air, by_cost, iteration, objective)
            if i < 0:
                break
            work.path[i] = iteration
            n = work.nodes[i]
            n.tried = 1 if to_goal else n.tried
            # a sample that cannot beat the best path, even in an empty world, is not worth an edge
            via = cost_to_go(n.state[0], n.state[1], n.state[2], x, y, z, objective) + left
            if settings.prune > 0.0 and n.cost + _OPTIMISM * via >= best:
                continue
            seek = kind <= COLUMN_SAMPLE and not paper
            if seek and not in_sight(work, n, x, y, z, model.vehicle.radius, margin):
                continue
            limit = _GOAL_EXTENSION if to_goal else settings.extension
            grown = extend(work, values, goal, i, size, x, y, z, limit, step, objective, margin, ticks)
            if grown > size:
                size = grown
                end = work.nodes[size - 1]
                best = min(best, end.cost) if end.goal else best
                beyond = beyond or (end.state[2] > 0.0) == (goal[2] > 0.0)
                break
    return size
