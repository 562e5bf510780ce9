"""The egocentric interface of many rows is that of a raw observation, bit for bit."""

import numpy as np
import pytest

from hydrone_gym.envs.spaces import egocentric_space
from hydrone_gym.perception.egocentric import (
    LEAST,
    OBSERVATION_SIZE,
    Egocentric,
    EgocentricMemory,
    new_memory,
    observe_rows,
    place_references,
)
from hydrone_gym.perception.perceived import perceive
from tests.envs.missions import AIR_TO_AIR, DIVE, SPHERE_BETWEEN, begin, same
from tests.envs.raw_observations import EGO, WORLD, random_raw
from tests.simulation.batches import random_rows


@pytest.mark.parametrize("scenario", [AIR_TO_AIR, SPHERE_BETWEEN, DIVE])
def test_rows_and_raw_observations_agree_bit_for_bit(scenario):
    """A flight of the raw environment, seen from its storage and from what it returns."""
    env, observation = begin(scenario, rough_transition="count")
    ego, rng = Egocentric(env.simulation), np.random.default_rng(8)
    now, memory = env._core.episodes, None
    carried, seen = new_memory(1), np.empty((1, OBSERVATION_SIZE), np.float32)
    perceived = perceive(now.rows, now.known, now.found)
    for _ in range(40):
        ego.look(perceived, carried, np.arange(1), seen)
        flat, memory = ego.observe(observation, memory)
        assert same(flat, seen[0])
        assert flat in egocentric_space()
        action = rng.uniform(-0.2, 1.0, (1, 3)).astype(np.float32)
        place = ego.place(perceived, carried, action)
        reference = ego.reference(action[0], observation, memory)
        assert same(reference.astype(np.float64), place[0])
        assert reference in env.action_space
        observation, _, terminated, truncated, _ = env.step(reference)
        assert same(observation["reference"], place[0])
        if terminated or truncated:
            break
    assert np.concatenate((memory.start, [memory.least, memory.clock])).tobytes() == carried.tobytes()


@pytest.mark.parametrize("count", [1, 7, 64])
def test_a_batch_is_its_rows_bit_for_bit(count):
    rng = np.random.default_rng(count)
    batch, starts = random_raw(rng, count)
    batch["obstacles"][::2, 5:] = 0.0
    action = rng.uniform(-1.0, 1.0, (count, 3)).astype(np.float32)
    memory = EgocentricMemory(starts, rng.uniform(0.0, 20.0, count), np.arange(float(count)))
    flat, after = EGO.observe(batch, memory)
    places = EGO.reference(action, batch, after)
    assert flat.dtype == places.dtype == np.float32
    for n in range(count):
        single = {key: value[n] for key, value in batch.items()}
        one, own = EGO.observe(single, EgocentricMemory(*(part[n] for part in memory)))
        assert same(one, flat[n])
        assert all(a.tobytes() == b[n].tobytes() for a, b in zip(own, after, strict=True))
        assert same(EGO.reference(action[n], single, own), places[n])


def test_rows_that_are_not_looked_at_are_left_alone():
    rng = np.random.default_rng(2)
    rows, memory, seen = random_rows(rng, 5, WORLD), new_memory(5), np.full((5, OBSERVATION_SIZE), 9.0, np.float32)
    rows["goal"] = 1.0
    memory[:3, LEAST], memory[:, LEAST + 1] = 0.0, 3.0
    before, perceived = memory.copy(), perceive(rows, np.zeros((5, 2, 4)), np.zeros(5, np.int64))
    EGO.look(perceived, memory, np.array([1, 3]), seen)
    assert (seen[[1, 3]] <= 5.0).all()
    assert (seen[[0, 2, 4]] == 9.0).all()
    np.testing.assert_array_equal(memory[[0, 2, 4]], before[[0, 2, 4]])
    np.testing.assert_array_equal(memory[:, LEAST + 1], [3.0, 4.0, 3.0, 0.0, 3.0])
    np.testing.assert_array_equal(memory[3, :3], rows["state"][3, :3])


def test_every_caller_shares_one_compiled_version():
    batch, _ = random_raw(np.random.default_rng(0), 3)
    _, memory = EGO.observe({key: value.astype(np.float32) for key, value in batch.items()})
    turned_storage = {key: np.asfortranarray(value) for key, value in batch.items()}
    EGO.observe(turned_storage, EgocentricMemory(*map(np.asfortranarray, memory)), [0, 1, 0])
    EGO.reference(np.zeros((3, 3), int), turned_storage, memory)
    assert len(observe_rows.signatures) == len(place_references.signatures) == 1
