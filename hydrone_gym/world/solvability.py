"""Can a scenario be flown at all? First a handful of simple routes, then a flood fill over a coarse grid.

Both keep `ROUTE_MARGIN` beyond the vehicle's radius to every sphere and move only vertically inside the transition
zone. A simple route is a proof in continuous space. So is a way through the grid: between the centres of two free cells
it loses at most ``R - sqrt(R**2 - CELL**2 / 4)`` of the distance R to a sphere's centre, less than the margin for
R > 0.3 m. But the grid misses passages narrower than about one cell, so it errs towards "unsolvable".
"""

import numpy as np

from hydrone_gym._jit import inlined, kernel
from hydrone_gym.world.bodies import segment_distance
from hydrone_gym.world.scenario import Scenario, check_radius, validate
from hydrone_gym.world.world import World

ROUTE_MARGIN = 0.15  # m
CELL = 0.5  # m, longest edge of a cell

_SPACE = np.dtype([("lower", "f8", 3), ("upper", "f8", 3), ("zone", "f8"), ("inflation", "f8")])

# Where a simple route bends: share of the way from start to goal, lateral offset (m), lift (m, within one medium only).
# The first is the straight route, crossing at 65 % of the way as the paper's flights do; wide detours come next because
# they share the fewest spheres with it.
_PLACES = [(0.25, 0.0), (0.8, -1.5), (0.5, 1.5)]
_SIDES = [(share, side, lift) for wide in (4.0, 7.0, 2.0) for share, lift in _PLACES for side in (wide, -wide)]
_BENDS = np.array([(0.65, 0.0, 0.0), *_SIDES])


def flight_space(world: World, vehicle_radius: float) -> np.ndarray:
    """Return what the kernels here know of a world, for a vehicle of this radius (m): one read-only record."""
    check_radius(vehicle_radius)
    space = np.zeros(1, _SPACE)
    space["lower"], space["upper"], space["zone"] = world.lower, world.upper, world.zone
    space["inflation"] = vehicle_radius + ROUTE_MARGIN
    space.flags.writeable = False
    return space


@inlined
def _leg_is_clear(a, b, obstacles, inflation):
    """Whether the straight leg a-b keeps more than the inflation (m) to every sphere."""
    for i in range(obstacles.shape[0]):
        body = (obstacles[i, 0], obstacles[i, 1], obstacles[i, 2], obstacles[i, 3] + inflation)
        if segment_distance(a, b, body) <= 0.0:
            return False
    return True


@kernel
def has_simple_route(space, start, goal, obstacles):
    """Whether one of a few routes of straight legs is clear: sufficient for a scenario to be solvable.

    Between media: start, column through the transition zone, goal. Within a medium: start, one bend, goal.
    Shapes: space (1,) record, start (3 or more,), goal (3,), obstacles (M, 4); all in m.
    """
    box = space[0]
    zone, inflation = box.zone, box.inflation
    sx, sy, sz = start[0], start[1], start[2]
    gx, gy, gz = goal[0], goal[1], goal[2]
    across = np.sqrt((gx - sx) ** 2 + (gy - sy) ** 2)
    ux, uy = ((gx - sx) / across, (gy - sy) / across) if across > 0.0 else (1.0, 0.0)
    side_s, side_g = (1.0 if sz > 0.0 else -1.0), (1.0 if gz > 0.0 else -1.0)
    for k in range(_BENDS.shape[0]):
        share, lateral, lift = _BENDS[k, 0], _BENDS[k, 1], _BENDS[k, 2]
        x = sx + share * (gx - sx) - lateral * uy
        y = sy + share * (gy - sy) + lateral * ux
        if side_s == side_g:
            first = second = sz + share * (gz - sz) + lift
            outside = first * side_s < zone or first <= box.lower[2] or first >= box.upper[2]
        else:
            first, second, outside = side_s * zone, side_g * zone, False
        if outside or x <= box.lower[0] or x >= box.upper[0] or y <= box.lower[1] or y >= box.upper[1]:
            continue
        if (
            _leg_is_clear((sx, sy, sz), (x, y, first), obstacles, inflation)
            and _leg_is_clear((x, y, second), (gx, gy, gz), obstacles, inflation)
            and _leg_is_clear((x, y, first), (x, y, second), obstacles, inflation)
        ):
            return True
    return False


@inlined
def _cell(value, low, size, count):
    """Index of the cell that holds a coordinate, limited to the cells of the box; cell 0 is the wall."""
    return int(min(max(np.floor((value - low) / size) + 1.0, 1.0), count))


