"""Solvability: hand-built worlds with a known answer, and a slow oracle."""

import dataclasses
import math

import numpy as np
import pytest
from scipy import ndimage, sparse

from hydrone_gym.world.generator import EXPERIMENT_1, EXPERIMENT_2, ScenarioLaw, generate
from hydrone_gym.world.scenario import Scenario
from hydrone_gym.world.solvability import flight_space, has_grid_route, has_simple_route, is_solvable
from hydrone_gym.world.world import World

RADIUS = 0.45
WORLD = World()
DENSE = {"num_obstacles": 40, "obstacle_radius": (0.8, 1.8)}


def walled_in(gap=False):
    """Exp. 1 with a shell of overlapping spheres around the goal, open towards the surface if there is a gap."""
    directions = np.stack(np.meshgrid(*[np.arange(-2, 3)] * 3, indexing="ij"), -1).reshape(-1, 3)
    directions = directions[np.abs(directions).max(axis=1) == 2]
    if gap:
        directions = directions[directions[:, 2] < 2]
    goal = np.array([6.0, 6.0, -2.5])
    return Scenario(
        start=(*EXPERIMENT_1.start, 0.0),
        goal=goal,
        obstacles=np.column_stack((goal + directions, np.full(len(directions), 0.8))),
    )


def test_walled_in_goal_is_unsolvable_and_an_opening_frees_it():
    assert not is_solvable(walled_in(), WORLD, RADIUS)
    assert is_solvable(walled_in(gap=True), WORLD, RADIUS)


def test_start_and_goal_split_by_a_wall_of_spheres():
    wall = [(0.0, y, z, 1.2) for y in np.arange(-10, 10.1, 1.5) for z in np.arange(-5, 10.1, 1.5)]
    split = Scenario(start=(*EXPERIMENT_1.start, 0.0), goal=EXPERIMENT_1.goal, obstacles=wall)
    assert not is_solvable(split, WORLD, RADIUS)
    # A wide vehicle is stopped by a hole that a narrow one passes.
    holed = dataclasses.replace(split, obstacles=[sphere for sphere in wall if math.hypot(*sphere[1:3]) > 2.0])
    assert is_solvable(holed, WORLD, 0.1)
    assert not is_solvable(holed, WORLD, 1.2)


def test_lateral_moves_inside_the_zone_do_not_count():
    """Two floors of spheres whose holes lie apart: only a way sideways through the zone joins them."""
    start, goal = (0.0, 0.0, 8.0, 0.0), (0.0, 0.0, -4.4)
    grid = np.arange(-10.0, 10.1, 1.0)

    def floor(z, hole):
        return [(x, y, z, 0.7) for x in grid for y in grid if math.hypot(x - hole, y - hole) > 2.5]

    apart = Scenario(start=start, goal=goal, obstacles=floor(-2.2, -6.0) + floor(2.2, 6.0))
    assert not is_solvable(apart, WORLD, RADIUS)
    assert is_solvable(apart, World(zone=0.2), RADIUS)
    above_each_other = dataclasses.replace(apart, obstacles=floor(-2.2, 6.0) + floor(2.2, 6.0))
    assert is_solvable(above_each_other, WORLD, RADIUS)


def test_small_spheres_at_the_surface_block_every_column():
    grid = np.arange(-10.0, 10.1, 0.5)
    lid = [(x, y, 0.0, 0.05) for x in grid for y in grid]
    for law in (EXPERIMENT_1, EXPERIMENT_2):
        assert not is_solvable(Scenario(start=(*law.start, 0.0), goal=law.goal, obstacles=lid), WORLD, RADIUS)


def test_simple_routes_within_a_medium_stay_in_it():
    """A curtain hangs down to the zone: no bend may duck through the zone, but a dive passes below."""
    curtain = [(0.0, y, z, 0.5) for y in np.arange(-10.0, 10.1, 0.75) for z in np.arange(1.75, 10.1, 0.75)]
    made = Scenario(start=(-8.0, 0.0, 1.4, 0.0), goal=(8.0, 0.0, 1.4), obstacles=curtain)
    arrays = np.array(made.start), np.array(made.goal), np.array(made.obstacles)
    assert not has_simple_route(flight_space(WORLD, RADIUS), *arrays)
    assert is_solvable(made, WORLD, RADIUS)


