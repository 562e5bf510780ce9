"""The native vector environment: every row is the single environment, in Gymnasium's conventions."""

import itertools
import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from hydrone_gym import Outcome
from hydrone_gym.envs import batch
from hydrone_gym.simulation.rows import advance_rows
from hydrone_gym.world.generator import ScenarioLaw, generate, place_many
from hydrone_gym.world.world import World

ID = "HydroneGym/Mission-v0"


def native(count, **options):
    return gym.make_vec(ID, num_envs=count, vectorization_mode="vector_entry_point", **options)


def assert_same(a, b, where="returned"):
    """Equal to the bit, dicts and object arrays entry by entry."""
    if isinstance(a, dict):
        assert set(a) == set(b), f"{where}: {set(a) ^ set(b)}"
        for key in a:
            assert_same(a[key], b[key], f"{where}[{key!r}]")
        return
    a, b = np.asarray(a), np.asarray(b)
    if a.dtype != object and b.dtype != object:
        np.testing.assert_array_equal(a, b, err_msg=where)
        return
    for x, y in zip(a, b, strict=True):
        if isinstance(x, dict | np.ndarray):
            assert_same(x, y, where)
        else:  # an absent outcome is 0 in an integer array, None in an object array
            assert x == y or (not x and not y), where


class Walk:
    """Random references around each vehicle, in either interface."""

    def __init__(self, seed, space, interface):
        self.rng, self.space, self.interface = np.random.default_rng(seed), space, interface

    def __call__(self, observation, count):
        if self.interface == "egocentric":
            return self.rng.uniform(-1.0, 1.0, (count, 3)).astype(np.float32)
        position = observation["state"][:, :3]
        references = np.column_stack([position + 2.0 * self.rng.normal(size=(count, 3)), np.zeros(count)])
        return np.clip(references, self.space.low, self.space.high).astype(np.float32)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
@pytest.mark.parametrize("interface", ["world", "egocentric"])
def test_conventions_are_those_of_sync_vector_env(mode, interface):
    ours = native(5, autoreset_mode=mode, interface=interface)
    sync = gym.make_vec(
        ID, num_envs=5, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}, interface=interface
    )
    (observation, info), (expected, expected_info) = ours.reset(seed=3), sync.reset(seed=3)
    assert_same(observation, expected)
    assert_same(info, expected_info)
    walk, ended = Walk(0, ours.single_action_space, interface), 0
    for _ in range(200):
        actions = walk(observation, 5)
        returned, wanted = ours.step(actions), sync.step(actions)
        for part, other in zip(returned, wanted, strict=True):
            assert_same(part, other)
        observation = returned[0]
        ended += int((returned[2] | returned[3]).sum())
    assert ended > 5


@pytest.mark.parametrize(("count", "threads"), [(1, 1), (7, 1), (64, 1), (64, 2)])
def test_rows_are_single_environments_through_resets(count, threads, monkeypatch):
    monkeypatch.setattr(batch, "_ROWS_A_THREAD", 16)
    steps = 1000 if count <= 7 else 150
    rows = native(count, threads=threads, time_limit=30.0)
    chosen = range(min(count, 4)) if count <= 7 else (0, 15, 16, 63)
    singles = {k: gym.make(ID, time_limit=30.0) for k in chosen}
    observation, _ = rows.reset(seed=20)
    for k, env in singles.items():
        assert_same({key: value[k] for key, value in observation.items()}, env.reset(seed=20 + k)[0])
    walk, over, ended = Walk(1, rows.single_action_space, "world"), np.zeros(count, bool), 0
    for _ in range(steps):
        actions = walk(observation, count)
        observation, rewards, terminated, truncated, _ = rows.step(actions)
        for k, env in singles.items():
            if over[k]:
                expected, reward, done = env.reset()[0], 0.0, False
            else:
                expected, reward, one, other, _ = env.step(actions[k])
                done = one or other
            assert_same({key: value[k] for key, value in observation.items()}, expected)
            assert rewards[k] == reward
            assert (terminated[k] or truncated[k]) == done
            ended += done
        over = terminated | truncated
    assert ended > 3


