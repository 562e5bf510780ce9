"""Every shape of world is what its name says, and not what agents train on."""

import gymnasium as gym
import numpy as np
import pytest

from benchmarks.generalisation import FIRST
from benchmarks.world_shapes import SHAPED, SHAPES, EndLaw
from hydrone_gym.evaluation import HELD_OUT
from hydrone_gym.vehicle import HYDRONE
from hydrone_gym.world.solvability import is_solvable
from hydrone_gym.world.world import World

TRAINING = "as in training"
WORLDS = 60


def apart(scenario):
    return float(np.linalg.norm(np.subtract(scenario.goal, scenario.start[:3])))


def heights(scenario):
    return abs(scenario.start[2]), abs(scenario.goal[2])


def to_side_walls(scenario):
    return [10.0 - max(abs(end[0]), abs(end[1])) for end in (scenario.start, scenario.goal)]


def spheres(count, low, high):
    """Whether a world has so many spheres with radii in a range."""

    def fits(scenario, options):
        radii = scenario.obstacles[:, 3]
        return options["num_obstacles"] == len(radii) == count and bool(((radii >= low) & (radii <= high)).all())

    return fits


def joins(*missions):
    """Whether a world's ends are those of one of these missions."""
    return lambda scenario, options: (scenario.start, scenario.goal) in missions


# Written down again, not read from the shapes: what each of them promises.
PROMISES = {
    "no spheres": spheres(0, 0.5, 1.5),
    "10 spheres": spheres(10, 0.5, 1.5),
    "30 spheres": spheres(30, 0.5, 1.5),
    "40 spheres": spheres(40, 0.5, 1.5),
    "60 spheres": spheres(60, 0.5, 1.5),
    "60 small spheres": spheres(60, 0.2, 0.5),
    "8 big spheres": spheres(8, 1.5, 2.5),
    "40 larger spheres": spheres(40, 0.8, 1.8),
    "short": lambda scenario, options: 2.0 <= apart(scenario) <= 6.0,
    "long in air": lambda scenario, options: scenario.media == ("air", "air") and apart(scenario) >= 20.0,
    "long in water": lambda scenario, options: scenario.media == ("water", "water") and apart(scenario) >= 20.0,
    "straight up or down": lambda scenario, options: (
        apart(scenario) >= 3.0 and np.linalg.norm(np.subtract(scenario.goal, scenario.start[:3])[:2]) <= 0.5
    ),
    "close to the surface": lambda scenario, options: all(0.85 <= height <= 1.25 for height in heights(scenario)),
    "close to the walls": lambda scenario, options: all(0.4 <= wall <= 0.9 for wall in to_side_walls(scenario)),
    "mirrored corners": joins(
        ((9.0, -9.0, 8.0, 0.0), (-9.0, 9.0, -3.0)),
        ((-9.0, -9.0, -3.0, 0.0), (9.0, 9.0, 7.0)),
    ),
    "physical vehicle": lambda scenario, options: options["vehicle"] == "physical",
    "sensing within 2 m": lambda scenario, options: options["sensor_range"] == 2.0,
    "sensing within 5 m": lambda scenario, options: options["sensor_range"] == 5.0,
}
KNOWN = {"random missions", "corner missions", TRAINING}


def drawn(name, count=WORLDS):
    return [SHAPES[name].scenario(FIRST + k) for k in range(count)]


def test_every_shape_promises_something():
    assert set(SHAPES) == KNOWN | set(PROMISES)
    assert {shape.reference for shape in SHAPES.values()} == KNOWN
    assert FIRST >= HELD_OUT + 5_000_000


@pytest.mark.parametrize("name", PROMISES)
def test_a_shape_keeps_its_promise_and_training_worlds_do_not(name):
    own, trained = SHAPES[name], SHAPES[TRAINING]
    assert all(PROMISES[name](scenario, own.options) for scenario in drawn(name))
    share = np.mean([PROMISES[name](scenario, trained.options) for scenario in drawn(TRAINING, 300)])
    assert share <= 0.01


@pytest.mark.parametrize("name", SHAPES)
def test_what_a_shape_does_not_name_is_as_in_training(name):
    shape, trained, promise = SHAPES[name], SHAPES[TRAINING], PROMISES.get(name)
    changed = [key for key in trained.options if shape.options[key] != trained.options[key]]
    kinds = {"spheres": {"num_obstacles", "obstacle_radius"}, "vehicle and sensing": {"vehicle", "sensor_range"}}
    assert set(changed) <= kinds.get(shape.group, set())
    assert shape.missions == trained.missions or shape.group != "spheres"
    assert bool(changed) == (shape.group in kinds), promise
    for scenario in drawn(name, 20):
        inside = (np.abs(scenario.obstacles[:, :2]) <= 10.0).all(axis=1)
        inside &= (scenario.obstacles[:, 2] >= -5.0) & (scenario.obstacles[:, 2] <= 10.0)
        assert inside.all()
        if shape.group in ("starts and goals", TRAINING):
            assert spheres(20, 0.5, 1.5)(scenario, shape.options)
        assert is_solvable(scenario, World(), HYDRONE.radius)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [("60 spheres", 0.5, 1.5), ("60 small spheres", 0.2, 0.5), ("8 big spheres", 1.5, 2.5)],
)
def test_radii_fill_their_range(name, low, high):
    radii = np.concatenate([scenario.obstacles[:, 3] for scenario in drawn(name)])
    assert abs(radii.mean() - 0.5 * (low + high)) <= 0.05 * (high - low)
    assert radii.min() <= low + 0.02 * (high - low)
    assert radii.max() >= high - 0.02 * (high - low)


