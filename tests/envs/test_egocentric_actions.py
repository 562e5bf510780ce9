"""The egocentric interface: what is carried from period to period, and what an action means."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hydrone_gym.perception.egocentric import EgocentricMemory
from tests.envs.missions import same
from tests.envs.raw_observations import EGO, VAST_EGO, entry, random_raw, raw


def test_progress_clock():
    """Time-to-go over level air is the distance: it counts from the last new least, not from the last fall."""
    memory, clocks = None, []
    for x in (0.0, 1.0, 1.0, 0.0, 0.5, 0.99, 1.5, 1.4, 2.0):
        flat, memory = EGO.observe(raw([x, 0.0, 5.0], (8.0, 0.0, 5.0)), memory)
        clocks.append(10 * entry(flat, "clock"))
        assert memory.clock == pytest.approx(clocks[-1], abs=1e-6)
    assert clocks == pytest.approx([0, 0, 1, 2, 3, 4, 0, 1, 0], abs=1e-6)
    assert memory.least == pytest.approx(6.0 / 1.8)
    np.testing.assert_array_equal(memory.start, [0.0, 0.0, 5.0])


def test_clock_saturates():
    flat, _ = EGO.observe(raw([0.0, 0.0, 5.0], (8.0, 0.0, 5.0)), EgocentricMemory(np.zeros(3), 1.0, 200.0))
    assert entry(flat, "clock") == 5.0


def test_starting_drops_the_memory_of_those_rows_only():
    batch, starts = random_raw(np.random.default_rng(3), 4)
    old = EgocentricMemory(starts, np.full(4, 0.5), np.full(4, 7.0))
    where = np.array([False, True, False, True])
    flat, memory = EGO.observe(batch, old, where)
    fresh, begun = EGO.observe(batch)
    kept, carried = EGO.observe(batch, old)
    assert same(flat, np.where(where[:, None], fresh, kept))
    assert same(memory.start, np.where(where[:, None], begun.start, carried.start))
    assert same(memory.least, np.where(where, begun.least, carried.least))
    np.testing.assert_array_equal(memory.clock, [8.0, 0.0, 8.0, 0.0])


def test_nothing_is_changed_or_shared():
    observation, start = random_raw(np.random.default_rng(4))
    memory = EgocentricMemory(start, np.float64(1.0), np.float64(2.0))
    before = pickle.dumps((observation, memory))
    flat, after = EGO.observe(observation, memory)
    place = EGO.reference(np.zeros(3), observation, after)
    assert pickle.dumps((observation, memory)) == before
    assert same(EGO.observe(observation, memory), (flat, after))
    given = [*observation.values(), *memory]
    for result in (flat, place, *after):
        assert not any(np.shares_memory(result, array) for array in given)


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 10_000), arrays(np.float32, 3, elements=st.floats(-1.0, 1.0, width=32)))
def test_action_can_be_read_back_from_the_reference(seed, action):
    observation, start = random_raw(np.random.default_rng(seed))
    place = VAST_EGO.reference(action, observation, EgocentricMemory(start, 1.0, 0.0)).astype(float)
    x, y, z = place[:3] - observation["state"][:3]
    way = observation["goal"][:2] - start[:2]
    c, s = way / np.linalg.norm(way)
    np.testing.assert_allclose([(c * x + s * y) / 2, (c * y - s * x) / 2, z / 1.5], action, atol=2e-6)


def test_reference_stays_inside_the_box():
    observation = raw([9.5, -9.5, -4.5], (9.5, 9.5, 5.0))  # x' is +y, y' is -x
    memory = EgocentricMemory(np.array([9.5, -9.5, -4.5]), 1.0, 0.0)
    place = EGO.reference([-1.0, -1.0, -1.0], observation, memory)
    np.testing.assert_allclose(place[:3], [9.8, -9.8, -4.8], atol=1e-6)


def test_action_is_clipped_to_its_space():
    observation = raw([0.0, 0.0, 4.0], (8.0, 0.0, 4.0))
    _, memory = EGO.observe(observation)
    np.testing.assert_array_equal(EGO.reference([1.5, -9.0, 1e30], observation, memory)[:3], [2.0, -2.0, 5.5])


def test_yaw_reference_is_kept_in_air_and_is_the_heading_in_water():
    for z, expected in ((2.0, 0.25), (-2.0, 1.5)):
        observation = raw([0, 0, z, 0, 0, 1.5], reference=(0.0, 0.0, z, 0.25))
        place = EGO.reference(np.zeros(3), observation, EgocentricMemory(np.zeros(3), 1.0, 0.0))
        assert place.dtype == np.float32
        assert place[3] == np.float32(expected)