@pytest.mark.parametrize("interface", ["world", "egocentric"])
@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_threads_change_nothing(mode, interface, monkeypatch):
    """Five threads, the last part of another length, against one: every array and object a step returns."""
    monkeypatch.setattr(batch, "_ROWS_A_THREAD", 16)
    one, many = (native(93, threads=k, autoreset_mode=mode, interface=interface, time_limit=20.0) for k in (1, 5))
    assert [len(rows._core.simulations) for rows in (one, many)] == [1, 5]
    (observation, _), other = one.reset(seed=6), many.reset(seed=6)
    assert_same(observation, other[0])
    walk, ended = Walk(2, one.single_action_space, interface), 0
    for _ in range(60):
        actions = walk(observation, 93)
        returned = one.step(actions)
        for part, twin in zip(returned, many.step(actions), strict=True):
            assert_same(part, twin)
        observation = returned[0]
        ended += int((returned[2] | returned[3]).sum())
    assert ended > 93


@pytest.mark.parametrize("interface", ["world", "egocentric"])
def test_copies_go_on_alike(interface, monkeypatch):
    """What shares memory inside shares it in a copy too, threads included."""
    monkeypatch.setattr(batch, "_ROWS_A_THREAD", 16)
    rows = native(40, threads=2, interface=interface)
    observation, _ = rows.reset(seed=1)
    walk = Walk(4, rows.single_action_space, interface)
    for _ in range(20):
        observation = rows.step(walk(observation, 40))[0]
    twin = pickle.loads(pickle.dumps(rows))
    for _ in range(20):
        actions = walk(observation, 40)
        returned = rows.step(actions)
        for part, other in zip(returned, twin.step(actions), strict=True):
            assert_same(part, other)
        observation = returned[0]
    assert len(place_many.signatures) == 1, "a copy draws with what is compiled"


def test_references_pass_through_a_filter():
    rows, twin = native(4, time_limit=2.0), native(4, time_limit=2.0)
    begun, told = [], []

    def halfway(perceived, references, starting):
        begun.append(starting)
        told.append(perceived)
        return 0.5 * (references + perceived.reference)

    rows.filter_references(halfway)
    observation, _ = rows.reset(seed=3)
    twin.reset(seed=3)
    for _ in range(7):
        goal = np.column_stack([observation["goal"], np.zeros(4)]).astype(np.float32)
        kept = {key: value.copy() for key, value in told[-1].observation().items()} if told else observation
        assert_same(kept, observation)
        expected = twin.step(0.5 * (goal.astype(np.float64) + observation["reference"]))
        returned = rows.step(goal)
        for part, other in zip(returned, expected, strict=True):
            assert_same(part, other)
        observation = returned[0]
    np.testing.assert_array_equal([where.all() for where in begun], [k in (0, 5) for k in range(7)])
    rows.filter_references(None)
    assert_same(rows.step(goal)[0], twin.step(goal)[0])
    assert len(begun) == 7


def test_disabled_autoreset_and_masks():
    rows = native(4, autoreset_mode="Disabled", time_limit=1.0)
    observation, _ = rows.reset(seed=5)
    hold = observation["reference"].astype(np.float32)
    rows.step(hold)
    _, _, _, truncated, _ = rows.step(hold)
    assert truncated.all()
    with pytest.raises(ResetNeeded, match=r"rows \[0, 1, 2, 3\] ended: reset them with a reset_mask"):
        rows.step(hold)
    mask = np.array([True, False, True, False])
    after, info = rows.reset(options={"reset_mask": mask})
    np.testing.assert_array_equal(info["_outcome"], mask)
    assert not np.array_equal(after["goal"][0], observation["goal"][0])
    np.testing.assert_array_equal(after["goal"][1], observation["goal"][1])
    with pytest.raises(ResetNeeded, match=r"rows \[1, 3\] ended"):
        rows.step(hold)
    rows.reset(options={"reset_mask": ~mask})
    rows.step(hold)