@pytest.mark.parametrize("name", ["short", "straight up or down", "close to the surface", "close to the walls"])
def test_random_ends_take_both_media_and_any_yaw(name):
    worlds = drawn(name, 200)
    media = {scenario.media for scenario in worlds}
    # the water is too shallow for 3 m up or down in it
    assert media == {(s, g) for s in ("air", "water") for g in ("air", "water")} - (
        {("water", "water")} if name == "straight up or down" else set()
    )
    yaw = np.array([scenario.start[3] for scenario in worlds])
    assert np.abs(yaw).max() <= np.pi
    assert np.histogram(yaw, bins=4, range=(-np.pi, np.pi))[0].min() >= 25
    assert min(abs(np.mean([scenario.start[axis] for scenario in worlds])) for axis in (0, 1)) <= 1.5


def test_random_ends_keep_the_rest_of_what_random_missions_keep():
    limits = {
        "short": (1.3, 1.0),
        "long in air": (1.3, 1.0),
        "long in water": (1.3, 1.0),
        "straight up or down": (1.3, 1.0),
        "close to the surface": (0.8, 1.0),
        "close to the walls": (1.3, 0.4),
    }
    for name, (surface, wall) in limits.items():
        for scenario in drawn(name, 100):
            assert min(heights(scenario)) >= surface
            assert min(to_side_walls(scenario)) >= wall - 1e-12
            assert min(scenario.start[2], scenario.goal[2]) >= -4.0
            assert max(scenario.start[2], scenario.goal[2]) <= 9.0
            assert apart(scenario) >= (8.0 if name.startswith("close") else 2.0)


def test_impossible_ends_are_an_error(monkeypatch):
    monkeypatch.setattr("benchmarks.world_shapes.BLOCKS", 3)
    with pytest.raises(ValueError, match=r"no ends found in 1536 draws: EndLaw\(.*distance=\(50\.0, 60\.0\)"):
        EndLaw(distance=(50.0, 60.0)).draw(np.random.default_rng(0))


@pytest.mark.parametrize(
    ("name", "first", "env_id"),
    [
        ("random missions", 0, "Mission"),
        ("corner missions", 0, "AirToWater"),
        ("corner missions", 1, "WaterToAir"),
        ("60 small spheres", (-FIRST) % 3, "Mission"),
        ("sensing within 2 m", (1 - FIRST) % 3, "AirToWater"),
    ],
)
def test_worlds_of_the_generators_laws_are_those_of_the_environment(name, first, env_id):
    shape = SHAPES[name]
    env = gym.make(f"HydroneGym/{env_id}-v0", **shape.options)
    for k in range(3):
        seed = FIRST + first + k * len(shape.missions)
        env.reset(seed=seed)
        assert env.unwrapped.scenario == shape.scenario(seed)


def test_denser_worlds_hold_the_spheres_of_sparser_ones():
    for sparse, dense in zip(drawn("10 spheres", 20), drawn("40 spheres", 20), strict=True):
        assert (sparse.start, sparse.goal) == (dense.start, dense.goal)
        assert np.array_equal(sparse.obstacles, dense.obstacles[:10])


@pytest.mark.parametrize("seed", [7, [7, 8, 9]])
def test_rows_begin_in_the_worlds_of_their_seeds(seed):
    rows = gym.make_vec(SHAPED, num_envs=3, vectorization_mode="vector_entry_point", shape="close to the walls")
    observation, _ = rows.reset(seed=seed)
    for row in range(3):
        scenario = SHAPES["close to the walls"].scenario(7 + row)
        assert tuple(observation["goal"][row]) == scenario.goal
        assert tuple(observation["state"][row, :3]) == scenario.start[:3]
        assert observation["state"][row, 5] == pytest.approx(scenario.start[3], abs=1e-12)
    assert rows.unwrapped.options == gym.make("HydroneGym/Mission-v0").unwrapped.options


def test_rows_without_seeds_fly_any_mission_with_the_spheres_of_the_shape():
    rows = gym.make_vec(SHAPED, num_envs=2, vectorization_mode="vector_entry_point", shape="10 spheres")
    observation, _ = rows.reset()
    assert observation["obstacles"].shape == (2, 10, 4)
