"""The generator: clearances, determinism, distributions, errors."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import kstest

from hydrone_gym.world.generator import (
    EXPERIMENT_1,
    EXPERIMENT_2,
    ScenarioLaw,
    draw,
    first_numbers,
    generate,
    place,
    place_many,
    prepare,
)
from hydrone_gym.world.scenario import validate
from hydrone_gym.world.solvability import has_grid_route, is_solvable
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
    for one in (place, has_grid_route):  # what drawing calls; both contain has_simple_route or stand beside it
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