def slow_grid_route(scenario, world, radius):
    """The grid rule spelled out: label air, water and every column of the zone, then join what touches vertically."""
    lower, upper = np.array(world.lower), np.array(world.upper)
    counts = np.ceil((upper - lower) / 0.5).astype(int)
    sizes = (upper - lower) / counts
    axes = [lower[a] + (np.arange(counts[a]) + 0.5) * sizes[a] for a in range(3)]
    x, y, z = np.meshgrid(*axes, indexing="ij", sparse=True)
    free = np.ones(counts, bool)
    for cx, cy, cz, r in scenario.obstacles:
        free &= np.sqrt((x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2) > r + radius + 0.15
    cells = [tuple(((np.array(end[:3]) - lower) // sizes).astype(int)) for end in (scenario.start, scenario.goal)]
    for cell in cells:
        free[cell] = True
    vertical = np.zeros((3, 3, 3), bool)
    vertical[1, 1, :] = True
    in_zone = np.abs(axes[2]) <= world.zone
    labels, most = np.zeros(counts, int), 0
    for part, structure in ((axes[2] > world.zone, None), (axes[2] < -world.zone, None), (in_zone, vertical)):
        found, number = ndimage.label(free & part, structure)
        labels[found > 0] = found[found > 0] + most
        most += number
    below, above = labels[:, :, :-1], labels[:, :, 1:]
    touching = (below > 0) & (above > 0)
    graph = sparse.coo_array((np.ones(touching.sum()), (below[touching], above[touching])), (most + 1, most + 1))
    group = sparse.csgraph.connected_components(graph, directed=False)[1]
    return group[labels[cells[0]]] == group[labels[cells[1]]]


def crowded(seed, world=WORLD):
    """Far denser than the generator's worlds, so that about half are unsolvable; ends in any media."""
    rng = np.random.default_rng(seed)
    lower, upper = np.array(world.lower), np.array(world.upper)
    law = ScenarioLaw(num_obstacles=0, min_separation=5.0)
    made = generate(law, world, RADIUS, rng)
    count = int(rng.uniform(0.09, 0.16) * np.prod(upper - lower))
    spheres = np.column_stack((lower + rng.random((count, 3)) * (upper - lower), rng.uniform(0.6, 1.4, count)))
    for end in (made.start[:3], made.goal):
        spheres = spheres[np.linalg.norm(spheres[:, :3] - end, axis=1) > spheres[:, 3] + RADIUS + 0.3]
    return dataclasses.replace(made, obstacles=spheres)


@pytest.mark.parametrize("world", [WORLD, World(lower=(-7.2, -9.0, -4.1), upper=(8.0, 6.3, 5.7), zone=0.6)])
def test_solvability_agrees_with_a_slow_oracle(world):
    answers = []
    for seed in range(40):
        made = crowded(seed, world)
        expected = slow_grid_route(made, world, RADIUS)
        arrays = np.array(made.start), np.array(made.goal), np.array(made.obstacles)
        assert has_grid_route(flight_space(world, RADIUS), *arrays) == expected, seed
        assert is_solvable(made, world, RADIUS) == expected, seed
        answers.append(expected)
    assert 10 <= sum(answers) <= 30, "the worlds must exercise both answers"


def test_simple_routes_are_also_found_on_the_grid():
    """The cheap test is sufficient: what it accepts, the grid accepts."""
    accepted = 0
    for seed in range(60):
        law = dataclasses.replace((EXPERIMENT_1, ScenarioLaw())[seed % 2], **DENSE)
        made = generate(law, WORLD, RADIUS, np.random.default_rng(seed))
        arrays = np.array(made.start), np.array(made.goal), np.array(made.obstacles)
        if has_simple_route(flight_space(WORLD, RADIUS), *arrays):
            accepted += 1
            assert slow_grid_route(made, WORLD, RADIUS), seed
    assert accepted > 30


def test_solvability_refuses_an_invalid_scenario():
    with pytest.raises(ValueError, match="goal z must lie outside the transition zone"):
        is_solvable(Scenario(start=(0, 0, 5, 0), goal=(0, 0, 0.5), obstacles=[]), WORLD, RADIUS)