def test_scenarios_a_row():
    world = World()
    laws = [ScenarioLaw(num_obstacles=k) for k in (0, 3)]
    scenarios = [generate(law, world, 0.45, np.random.default_rng(k)) for k, law in enumerate(laws)]
    rows = native(3)
    observation, info = rows.reset(seed=0, options={"scenario": [*scenarios, None]})
    for k, scenario in enumerate(scenarios):
        single = gym.make(ID)
        expected, expected_info = single.reset(options={"scenario": scenario})
        assert_same({key: value[k] for key, value in observation.items()}, expected)
        assert info["clearance"][k] == expected_info["clearance"]
        for _ in range(5):
            hold = expected["reference"].astype(np.float32)
            expected = single.step(hold)[0]
    assert np.isinf(info["clearance"][0])


def test_returned_arrays_are_new():
    rows = native(6)
    first, _ = rows.reset(seed=0)
    actions = first["reference"].astype(np.float32)
    held = [rows.step(actions) for _ in range(3)]
    arrays = [[*step[0].values(), *step[1:4], step[4]["clearance"], step[4]["outcome"]] for step in held]
    for earlier, later in itertools.pairwise(arrays):
        for a, b in zip(earlier, later, strict=True):
            assert not np.shares_memory(a, b)
    assert all(array in rows.observation_space[key] for key, array in held[-1][0].items())


def test_nothing_is_compiled_again_for_another_number_of_rows():
    rows = native(3)
    rows.reset(seed=0)
    rows.step(np.zeros((3, 4), np.float32))
    before = len(advance_rows.signatures)
    for count in (1, 17, 40):
        rows = native(count)
        rows.reset(seed=0)
        rows.step(np.zeros((count, 4), np.float32))
    assert len(advance_rows.signatures) == before


def test_one_bad_row_harms_no_other():
    rows, twin = native(3), native(3)
    observation, _ = rows.reset(seed=4)
    twin.reset(seed=4)
    good = observation["reference"].astype(np.float32)
    bad = good.copy()
    bad[1, 2] = np.nan
    with pytest.raises(ValueError, match=r"rows \[1\] are not"):
        rows.step(bad)
    assert_same(rows.step(good)[0], twin.step(good)[0])


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: native(0), ValueError, "num_envs must be a whole number of at least 1, got 0"),
        (lambda: native(2.5), ValueError, "num_envs must be a whole number of at least 1, got 2.5"),
        (lambda: native(2, threads=0), ValueError, "threads must be a whole number of at least 1, got 0"),
        (
            lambda: native(100_000_000),
            ValueError,
            "num_envs must be at most 1000000: every row is stored whole, got 1000",
        ),
        (lambda: native(2, max_episode_steps=0), ValueError, "max_episode_steps must be a whole number of at least 1"),
        (
            lambda: native(2, no_such=1),
            TypeError,
            "unknown option 'no_such'; known are num_envs, mission, num_obst.*_steps$",
        ),
        (lambda: native(2, autoreset_mode="never"), ValueError, "never"),
        (lambda: native(2).step(np.zeros((2, 4))), ResetNeeded, "called before reset"),
    ],
)
def test_bad_options(make, error, message):
    with pytest.raises(error, match=message):
        make()


def test_bad_requests():
    rows = native(2)
    with pytest.raises(ValueError, match="seed must be one number or 2 of them, got 3"):
        rows.reset(seed=[1, 2, 3])
    with pytest.raises(ValueError, match="known are 'scenario', 'reset_mask'"):
        rows.reset(options={"wind": 1})
    with pytest.raises(ValueError, match=r"reset_mask must have shape \(2,\)"):
        rows.reset(options={"reset_mask": np.ones(3, bool)})
    with pytest.raises(TypeError, match="reset_mask must be an array of bool"):
        rows.reset(options={"reset_mask": [True, False]})
    rows.reset(seed=0)
    with pytest.raises(ValueError, match=r"actions must have shape \(2, 4\)"):
        rows.step(np.zeros((2, 3)))


def test_max_episode_steps_replaces_the_time_limit():
    rows = native(2, max_episode_steps=3)
    observation, _ = rows.reset(seed=0)
    for k in range(3):
        _, _, _, truncated, info = rows.step(observation["reference"].astype(np.float32))
        assert truncated.all() == (k == 2)
    assert (info["outcome"] == Outcome.TIMEOUT).all()
