"""Swept collision and sensing against brute force: the path of a tick, sampled densely."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hydrone_gym._jit import kernel
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.simulation import Simulation, row_at, trajectory
from hydrone_gym.vehicle import HYDRONE
from hydrone_gym.world.bodies import segment_distance
from hydrone_gym.world.world import World
from tests.simulation.batches import play, random_references, random_rows

WORLD = World()
points = st.tuples(*[st.floats(-5.0, 5.0, allow_nan=False)] * 3).map(np.array)


@kernel
def swept(a, b, sphere):
    return segment_distance(a, b, sphere)


def sampled(a, b, sphere, count=2001):
    path = a + np.linspace(0.0, 1.0, count)[:, None] * (b - a)
    return np.linalg.norm(path - sphere[:3], axis=1).min() - sphere[3]


@settings(max_examples=300, deadline=None)
@given(a=points, b=points, centre=points, radius=st.floats(0.1, 2.0))
def test_swept_distance_is_the_least_over_the_path(a, b, centre, radius):
    sphere = np.array([*centre, radius])
    brute = sampled(a, b, sphere)
    exact = swept(a, b, sphere)
    spacing = np.linalg.norm(b - a) / 2000
    assert brute - spacing - 1e-9 <= exact <= brute + 1e-9


def test_swept_distance_of_a_point():
    here = np.array([1.0, 2.0, 3.0])
    assert swept(here, here, np.array([1.0, 2.0, 5.0, 0.5])) == 1.5
    assert swept(here, here, np.array([1.0, 2.0, 3.0, 0.5])) == -0.5


def test_clearance_and_sensing_equal_dense_sampling():
    """Each row against its own spheres: from the states of every tick, 50 points a tick."""
    rng = np.random.default_rng(30)
    count, spheres = 48, 10
    rows = random_rows(rng, count, WORLD)
    references = np.stack([random_references(rng, count, WORLD) for _ in range(4)])
    obstacles = rng.uniform(-4.0, 4.0, (count, spheres, 3)) + rows["state"][:, None, :3]
    obstacles = np.concatenate([obstacles, rng.uniform(0.2, 1.0, (count, spheres, 1))], axis=2)
    after, closest = play(Simulation(HYDRONE, WORLD, lanes=16), rows, references, obstacles)
    single = Simulation(HYDRONE, WORLD)
    collided = 0
    for i in range(count):
        _, states, _, row = trajectory(single, rows[i : i + 1], references[:, i], obstacles[i])
        ends = states[:, None, :3]
        path = (ends[:-1] + np.linspace(0.0, 1.0, 50)[:, None] * (ends[1:] - ends[:-1])).reshape(-1, 3)
        distances = np.linalg.norm(path[:, None] - obstacles[i, :, :3], axis=2) - obstacles[i, :, 3]
        np.testing.assert_allclose(closest[i], distances.min(axis=0), rtol=0, atol=2e-3)
        assert after["clearance"][i] == pytest.approx(closest[i].min() - HYDRONE.radius, abs=1e-12)
        collision = row["outcome"][0] == Outcome.COLLISION
        assert collision == (after["clearance"][i] <= 0.0)
        collided += collision
    assert 5 < collided < count - 5


def test_no_tunnelling_through_a_small_sphere():
    """At 20 m/s a tick spans a metre, more than the sphere: sampling ends of ticks would miss it."""
    start = np.array([-5.0, 0.0, 5.0, 0.0, 0.0, 0.0, 20.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    sphere = np.array([[-1.5, HYDRONE.radius, 5.0, 0.05]])
    _, _, _, row = trajectory(Simulation(HYDRONE, WORLD), row_at(start), [[5.0, 0.0, 5.0, 0.0]], sphere)
    assert row["outcome"][0] == Outcome.COLLISION


@pytest.mark.parametrize(
    ("start", "outcome"),
    [
        ((9.9, 0.0, 5.0, 3.0, 0.0, 0.0), Outcome.OUT_OF_BOUNDS),
        ((0.0, 0.0, 0.02, 0.5, 0.0, -0.5), Outcome.ROUGH_TRANSITION),
        ((0.0, 0.0, -0.02, 0.5, 0.0, 0.5), Outcome.ROUGH_TRANSITION),
        ((0.0, 0.0, 0.02, 0.0, 0.0, -0.5), Outcome.RUNNING),
        ((1.0, 1.0, 5.0, 0.0, 0.0, 0.0), Outcome.GOAL),
    ],
)
def test_outcomes(start, outcome):
    x, y, z, vx, vy, vz = start
    state = np.array([x, y, z, 0.0, 0.0, 0.0, vx, vy, vz, 0.0, 0.0, 0.0])
    row, reference = row_at(state, np.array([1.2, 1.2, 5.2])), [[x, y, z + np.sign(vz), 0.0]]
    _, _, _, after = trajectory(Simulation(HYDRONE, WORLD), row, reference)
    assert Outcome(int(after["outcome"][0])) == outcome
    if "ROUGH" in outcome.name:
        _, _, _, counted = trajectory(Simulation(HYDRONE, World(rough_transition="count")), row, reference)
        assert counted["outcome"][0] == Outcome.RUNNING
        assert counted["crossings"][0] >= 1
        log = counted["crossing_log"][0, 0]
        assert log[1] == np.sign(vz)
        assert log[2] > WORLD.rough_speed
