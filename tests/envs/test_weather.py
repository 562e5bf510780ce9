"""Weather in the environments: the same for every row and process, drawn from the seed alone, and told to nobody."""

import copy
import dataclasses
import json
import pickle
import subprocess
import sys
import warnings
from typing import NamedTuple

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_sb3

from hydrone_gym import Scenario, Weather
from hydrone_gym._jit import inlined
from hydrone_gym.envs import batch
from hydrone_gym.weather.disturbance import register
from hydrone_gym.weather.weather import LEVELS
from hydrone_gym.world.scenario import load_scenario, save_scenario
from tests.envs.missions import DIVE, IDS, make, same, wander
from tests.envs.test_interface import WORLD_ACTIONS
from tests.envs.test_vector_env import ID, Walk, assert_same, native

LEVEL = pytest.mark.parametrize("level", range(6))
SWELL = Weather(wind=3.0, current=0.2, wave_height=0.2, sea="jonswap", shear=True)
GALE = dataclasses.replace(DIVE, weather=SWELL)


class Column(NamedTuple):
    """Air that rises by so much within so many metres of the middle."""

    speed: float
    width: float


@inlined
def _rising(column, chance, place, time):
    near = (place[0] * place[0] + place[1] * place[1]) / (column.width * column.width)
    return (0.0, 0.0, column.speed / (1.0 + near)), (0.1 * chance[0], 0.0, 0.0)


register(Column, _rising)


def singles_beside(rows, envs, steps, **reset):
    """Fly rows of a vector environment and single ones alike; everything must be equal through their resets."""
    count, interface = rows.num_envs, envs[0].unwrapped.options.interface
    observation, info = rows.reset(**reset)
    for k, env in enumerate(envs):
        expected = env.reset(seed=reset["seed"] + k, options=row_options(reset.get("options"), k))
        assert_same(row_of(observation, k), expected[0])
        assert_same(row_of(info.get("weather", {}), k), expected[1].get("weather", {}))
    walk, over, ended = Walk(1, rows.single_action_space, interface), np.zeros(count, bool), 0
    for _ in range(steps):
        actions = walk(observation, count)
        observation, rewards, terminated, truncated, info = rows.step(actions)
        for k, env in enumerate(envs):
            if over[k]:
                expected, told = env.reset()
                reward, done = 0.0, False
            else:
                expected, reward, one, other, told = env.step(actions[k])
                done = one or other
            assert_same(row_of(observation, k), expected)
            assert_same(row_of(info.get("weather", {}), k), told.get("weather", {}))
            assert rewards[k] == reward
            assert info["energy"][k] == told["energy"]
            assert (terminated[k] or truncated[k]) == done
            ended += done
        over = terminated | truncated
    return ended


def row_of(arrays, k):
    """Row k of a dict of arrays without its masks, or of an array."""
    if not isinstance(arrays, dict):
        return arrays[k]
    return {key: value[k] for key, value in arrays.items() if not key.startswith("_")}


def row_options(options, k):
    return None if options is None else {"scenario": options["scenario"][k]} if options["scenario"][k] else None


@LEVEL
@pytest.mark.parametrize("interface", ["world", "egocentric"])
def test_rows_are_single_environments(level, interface):
    options = {"weather": level, "interface": interface, "time_limit": 20.0}
    rows, envs = native(5, **options), [make(**options) for _ in range(5)]
    assert singles_beside(rows, envs, 90, seed=30) > 5


