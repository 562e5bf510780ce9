"""What is perceived with perfect senses: the truth itself, in the same memory, and nothing besides."""

import numpy as np

from hydrone_gym.perception import perceive
from hydrone_gym.perception.perceived import TOLD
from tests.envs.missions import make
from tests.envs.raw_observations import WORLD
from tests.simulation.batches import random_rows


def test_perfect_senses_share_the_rows_memory():
    env = make()
    observation, _ = env.reset(seed=2)
    core = env._core
    perceived, rows = core.perceived, core.episodes.rows
    for key, array in perceived.observation().items():
        np.testing.assert_array_equal(array[0], observation[key])
        assert np.shares_memory(array, core.episodes.known if key == "obstacles" else rows)
    env.step(env.action_space.sample())
    np.testing.assert_array_equal(perceived.state, rows["state"])
    np.testing.assert_array_equal(perceived.reference, rows["reference"])
    assert perceived.found is core.episodes.found


def test_nothing_else_of_a_row_is_told():
    perceived = perceive(random_rows(np.random.default_rng(0), 3, WORLD), np.zeros((3, 2, 4)), np.zeros(3, np.int64))
    assert perceived.told.dtype.names == TOLD
    assert tuple(perceived.observation()) == (*TOLD, "obstacles")
    for key in TOLD:
        assert np.shares_memory(getattr(perceived, key), perceived.told)


def test_one_row_and_many_are_told_in_one_memory_layout():
    """Kernels are compiled for a layout: a single row must not look contiguous where many do not."""
    for count in (1, 2, 17):
        told = perceive(random_rows(np.random.default_rng(0), count, WORLD), np.zeros((count, 0, 4)), None).told
        assert told.flags.c_contiguous
