"""The kernels that place a scenario's ends and spheres from uniform random numbers."""

import numpy as np

from hydrone_gym._jit import inlined, kernel
from hydrone_gym.world.solvability import has_simple_route

# What `place` returns.
NO_ENDS, NO_SPHERES, NO_SIMPLE_ROUTE, SIMPLE_ROUTE = range(4)

DRAW = np.dtype(
    [
        ("water_share", "f8", 2),  # probability of water, for start and goal
        ("low", "f8", (2, 2, 3)),  # end, medium, axis: the boxes in which the ends are drawn; a fixed end is a point
        ("high", "f8", (2, 2, 3)),
        ("yaw", "f8"),  # half the range of the start's yaw
        ("separation", "f8"),
        ("clearance", "f8"),
        ("radius", "f8", 2),
    ]
)


@inlined
def _place_ends(law, numbers, start, goal):
    """Draw both ends; returns how many of the uniform numbers were used, or 0 when there were too few."""
    first = 1 if numbers[0] < law.water_share[0] else 0
    second = 1 if numbers[1] < law.water_share[1] else 0
    used = 2
    while used + 7 <= numbers.size:
        apart2 = 0.0
        for axis in range(3):
            low, high = law.low[0, first, axis], law.high[0, first, axis]
            start[axis] = low + numbers[used + axis] * (high - low)
            low, high = law.low[1, second, axis], law.high[1, second, axis]
            goal[axis] = low + numbers[used + 3 + axis] * (high - low)
            apart2 += (goal[axis] - start[axis]) ** 2
        start[3] = law.yaw * (2.0 * numbers[used + 6] - 1.0)
        used += 7
        if apart2 >= law.separation * law.separation:
            return used
    return 0


@inlined
def _place_one(record, space, numbers, start, goal, obstacles):
    """Draw ends and spheres from uniform numbers in [0, 1) and try the simple routes.

    Shapes: record and space (1,) from `prepare`, numbers (K,); start (4,), goal (3,) and obstacles (M, 4) are written.
    Returns NO_ENDS or NO_SPHERES when the numbers ran out, else whether there is a simple route.
    """
    law, box = record[0], space[0]
    used = _place_ends(law, numbers, start, goal)
    if used == 0:
        return NO_ENDS
    x, y, z = box.lower[0], box.lower[1], box.lower[2]
    dx, dy, dz = box.upper[0] - x, box.upper[1] - y, box.upper[2] - z
    placed = 0
    while placed < obstacles.shape[0]:
        if used + 4 > numbers.size:
            return NO_SPHERES
        cx, cy, cz = x + numbers[used] * dx, y + numbers[used + 1] * dy, z + numbers[used + 2] * dz
        radius = law.radius[0] + numbers[used + 3] * (law.radius[1] - law.radius[0])
        used += 4
        reach2 = (radius + law.clearance) ** 2
        to_start2 = (cx - start[0]) ** 2 + (cy - start[1]) ** 2 + (cz - start[2]) ** 2
        to_goal2 = (cx - goal[0]) ** 2 + (cy - goal[1]) ** 2 + (cz - goal[2]) ** 2
        if to_start2 >= reach2 and to_goal2 >= reach2:
            obstacles[placed, 0], obstacles[placed, 1], obstacles[placed, 2], obstacles[placed, 3] = cx, cy, cz, radius
            placed += 1
    return SIMPLE_ROUTE if has_simple_route(space, start, goal, obstacles) else NO_SIMPLE_ROUTE


@kernel
def place(record, space, numbers, start, goal, obstacles):
    """`_place_one` for Python."""
    return _place_one(record, space, numbers, start, goal, obstacles)


@kernel
def place_many(record, space, numbers, chosen, starts, goals, obstacles):
    """Place many scenarios at once: line i of `numbers` (k, K) for entry chosen[i] of the three outputs.

    Returns (k,) bool, whether each has a simple route; the others go on with `draw` and the same numbers.
    """
    solved = np.zeros(chosen.size, np.bool_)
    for i in range(chosen.size):
        k = chosen[i]
        solved[i] = _place_one(record, space, numbers[i], starts[k], goals[k], obstacles[k]) == SIMPLE_ROUTE
    return solved