@pytest.mark.parametrize(
    "weather", [LEVELS[4], dataclasses.replace(SWELL, extra=Column(2.0, 3.0))], ids=["level", "extra"]
)
@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_conventions_are_those_of_sync_vector_env(mode, weather):
    ours = native(5, autoreset_mode=mode, weather=weather, time_limit=20.0)
    keywords = {"autoreset_mode": mode}
    sync = gym.make_vec(
        ID, num_envs=5, vectorization_mode="sync", vector_kwargs=keywords, weather=weather, time_limit=20.0
    )
    (observation, info), (expected, expected_info) = ours.reset(seed=3), sync.reset(seed=3)
    assert_same(observation, expected)
    assert_same(info, expected_info)
    walk, ended = Walk(0, ours.single_action_space, "world"), 0
    for _ in range(100):
        actions = walk(observation, 5)
        returned, wanted = ours.step(actions), sync.step(actions)
        for part, other in zip(returned, wanted, strict=True):
            assert_same(part, other)
        observation = returned[0]
        ended += int((returned[2] | returned[3]).sum())
    assert ended > 5


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_threads_change_nothing(mode, monkeypatch):
    monkeypatch.setattr(batch, "_ROWS_A_THREAD", 16)
    one, two = (native(45, threads=k, autoreset_mode=mode, weather=5, time_limit=10.0) for k in (1, 2))
    assert len(two._core.simulations) == 2
    observation, _ = one.reset(seed=6)
    two.reset(seed=6)
    walk = Walk(2, one.single_action_space, "world")
    for _ in range(50):
        actions = walk(observation, 45)
        returned = one.step(actions)
        for part, twin in zip(returned, two.step(actions), strict=True):
            assert_same(part, twin)
        observation = returned[0]


FLIGHT = """
import gymnasium, json, sys, numpy, hydrone_gym
env = gymnasium.make("HydroneGym/Mission-v0", weather=4).unwrapped
told = []
env.reset(seed=12)
for k in range(60):
    *_, over, late, info = env.step(numpy.array([k % 7 - 3.0, k % 5 - 2.0, 4.0 if k < 30 else -2.0, 0.1]))
    wind, water = info["weather"]["wind"].tolist(), info["weather"]["water"].tolist()
    told.append([env.truth["state"].tolist(), wind, water, info["energy"]])
    if over or late:
        env.reset()
json.dump(told, sys.stdout)
"""


def test_every_process_has_the_same_weather():
    first, second = (
        subprocess.run([sys.executable, "-c", FLIGHT], capture_output=True, text=True, timeout=120, check=True).stdout
        for _ in range(2)
    )
    assert json.loads(first) == json.loads(second)
    assert len(json.loads(first)) == 60


def weathers_flown(env, seed, episodes, fly):
    """What moves about the vehicle after a period of each episode, and the worlds flown in."""
    told, worlds = [], []
    for k in range(episodes):
        env.reset(seed=seed if k == 0 else None)
        conditions = env.truth["conditions"]
        told.append((conditions.headings, conditions.sea, conditions.vehicle, conditions.real, conditions.gusts))
        worlds.append(env.scenario)
        fly(env, k)
    return told, worlds


def test_weather_of_an_episode_depends_on_its_seed_alone():
    """Not on what was flown before it, nor on how many numbers the worlds took."""

    def idle(env, k):
        pass

    def busy(env, k):
        rng = np.random.default_rng(k)
        for _ in range(k + 3):
            *_, over, late, _ = env.step(rng.uniform(env.action_space.low, env.action_space.high))
            if over or late:
                break

    weather = dataclasses.replace(LEVELS[4], sea="jonswap")
    told, worlds = weathers_flown(make(weather=weather), 5, 4, idle)
    again, same_worlds = weathers_flown(make(weather=weather), 5, 4, busy)
    assert told == again
    assert worlds == same_worlds
    fewer, other_worlds = weathers_flown(make(weather=weather, num_obstacles=3), 5, 4, idle)
    assert fewer == told
    assert other_worlds != worlds
    assert len({entry[0] for entry in told}) == 4
    assert weathers_flown(make(weather=weather), 6, 1, idle)[0][0] != told[0]


def test_gusts_do_not_follow_what_is_flown():
    """Wind and current at every tick are the same however the vehicle flies: the waves alone depend on where it is."""
    calm = dataclasses.replace(LEVELS[5], wave_height=0.0)
    one, other = make(weather=calm), make(weather=calm)
    one.reset(seed=8)
    other.reset(seed=8)
    for k in range(15):
        first = one.step(np.array([0.0, 0.0, 5.0, 0.0]))
        second = other.step(np.array([3.0 * (k % 2), 2.0, 6.0, 1.0]))
        assert same(first[4]["weather"], second[4]["weather"])
        if any((*first[2:4], *second[2:4])):
            break
    assert k > 3