@inlined
def _block(free, obstacles, inflation, low, grid):
    """Take every cell out of the flat grid whose centre lies within an inflated sphere; grid: cell edges and counts."""
    (dx, dy, dz), (nx, ny, nz) = grid
    for m in range(obstacles.shape[0]):
        x, y, z = obstacles[m, 0] - low[0], obstacles[m, 1] - low[1], obstacles[m, 2] - low[2]
        reach = obstacles[m, 3] + inflation
        for i in range(_cell(x - reach, 0.0, dx, nx), _cell(x + reach, 0.0, dx, nx) + 1):
            x2 = ((i - 0.5) * dx - x) ** 2
            for j in range(_cell(y - reach, 0.0, dy, ny), _cell(y + reach, 0.0, dy, ny) + 1):
                xy2 = x2 + ((j - 0.5) * dy - y) ** 2
                for k in range(_cell(z - reach, 0.0, dz, nz), _cell(z + reach, 0.0, dz, nz) + 1):
                    if xy2 + ((k - 0.5) * dz - z) ** 2 <= reach * reach:
                        free[(i * (ny + 2) + j) * (nz + 2) + k] = 0


@kernel
def has_grid_route(space, start, goal, obstacles):
    """Whether a flood fill from the start's cell reaches the goal's: moves to six neighbours, vertical in the zone.

    A cell is blocked when its centre lies within a sphere inflated by the vehicle's radius and the margin. The cells
    of start and goal count as free. Shapes: space (1,) record, start (3 or more,), goal (3,), obstacles (M, 4); in m.
    """
    low, high = space[0].lower, space[0].upper
    lx, ly, lz = high[0] - low[0], high[1] - low[1], high[2] - low[2]
    nx, ny, nz = int(np.ceil(lx / CELL)), int(np.ceil(ly / CELL)), int(np.ceil(lz / CELL))
    dx, dy, dz = lx / nx, ly / ny, lz / nz
    row = nz + 2
    plane = (ny + 2) * row
    free = np.zeros((nx + 2) * plane, np.uint8)  # the outermost cells are walls and stay zero
    for i in range(1, nx + 1):
        for j in range(1, ny + 1):
            for k in range(1, nz + 1):
                free[i * plane + j * row + k] = 1
    _block(free, obstacles, space[0].inflation, low, ((dx, dy, dz), (nx, ny, nz)))
    here = _cell(start[0], low[0], dx, nx) * plane + _cell(start[1], low[1], dy, ny) * row
    here += _cell(start[2], low[2], dz, nz)
    end = _cell(goal[0], low[0], dx, nx) * plane + _cell(goal[1], low[1], dy, ny) * row
    end += _cell(goal[2], low[2], dz, nz)
    free[end] = 1
    return _fill(free, here, end, plane, row, low[2], dz, space[0].zone)


@inlined
def _fill(free, here, end, plane, row, bottom, height, zone):
    """Depth-first fill over the flat grid of free cells; takes the cells it visits out of it."""
    # Moves towards the goal are pushed last and so tried first: most fills then end after a small part of the grid.
    up = 1 if end % row > here % row else -1
    forth = row if end % plane // row > here % plane // row else -row
    right = plane if end // plane > here // plane else -plane
    moves = (-up, -forth, -right, up, forth, right)
    stack = np.empty(free.size, np.int64)
    stack[0], top = here, 1
    free[here] = 0
    while top > 0:
        top -= 1
        here = stack[top]
        if here == end:
            return True
        vertical_only = abs(bottom + (here % row - 0.5) * height) <= zone
        for m in range(6):
            near = here + moves[m]
            if free[near] and not (vertical_only and m % 3):
                free[near] = 0
                stack[top] = near
                top += 1
    return False


def is_solvable(scenario: Scenario, world: World, vehicle_radius: float) -> bool:
    """Whether a route from start to goal is found that keeps `ROUTE_MARGIN` more than the vehicle's radius (m) clear.

    False means that none was found on a grid of `CELL`: it may miss a passage narrower than about a cell. Raises
    ValueError when the vehicle cannot be at the start or at the goal, see `hydrone_gym.world.scenario.validate`.
    """
    validate(scenario, world, vehicle_radius)
    # Writable arrays, as in a draw: the kernels have one compiled version.
    mission = np.array(scenario.start), np.array(scenario.goal), np.array(scenario.obstacles)
    space = flight_space(world, vehicle_radius)
    return has_simple_route(space, *mission) or has_grid_route(space, *mission)
