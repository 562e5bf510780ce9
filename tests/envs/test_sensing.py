"""Detection: what is observed, when, and in which order."""

import numpy as np
import pytest

from hydrone_gym import Scenario
from hydrone_gym.simulation.simulation import row_at, trajectory
from tests.envs.missions import begin, make

GOAL = (9.0, 0.0, 5.0)


def distances(path, spheres):
    """Least distance from each piece of a path (N, 3) to each sphere (M, 4), in m: the slow obvious way."""
    a, b = path[:-1, None], path[1:, None]
    move = b - a
    length2 = np.maximum((move**2).sum(-1), 1e-300)
    share = np.clip(((spheres[:, :3] - a) * move).sum(-1) / length2, 0.0, 1.0)
    return np.linalg.norm(spheres[:, :3] - a - share[..., None] * move, axis=-1) - spheres[:, 3]


def test_known_at_the_start_by_index_then_by_period():
    spheres = [(9.0, 6.0, 5.0, 1.0), (-8.0, 3.0, 5.0, 1.0), (0.0, 3.0, 5.0, 0.5), (-8.0, -2.5, 5.0, 1.0)]
    env, observation = begin(Scenario(start=(-8.0, 0.0, 5.0, 0.0), goal=GOAL, obstacles=spheres))
    np.testing.assert_array_equal(observation["obstacles"][:2], [spheres[1], spheres[3]])
    np.testing.assert_array_equal(observation["obstacles"][2:], 0.0)
    seen = [2]
    for _ in range(30):
        observation, _, terminated, *_ = env.step(np.array([*GOAL, 0.0]))
        seen.append(int((observation["obstacles"][:, 3] > 0.0).sum()))
        if terminated:
            break
    assert seen == sorted(seen)
    assert seen[-1] == 3
    np.testing.assert_array_equal(observation["obstacles"][2], spheres[2])


@pytest.mark.parametrize(("gap", "detected"), [(2.999, True), (3.001, False)])
def test_range_is_from_the_centre_to_the_surface(gap, detected):
    sphere = (-2.0 + gap + 1.0, 0.0, 5.0, 1.0)
    _, observation = begin(Scenario(start=(-2.0, 0.0, 5.0, 0.0), goal=GOAL, obstacles=[sphere]))
    assert (observation["obstacles"][0, 3] > 0.0) == detected


def test_sensor_range_is_an_option():
    env = make("AirToWater", sensor_range=100.0)
    observation, _ = env.reset(seed=1)
    np.testing.assert_array_equal(observation["obstacles"], env.scenario.obstacles)


@pytest.mark.parametrize("seed", range(6))
def test_against_the_whole_path(seed):
    """Random flights: detection, its order and the clearance are those of every 50 ms piece of the path."""
    env = make("Mission", rough_transition="count")
    observation, info = env.reset(seed=seed)
    rng = np.random.default_rng(seed)
    spheres, first = env.scenario.obstacles, observation["state"]
    order = list(np.flatnonzero(distances(np.array([first[:3]] * 2), spheres)[0] <= 3.0))
    references, path, ended = [], np.array([first[:3]] * 2), False
    for _ in range(60):
        np.testing.assert_array_equal(observation["obstacles"][: len(order)], spheres[order])
        np.testing.assert_array_equal(observation["obstacles"][len(order) :], 0.0)
        assert info["clearance"] == pytest.approx(distances(path, spheres).min() - env.vehicle.radius, abs=1e-9)
        if ended:
            break
        references.append(rng.uniform(env.action_space.low, env.action_space.high))
        observation, _, terminated, truncated, info = env.step(references[-1])
        ended = terminated or truncated
        row = row_at(first, np.array(env.scenario.goal))
        _, states, _, last = trajectory(env.simulation, row, np.array(references), spheres)
        path = states[:, :3]
        now = set(np.flatnonzero(distances(path, spheres).min(0) <= 3.0))
        order += sorted(now - set(order))
        # the same kernel: what is played tick by tick equals the steps
        np.testing.assert_array_equal(last["state"][0], observation["state"])