def test_worlds_are_the_same_in_every_weather():
    """Also in later episodes: weather takes no number from the stream of scenarios."""
    drawn = []
    for level in range(6):
        env = make(weather=level)
        scenarios = []
        for k in range(4):
            env.reset(seed=9 if k == 0 else None)
            scenarios.append(env.scenario)
            env.step(np.array([0.0, 0.0, 3.0, 0.0]))
        drawn.append(scenarios)
    assert all(scenarios == drawn[0] for scenarios in drawn)


@LEVEL
@pytest.mark.parametrize("interface", ["world", "egocentric"])
def test_observations_do_not_tell_it(level, interface):
    for seed in range(5):
        calm = make(interface=interface).reset(seed=seed)[0]
        assert same(make(weather=level, interface=interface).reset(seed=seed)[0], calm)
        assert_same(
            native(3, weather=level, interface=interface).reset(seed=seed)[0],
            native(3, interface=interface).reset(seed=seed)[0],
        )


def test_info_tells_it_where_there_is_weather():
    assert "weather" not in make().reset(seed=0)[1]
    assert "weather" not in native(2).reset(seed=0)[1]
    env = make(weather=3)
    _, info = env.reset(seed=0)
    assert set(info["weather"]) == {"wind", "water", "elevation"}
    assert len(info["weather"]["wind"]) == len(info["weather"]["water"]) == 3
    assert isinstance(info["weather"]["elevation"], float)
    assert 0.3 < np.linalg.norm(info["weather"]["wind"]) < 12.0
    assert 0.0 < np.linalg.norm(info["weather"]["water"]) < 1.5
    before = copy.deepcopy(info["weather"])
    env.step(np.array([0.0, 0.0, 5.0, 0.0]))
    assert same(info["weather"], before)


@pytest.mark.parametrize("count", [3, 20])
def test_info_of_rows_has_shapes_and_masks(count):
    rows = native(count, weather=3, autoreset_mode="SameStep", time_limit=1.0)
    _, info = rows.reset(seed=1)
    shapes = {"wind": (count, 3), "water": (count, 3), "elevation": (count,)}
    kept = {name: info["weather"][name].copy() for name in shapes}
    mask = np.zeros(count, bool)
    mask[1] = True
    _, partly = rows.reset(seed=2, options={"reset_mask": mask})
    for name, shape in shapes.items():
        assert info["weather"][name].shape == shape
        assert info["weather"][f"_{name}"].tolist() == [True] * count
        assert partly["weather"][f"_{name}"].tolist() == mask.tolist()
        assert not partly["weather"][name][~mask].any()
        assert partly["weather"][name][mask].any()
    assert partly["_weather"].tolist() == mask.tolist()
    references = np.tile([0.0, 0.0, 4.0, 0.0], (count, 1))
    rows.step(references)
    *_, truncated, info = rows.step(references)
    assert truncated[0]
    final = info["final_info"]
    for name, shape in shapes.items():
        assert final["weather"][name].shape == shape
        assert (final["weather"][name][truncated] != info["weather"][name][truncated]).any()
        assert final["weather"][f"_{name}"].tolist() == info["_final_info"].tolist()
    assert not np.array_equal(kept["wind"], final["weather"]["wind"])


@pytest.mark.parametrize("interface", ["world", "egocentric"])
@pytest.mark.parametrize("name", IDS)
def test_checkers_pass_in_weather(name, interface):
    env = gym.make(name, weather=3, interface=interface).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        if interface == "world":
            warnings.filterwarnings("ignore", message=f".*{WORLD_ACTIONS}")
            warnings.filterwarnings("ignore", message="Your observation obstacles has an unconventional shape")
        check_env(env)
        check_env_sb3(env)


@pytest.mark.parametrize("weather", [5, dataclasses.replace(SWELL, extra=Column(2.0, 3.0))], ids=["level 5", "extra"])
def test_a_snapshot_in_a_gust_goes_on_alike(weather):
    env = make(weather=weather, time_limit=7.0)
    env.reset(seed=7)
    wander(env, 11, seed=8)
    snapshot = pickle.loads(pickle.dumps(env.get_state()))
    expected = wander(env, 40, 9)
    assert len(expected) > 41, "it should end more than once: the next episodes' weather is part of it"
    for other in (make(weather=weather, time_limit=7.0), env):
        other.set_state(snapshot)
        assert same(wander(other, 40, 9), expected)
    copied = pickle.loads(pickle.dumps(other))
    assert same(wander(copied, 20, 10), wander(other, 20, 10))


