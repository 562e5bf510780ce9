"""The recorder: it changes nothing, and keeps trees that can be flown."""

from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pytest

import hydrone_gym  # noqa: F401
from hydrone_gym.evaluation import fly
from planners import CLRRT, PublishedCLRRT, StraightLine, TreeRecorder
from planners.cl_rrt.tree import new_nodes
from planners.shield import Shield


@pytest.fixture(scope="module")
def env():
    return gym.make("HydroneGym/WaterToAir-v0", num_obstacles=20)


@pytest.fixture(scope="module")
def recorded(env):
    recorder = TreeRecorder(CLRRT.for_env(env, seed=5))
    return fly(env, recorder, seed=5), recorder


def test_flights_are_the_same_with_and_without(env, recorded):
    flight, recorder = recorded
    plain = fly(env, CLRRT.for_env(env, seed=5), seed=5)
    np.testing.assert_array_equal(flight.states, plain.states)
    assert len(recorder.trees) == len(flight.references)


def test_trees_hold_together_and_lead_on_from_what_was_sent(recorded):
    flight, recorder = recorded
    for tree, reference in zip(recorder.trees, flight.references, strict=True):
        nodes = {tuple(node) for node in tree.edges[:, 1].tolist()}
        roots = {tuple(node) for node in tree.edges[:, 0].tolist()} - nodes
        assert len(roots) <= 1
        path = tree.edges[tree.path]
        assert len(path) > 0
        np.testing.assert_array_equal(path[1:, 0], path[:-1, 1])
        np.testing.assert_allclose(path[0, 1], reference[:3], atol=1e-5)
        np.testing.assert_array_equal(np.linalg.norm(path[-1, 1] - flight.scenario.goal) < 1.0, True)
    # from water to air: all of the first path's beginning is wet, all of the last one dry
    assert not recorder.trees[0].air[recorder.trees[0].path[0]]
    assert recorder.trees[-1].air.all()


def test_a_new_episode_drops_the_trees_of_the_one_before(env, recorded):
    _, recorder = recorded
    again = TreeRecorder(recorder.policy)
    fly(env, again, seed=6)
    second = fly(env, again, seed=5)
    assert len(again.trees) == len(second.references)
    for one, other in zip(again.trees, recorder.trees, strict=True):
        np.testing.assert_array_equal(one.edges, other.edges)


def test_other_policies(env):
    for policy, grows in (
        (PublishedCLRRT.for_env(env), True),
        (Shield.for_env(CLRRT.for_env(env), env), True),
        (StraightLine.for_env(env), False),
        (Shield.for_env(StraightLine.for_env(env), env), False),
    ):
        recorder = TreeRecorder(policy)
        observation, _ = env.reset(seed=1)
        action, state = recorder.predict(observation)
        np.testing.assert_array_equal(action, policy.predict(observation)[0])
        assert len(recorder.trees) == 1
        assert (len(recorder.trees[0].edges) > 0) == grows
        env.step(action)
        recorder.predict(observation, state, np.array([False]))
        assert len(recorder.trees) == 2


class Remembering:
    """A policy that remembers a tree of six nodes in a row, of which it has pruned the third and what hangs on it."""

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        nodes = new_nodes(10)
        nodes["reference"][:6, 0] = np.arange(6)
        nodes["parent"][:6] = (-1, 0, 1, 1, 2, 3)
        nodes["dead"][:6] = (0, 0, 1, 0, 1, 0)
        nodes["goal"][[4, 5]] = 1
        return np.zeros(4, np.float32), (SimpleNamespace(nodes=nodes, size=6),)


def test_pruned_branches_are_left_out():
    recorder = TreeRecorder(Remembering())
    recorder.predict({})
    (tree,) = recorder.trees
    np.testing.assert_array_equal(tree.edges[:, :, 0], [(0, 1), (1, 3), (3, 5)])
    np.testing.assert_array_equal(tree.path, [0, 1, 2])
