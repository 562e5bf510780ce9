"""The generator and the solvability check: clearances, determinism, distributions, a slow oracle, errors."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage, sparse
from scipy.stats import kstest

from hydrone_gym.world.generator import (
    EXPERIMENT_1,
    EXPERIMENT_2,
    ScenarioLaw,
    draw,
    first_numbers,
    generate,
    prepare,
)
from hydrone_gym.world.placement import place, place_many
from hydrone_gym.world.scenario import Scenario, validate
from hydrone_gym.world.solvability import flight_space, has_grid_route, has_simple_route, is_solvable
from hydrone_gym.world.world import World

RADIUS = 0.45
WORLD = World()
DENSE = {"num_obstacles": 40, "obstacle_radius": (0.8, 1.8)}


def from_seed(seed, law=None, radius=RADIUS):
    return generate(law or ScenarioLaw(), WORLD, radius, np.random.default_rng(seed))


ends = st.sampled_from([(None, None), (EXPERIMENT_1.start, None), (None, EXPERIMENT_1.goal), EXPERIMENT_2])
laws = st.builds(
    lambda fixed, **fields: ScenarioLaw(
        start=fixed.start if isinstance(fixed, ScenarioLaw) else fixed[0],
        goal=fixed.goal if isinstance(fixed, ScenarioLaw) else fixed[1],
        **fields,
    ),
    ends,
    num_obstacles=st.integers(0, 40),
    obstacle_radius=st.tuples(st.floats(0.1, 1.0), st.floats(1.0, 1.8)),
    end_clearance=st.floats(0.0, 2.0),
    min_separation=st.floats(0.0, 10.0),
)


@settings(max_examples=200, deadline=None)
@given(law=laws, seed=st.integers(0, 2**32), radius=st.floats(0.1, 0.6))
def test_every_scenario_obeys_its_law(law, seed, radius):
    made = from_seed(seed, law, radius)
    validate(made, WORLD, radius)
    assert is_solvable(made, WORLD, radius)
    centres, radii = made.obstacles[:, :3], made.obstacles[:, 3]
    assert made.obstacles.shape == (law.num_obstacles, 4)
    assert np.all((radii >= law.obstacle_radius[0]) & (radii <= law.obstacle_radius[1]))
    assert np.all((centres >= WORLD.lower) & (centres <= WORLD.upper))
    for drawn, fixed in ((made.start[:3], law.start), (made.goal, law.goal)):
        free = np.linalg.norm(centres - drawn, axis=1) - radii
        assert np.all(free >= law.end_clearance + radius - 1e-12)
        if fixed is not None:
            assert drawn == fixed
            continue
        assert np.all(np.array(WORLD.lower) + 1.0 <= drawn)
        assert np.all(np.array(WORLD.upper) - 1.0 >= drawn)
        assert abs(drawn[2]) >= WORLD.zone + 0.5
    if law.start is None or law.goal is None:
        assert math.dist(made.start[:3], made.goal) >= law.min_separation - 1e-12
    assert -math.pi <= made.start[3] <= math.pi
    if law.start is not None:
        assert made.start[3] == 0.0


def test_equal_seeds_give_equal_scenarios_bit_for_bit():
    for law in (EXPERIMENT_1, ScenarioLaw(), ScenarioLaw(**DENSE)):
        for seed in range(20):
            first, second = from_seed(seed, law), from_seed(seed, law)
            assert first == second
            assert first.obstacles.tobytes() == second.obstacles.tobytes()


def test_different_seeds_and_calls_differ():
    seen = {from_seed(seed).obstacles.tobytes() for seed in range(200)}
    assert len(seen) == 200
    rng = np.random.default_rng(0)
    first, second = (generate(EXPERIMENT_1, WORLD, RADIUS, rng) for _ in range(2))
    assert first != second


def test_restored_generator_repeats_the_scenario():
    rng = np.random.default_rng(3)
    generate(EXPERIMENT_1, WORLD, RADIUS, rng)
    state = rng.bit_generator.state
    first = generate(EXPERIMENT_1, WORLD, RADIUS, rng)
    rng.bit_generator.state = state
    assert generate(EXPERIMENT_1, WORLD, RADIUS, rng) == first


def test_drawing_into_rows_equals_generating():
    starts, goals, obstacles = np.empty((5, 4)), np.empty((5, 3)), np.empty((5, 20, 4))
    prepared = prepare(ScenarioLaw(), WORLD, RADIUS)
    for seed in range(5):
        rng = np.random.default_rng(seed)
        draw(ScenarioLaw(), prepared, rng, starts[seed], goals[seed], obstacles[seed])
        expected = from_seed(seed)
        assert tuple(starts[seed]) == expected.start
        assert tuple(goals[seed]) == expected.goal
        assert np.array_equal(obstacles[seed], expected.obstacles)


def test_placing_many_at_once_equals_generating_one_by_one():
    """The crowded law leaves some without a simple route: those go on alone, from the numbers already drawn."""
    law, count = dataclasses.replace(EXPERIMENT_1, **DENSE), 40
    starts, goals, obstacles = np.empty((count, 4)), np.empty((count, 3)), np.empty((count, law.num_obstacles, 4))
    prepared = prepare(law, WORLD, RADIUS)
    streams = [np.random.default_rng(seed) for seed in range(count)]
    numbers = np.stack([stream.random(first_numbers(law)) for stream in streams])
    solved = place_many(*prepared, numbers, np.arange(count), starts, goals, obstacles)
    assert 0 < solved.sum() < count
    for seed in np.flatnonzero(~solved):
        draw(law, prepared, streams[seed], starts[seed], goals[seed], obstacles[seed], numbers[seed])
    for seed in range(count):
        expected = from_seed(seed, law)
        assert (tuple(starts[seed]), tuple(goals[seed])) == (expected.start, expected.goal)
        assert np.array_equal(obstacles[seed], expected.obstacles)


def test_kernels_have_one_compiled_version():
    rng = np.random.default_rng(0)
    for _ in range(50):
        is_solvable(generate(dataclasses.replace(EXPERIMENT_1, **DENSE), WORLD, RADIUS, rng), WORLD, RADIUS)
    for one in (place, has_simple_route, has_grid_route):
        assert len(one.signatures) == 1


def test_radii_and_centres_are_uniform():
    spheres = np.concatenate([from_seed(seed, ScenarioLaw(end_clearance=0.0)).obstacles for seed in range(400)])
    assert kstest(spheres[:, 3], "uniform", args=(0.5, 1.0)).statistic < 0.02
    for axis, low, extent in ((0, -10.0, 20.0), (1, -10.0, 20.0), (2, -5.0, 15.0)):
        # The empty surroundings of both ends thin out the middle a little.
        assert kstest(spheres[:, axis], "uniform", args=(low, extent)).statistic < 0.03
    share_under_water = np.mean(spheres[:, 2] < 0.0)
    assert share_under_water == pytest.approx(1 / 3, abs=0.02)
    assert np.abs(np.corrcoef(spheres.T) - np.eye(4)).max() < 0.03
    assert np.abs(np.corrcoef(spheres[:-1].T, spheres[1:].T) - np.eye(8)).max() < 0.03, "one sphere follows the last"


def test_media_are_fair_coins_or_as_the_law_says():
    pairs = [from_seed(seed).media for seed in range(2000)]
    for first in ("air", "water"):
        for second in ("air", "water"):
            assert pairs.count((first, second)) == pytest.approx(500, abs=80)
            law = ScenarioLaw(media=[first, second])
            assert {from_seed(seed, law).media for seed in range(30)} == {(first, second)}


def test_drawn_yaw_is_uniform():
    yaws = [from_seed(seed).start[3] for seed in range(1000)]
    assert kstest(yaws, "uniform", args=(-math.pi, 2 * math.pi)).pvalue > 1e-3


def test_experiments_are_the_papers():
    assert from_seed(0, EXPERIMENT_1).start == (-9.0, -9.0, 8.0, 0.0)
    assert from_seed(0, EXPERIMENT_1).goal == (9.0, 9.0, -3.0)
    assert from_seed(0, EXPERIMENT_2).start == (9.0, -9.0, -3.0, 0.0)
    assert from_seed(0, EXPERIMENT_2).goal == (-9.0, 9.0, 7.0)
    assert EXPERIMENT_1.num_obstacles == EXPERIMENT_2.num_obstacles == 20


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
        made = from_seed(seed, law)
        arrays = np.array(made.start), np.array(made.goal), np.array(made.obstacles)
        if has_simple_route(flight_space(WORLD, RADIUS), *arrays):
            accepted += 1
            assert slow_grid_route(made, WORLD, RADIUS), seed
    assert accepted > 30


def test_solvability_refuses_an_invalid_scenario():
    with pytest.raises(ValueError, match="goal z must lie outside the transition zone"):
        is_solvable(Scenario(start=(0, 0, 5, 0), goal=(0, 0, 0.5), obstacles=[]), WORLD, RADIUS)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"num_obstacles": -1}, "ScenarioLaw.num_obstacles must be a whole number, not negative, got -1"),
        ({"num_obstacles": 2.5}, "ScenarioLaw.num_obstacles must be a whole number, not negative, got 2.5"),
        ({"num_obstacles": True}, "ScenarioLaw.num_obstacles must be a whole number, not negative, got True"),
        ({"obstacle_radius": (1.5, 0.5)}, r"ScenarioLaw.obstacle_radius must be positive and ascending \(m\), got \(1"),
        ({"obstacle_radius": (0.0, 0.5)}, r"ScenarioLaw.obstacle_radius must be positive and ascending \(m\), got \(0"),
        ({"obstacle_radius": 1.0}, r"ScenarioLaw.obstacle_radius must be 2 finite numbers \(m\), got 1.0"),
        ({"obstacle_radius": (0.5, math.inf)}, r"ScenarioLaw.obstacle_radius must be 2 finite numbers \(m\)"),
        ({"end_clearance": -0.1}, r"ScenarioLaw.end_clearance must be finite and not negative \(m\), got -0.1"),
        ({"min_separation": math.nan}, r"ScenarioLaw.min_separation must be finite and not negative \(m\), got nan"),
        ({"start": (0.0, 0.0)}, r"ScenarioLaw.start must be 3 finite numbers \(m\), got \(0.0, 0.0\)"),
        ({"goal": (0.0, 0.0, "3")}, r"ScenarioLaw.goal must be 3 finite numbers \(m\)"),
        ({"media": ("air", "mud")}, r'ScenarioLaw.media must be None or a pair of "air" and "water", got'),
        ({"media": "air"}, r'ScenarioLaw.media must be None or a pair of "air" and "water", got \'air\''),
        (
            {"start": (0.0, 0.0, 5.0), "media": ("water", "air")},
            r"ScenarioLaw.start must lie in water as media says, got z = 5.0 m",
        ),
    ],
)
def test_impossible_laws_are_refused(fields, message):
    with pytest.raises(ValueError, match=message):
        ScenarioLaw(**fields)


FLAT = World(lower=(-10.0, -10.0, -2.0))


@pytest.mark.parametrize(
    ("fields", "world", "message"),
    [
        ({"start": (0.0, 0.0, 0.5)}, WORLD, r"ScenarioLaw.start z must lie outside the transition zone of \+-0.8 m"),
        ({"goal": (0.0, 20.0, 5.0)}, WORLD, r"ScenarioLaw.goal y must lie inside the box, between -10.0 and 10.0 m"),
        (
            {"obstacle_radius": (0.5, 7.5)},
            WORLD,
            r"ScenarioLaw.obstacle_radius must be less than 7.5 m, half the shortest edge of the box, got 7.5 m",
        ),
        (
            {},
            FLAT,
            r"World leaves no room to draw a start in water: 1.0 m from the walls and 0.5 m from the transition zone, "
            r"z would lie between -1 and -1.3 m",
        ),
        (
            {"min_separation": 30.0},
            WORLD,
            r"ScenarioLaw.min_separation must be at most 26.6 m for a start in air and a goal in air of this world, "
            r"got 30.0 m",
        ),
        (
            {"min_separation": 26.0, "media": ("water", "water")},
            WORLD,
            r"ScenarioLaw.min_separation must be at most 25.6 m for a start in water and a goal in water",
        ),
        (
            {"min_separation": 28.32, "media": ("air", "water")},
            WORLD,
            r"no ends found that are 28.32 m apart: lower ScenarioLaw.min_separation",
        ),
        (
            {"end_clearance": 30.0},
            WORLD,
            r"no room for 20 obstacles of radius \(0.5, 1.5\) m that keep 30.0 m beyond the vehicle's radius to start "
            r"and goal: lower ScenarioLaw.end_clearance or num_obstacles",
        ),
        (
            {**DENSE, "num_obstacles": 2500},
            WORLD,
            r"no solvable scenario after 100 attempts: num_obstacles=2500, radius=\(0.8, 1.8\) m",
        ),
    ],
)
def test_laws_impossible_in_a_world_are_refused(fields, world, message):
    with pytest.raises(ValueError, match=message):
        generate(ScenarioLaw(**fields), world, RADIUS, np.random.default_rng(0))


def test_flat_worlds_serve_laws_that_need_no_deep_water():
    made = generate(ScenarioLaw(media=("air", "air")), FLAT, RADIUS, np.random.default_rng(0))
    assert made.media == ("air", "air")


def test_impossible_vehicle_radius_is_refused():
    with pytest.raises(ValueError, match=r"vehicle radius must be positive \(m\), got -0.45"):
        from_seed(0, radius=-0.45)