def test_a_snapshot_before_any_weather_goes_on_alike():
    """A scenario brings the weather after the snapshot: its weather comes from the seed of the snapshot too."""
    env = make()
    env.reset(seed=7)
    env.reset()
    snapshot = env.get_state()
    expected = env.reset(options={"scenario": GALE}), env.step(np.array([0.0, 0.0, 3.0, 0.0]))
    other = make()
    other.reset(seed=99)
    other.set_state(pickle.loads(pickle.dumps(snapshot)))
    assert same((other.reset(options={"scenario": GALE}), other.step(np.array([0.0, 0.0, 3.0, 0.0]))), expected)


def test_scenarios_bring_their_weather():
    still, windy = make(), make(weather=SWELL)
    assert "weather" not in still.reset(seed=4)[1]
    for env in (still, windy):
        env.reset(seed=4, options={"scenario": GALE if env is still else DIVE})
    assert still.truth["conditions"].sea == windy.truth["conditions"].sea
    for _ in range(8):
        action = np.array([-5.0, 1.0, 3.0, 0.0])
        assert same(still.step(action)[:4], windy.step(action)[:4])
    # and without it the next episode is calm again
    calm, reference = make(), np.array([0.0, 0.0, 4.0, 0.0])
    still.reset(seed=5)
    calm.reset(seed=5)
    for _ in range(8):
        assert same(still.step(reference)[0], calm.step(reference)[0])


def test_a_calm_scenario_in_a_windy_environment():
    windy, calm = make(weather=5), make()
    quiet = dataclasses.replace(DIVE, weather=Weather())
    assert same(windy.reset(seed=1, options={"scenario": quiet})[0], calm.reset(seed=1, options={"scenario": DIVE})[0])
    for _ in range(8):
        action = np.array([-5.0, 1.0, 3.0, 0.0])
        assert same(windy.step(action)[0], calm.step(action)[0])


def test_one_row_of_several_brings_weather():
    """Into a vector environment made without: its row is the single environment, the others know nothing of it."""
    scenarios = [None, GALE, None, DIVE]
    rows, envs = native(4, time_limit=20.0), [make(time_limit=20.0) for _ in range(4)]
    observation, _ = rows.reset(seed=40, options={"scenario": scenarios})
    for k, env in enumerate(envs):
        expected = env.reset(seed=40 + k, options={"scenario": scenarios[k]} if scenarios[k] else None)
        assert_same(row_of(observation, k), expected[0])
    walk, over = Walk(3, rows.single_action_space, "world"), np.zeros(4, bool)
    for _ in range(120):
        actions = walk(observation, 4)
        observation, rewards, terminated, truncated, _ = rows.step(actions)
        for k, env in enumerate(envs):
            expected = (env.reset()[0], 0.0) if over[k] else env.step(actions[k])
            assert_same(row_of(observation, k), expected[0])
            assert rewards[k] == expected[1]
        over = terminated | truncated


def test_weather_that_arrives_amid_flights():
    """A row is reset into weather while the others are on their way."""
    rows, envs = native(3, autoreset_mode="Disabled"), [make() for _ in range(3)]
    observation, _ = rows.reset(seed=50)
    for k, env in enumerate(envs):
        env.reset(seed=50 + k)
    hold = np.array([[*start, 0.0] for start in observation["state"][:, :3]])
    for _ in range(3):
        rows.step(hold)
        for env, reference in zip(envs, hold, strict=True):
            env.step(reference)
    rows.reset(options={"scenario": GALE, "reset_mask": np.array([False, True, False])})
    envs[1].reset(options={"scenario": GALE})
    for _ in range(5):
        observation, *_ = rows.step(hold)
        for k, env in enumerate(envs):
            assert_same(row_of(observation, k), env.step(hold[k])[0])


