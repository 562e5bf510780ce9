"""Copies, pickles, snapshots and seeds: everything goes on bit for bit."""

import copy
import pickle

import gymnasium as gym
import numpy as np
import pytest

from hydrone_gym.envs.task import settle
from hydrone_gym.simulation.rows import advance_rows
from tests.envs.missions import DIVE, IDS, begin, fly_to, make, same, wander

STEPS = 50


def flying(name="Mission"):
    """An environment some way into an episode, with a crossing and detections behind it."""
    env = make(name, rough_transition="count", vertical_mode=False)
    env.reset(seed=7)
    wander(env, 37, seed=8)
    return env


@pytest.mark.parametrize(
    "how", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))], ids=["deepcopy", "pickle"]
)
def test_copies_go_on_alike(how):
    env = flying()
    twin = how(env)
    assert same(wander(env, STEPS, 9), wander(twin, STEPS, 9))


def test_copy_before_reset():
    env = make()
    twin = pickle.loads(pickle.dumps(env))
    assert same(env.reset(seed=1), twin.reset(seed=1))


def test_wrapped_environments_copy_too():
    env = gym.make(IDS[0])
    env.reset(seed=1)
    twin = copy.deepcopy(env)
    assert same(wander(env, 10, 2), wander(twin, 10, 2))


def test_restore_goes_on_alike_again_and_again():
    env = flying()
    snapshot = env.get_state()
    expected = wander(env, STEPS, 9)
    assert len(expected) > STEPS, "the flight should end at least once, so that new scenarios are drawn"
    for _ in range(2):
        env.reset()
        env.set_state(snapshot)
        assert env.scenario is snapshot.scenario
        assert same(wander(env, STEPS, 9), expected)


def test_restore_elsewhere_from_a_pickle():
    env = flying()
    snapshot = pickle.loads(pickle.dumps(env.get_state()))
    expected = wander(env, STEPS, 9)
    other = make(rough_transition="count", vertical_mode=False)  # never reset
    other.set_state(snapshot)
    assert other.scenario == snapshot.scenario
    assert other.np_random_seed == 7
    assert same(wander(other, STEPS, 9), expected)


def test_snapshot_keeps_crossings_detection_and_the_end():
    env, _ = begin(DIVE)
    infos = [entry[4] for entry in fly_to(env, (*DIVE.start[:2], -3.0, 0.0), 20)]
    assert len(infos[-1]["transitions"]) == 1
    snapshot = env.get_state()
    env.reset()
    env.set_state(snapshot)
    *_, info = env.step(np.array([-5.0, 0.0, -3.0, 0.0]))
    assert info["transitions"] == infos[-1]["transitions"]
    info["transitions"][0]["time"] = -1.0
    assert snapshot.transitions[0]["time"] > 0.0
    *_, later = env.step(np.array([-5.0, 0.0, -3.0, 0.0]))
    assert later["transitions"] == infos[-1]["transitions"]


def test_snapshots_of_other_environments_are_refused():
    env = make(num_obstacles=3)
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"other options: num_obstacles \(snapshot 3, here 20\)"):
        make().set_state(env.get_state())
    with pytest.raises(TypeError, match=r"snapshot must come from get_state\(\), got dict"):
        env.set_state({})


@pytest.mark.parametrize("name", IDS)
def test_seeds_decide_everything(name):
    first, second = gym.make(name), gym.make(name)
    assert same(first.reset(seed=11), second.reset(seed=11))
    assert first.unwrapped.scenario == second.unwrapped.scenario
    assert same(wander(first, 100, 3), wander(second, 100, 3))
    obstacles = first.unwrapped.scenario.obstacles
    second.reset(seed=12)
    assert not np.array_equal(second.unwrapped.scenario.obstacles, obstacles)


def test_unpickled_arrays_need_no_new_compilation():
    env = flying()
    before = len(settle.signatures), len(advance_rows.signatures)
    twin = pickle.loads(pickle.dumps(env))
    wander(twin, 5, 1)
    twin.set_state(pickle.loads(pickle.dumps(twin.get_state())))
    wander(twin, 5, 1)
    assert (len(settle.signatures), len(advance_rows.signatures)) == before