def test_later_weather_of_a_row_is_that_of_the_single_environment():
    """Which rows brought weather before changes nothing of what another row's seed draws."""
    rows, env = native(2, autoreset_mode="Disabled"), make()
    rows.reset(seed=60, options={"scenario": [GALE, DIVE]})
    rows.reset(options={"scenario": [GALE, DIVE]})
    rows.reset(options={"scenario": [DIVE, GALE]})
    env.reset(seed=61, options={"scenario": DIVE})
    env.reset(options={"scenario": DIVE})
    env.reset(options={"scenario": GALE})
    hold = np.array([[-5.0, 0.0, 3.0, 0.0]] * 2)
    for _ in range(5):
        assert_same(row_of(rows.step(hold)[0], 1), env.step(hold[1])[0])


def test_disturbances_leave_rows_without_them_alone():
    """Their numbers are all zero there, by which a kernel may divide."""
    rising = dataclasses.replace(DIVE, weather=Weather(extra=Column(2.0, 3.0)))
    rows, calm = native(2, autoreset_mode="Disabled"), make()
    rows.reset(seed=70, options={"scenario": [rising, DIVE]})
    calm.reset(seed=71, options={"scenario": DIVE})
    hold = np.array([[-5.0, 0.0, 3.0, 0.0]] * 2)
    for _ in range(5):
        observation, *_, info = rows.step(hold)
        assert_same(row_of(observation, 1), calm.step(hold[1])[0])
    assert info["weather"]["wind"][0, 2] == pytest.approx(2.0 / (1.0 + 25.0 / 9.0), rel=0.1)
    assert 0.0 < info["weather"]["water"][0, 0] < 0.1
    assert not info["weather"]["water"][1].any()


def test_a_refused_scenario_changes_nothing():
    env = make(weather=dataclasses.replace(SWELL, extra=Column(2.0, 3.0)))
    env.reset(seed=1)

    class Other(NamedTuple):
        speed: float

    register(Other, _rising)
    env.step(np.array([0.0, 0.0, 4.0, 0.0]))
    before = env.get_state()
    with pytest.raises(ValueError, match="a scenario's disturbance must be a Column here, got Other"):
        env.reset(options={"scenario": dataclasses.replace(DIVE, weather=Weather(extra=Other(1.0)))})
    assert same(list(env.get_state().episodes), list(before.episodes))
    assert env.get_state().conditions.tobytes() == before.conditions.tobytes()


def test_weather_of_scenarios_survives_files(tmp_path):
    path = tmp_path / "gale.json"
    for weather in (SWELL, *LEVELS):
        scenario = dataclasses.replace(DIVE, weather=weather)
        save_scenario(scenario, path)
        assert load_scenario(path) == scenario
    save_scenario(GALE, path)
    flown = [make().reset(seed=3, options={"scenario": given}) for given in (GALE, path)]
    assert same(*flown)
    with pytest.raises(ValueError, match="cannot hold the disturbance"):
        save_scenario(dataclasses.replace(DIVE, weather=Weather(extra=Column(1.0, 1.0))), path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"wind": -1.0}, r"Weather\.wind must lie between 0 and 20 \(m/s"),
        ({"wind": "strong"}, r"Weather\.wind must lie between"),
        ({"gale": 1.0}, "weather: .*gale"),
        ({"spread": {"mass": 2.0}}, r"Spread\.mass must lie between 0 and 0\.9"),
        ({"spread": {"weight": 0.1}}, "weather: .*weight"),
        ({"spread": None}, '"weather" must be an object with a "spread"'),
        ({"extra": [1.0]}, r"Weather\.extra must be a registered disturbance"),
    ],
)
def test_bad_weather_in_files_is_refused(tmp_path, change, message):
    path = tmp_path / "gale.json"
    save_scenario(GALE, path)
    content = json.loads(path.read_text())
    content["weather"] |= change
    path.write_text(json.dumps(content))
    with pytest.raises(ValueError, match=rf"gale\.json: {message}"):
        load_scenario(path)


def test_weather_is_part_of_what_a_scenario_is():
    assert GALE != DIVE
    assert dataclasses.replace(GALE, weather=None) == DIVE
    assert Scenario(start=DIVE.start, goal=DIVE.goal, obstacles=[], weather=SWELL) == GALE
