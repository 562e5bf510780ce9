"""Every mistake a caller can make gets a message that names the thing, the rule, the unit and the value."""

import math
import re

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from hydrone_gym import Scenario, Vehicle, save_scenario
from hydrone_gym.envs.hydrone_env import known_options
from tests.envs.missions import AIR_TO_AIR, IDS, begin, fly_to, make

OPTIONS = [
    ({"num_obstacles": -1}, "num_obstacles must be a whole number, not negative, got -1"),
    ({"num_obstacles": 2.5}, "num_obstacles must be a whole number, not negative, got 2.5"),
    ({"num_obstacles": 1001}, "num_obstacles must be at most 1000: every observation and the storage of every row"),
    ({"num_obstacles": 100_000_000}, "num_obstacles must be at most 1000: every observation and the storage of every"),
    ({"obstacle_radius": (1.5, 0.5)}, "obstacle_radius must be positive and ascending (m), got (1.5, 0.5)"),
    ({"obstacle_radius": 1.0}, "obstacle_radius must be 2 finite numbers (m), got 1.0"),
    ({"obstacle_radius": (1.0, 9.0)}, "obstacle_radius must be less than 7.5 m, half the shortest edge of the box"),
    ({"sensor_range": 0.0}, "sensor_range must be a positive number (m), got 0.0"),
    ({"sensor_range": math.inf}, "sensor_range must be a positive number (m), got inf"),
    (
        {"vehicle": "boat"},
        "vehicle must be one of 'paper', 'physical', 'hydrone-2021', 'hydrone-agile' or a Vehicle, got 'boat'",
    ),
    ({"period": 0.33}, "period must be a positive multiple of 0.05 s, got 0.33"),
    ({"period": -0.5}, "period must be a positive number (s), got -0.5"),
    ({"period": "fast"}, "period must be a positive number (s), got 'fast'"),
    ({"vertical_mode": 1}, "vertical_mode must be True or False, got 1"),
    ({"rough_transition": "ignore"}, "rough_transition must be one of 'fail', 'count', got 'ignore'"),
    ({"time_limit": math.nan}, "time_limit must be a positive number (s), got nan"),
    ({"interface": "flat"}, "interface must be one of 'world', 'egocentric', got 'flat'"),
    ({"mission": "up"}, "mission must be one of 'air_to_water', 'water_to_air', 'random', got 'up'"),
    ({"render_mode": "film"}, "render_mode must be one of None, 'rgb_array', 'human', got 'film'"),
    ({"render_size": (64, 479)}, "render_size must be two even whole numbers from 64 to 4096 (pixels), got (64, 479)"),
    ({"render_size": 640}, "render_size must be two even whole numbers from 64 to 4096 (pixels), got 640"),
    ({"camera": "side"}, "camera must be one of 'overview', 'chase', got 'side'"),
]
ACTIONS = [
    (np.zeros(3), "action must have shape (4,) [x, y, z, psi] (m, m, m, rad), got (3,)"),
    (np.zeros((1, 4)), "action must have shape (4,) [x, y, z, psi] (m, m, m, rad), got (1, 4)"),
    ([0.0, 0.0, math.nan, 0.0], "action must be finite [x, y, z, psi] (m, m, m, rad), got [ 0.  0. nan  0.]"),
    ([0.0, 0.0, math.inf, 0.0], "action must be finite [x, y, z, psi] (m, m, m, rad), got [ 0.  0. inf  0.]"),
    ("north", "action must be four numbers [x, y, z, psi] (m, m, m, rad), got 'north'"),
    (None, "action must"),
]
SCENARIOS = [
    ({"start": (0.0, 0.0, 12.0, 0.0)}, "start z must lie inside the box, between -5.0 and 10.0 m, got 12.0 m"),
    ({"goal": (0.0, 0.0, 0.3)}, "goal z must lie outside the transition zone of +-0.8 m, got 0.3 m"),
    ({"obstacles": [(-2.0, 0.0, 5.0, 1.0)]}, "start must keep more than the vehicle's radius of 0.45 m"),
    ({"obstacles": [(0.0, 9.0, 5.0, 1.0)] * 3}, "scenario must have at most num_obstacles=2 obstacles, got 3"),
    ({"obstacles": [(99.0, 0.0, 5.0, 1.0)]}, "obstacle 0 must lie between [-30.0, -30.0, -25.0, 0.0] and"),
]


@pytest.mark.parametrize(("options", "message"), OPTIONS, ids=[str(case[0]) for case in OPTIONS])
@pytest.mark.filterwarnings("ignore:.*render_mode:UserWarning")
def test_options(options, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        make(**options)


def test_unknown_option_lists_the_known_ones():
    with pytest.raises(TypeError) as raised:
        gym.make(IDS[2], num_obstacle=3)
    assert "unknown option 'num_obstacle'; known are mission, num_obstacles, obstacle_radius" in str(raised.value)
    assert all(name in str(raised.value) for name in known_options())
    with pytest.raises(TypeError, match=r"vehicle must be a name or a hydrone_gym\.Vehicle, got int"):
        make(vehicle=3)
    with pytest.raises(ValueError, match=re.escape("Vehicle.mass must be positive (kg), got -1.3")):
        make(vehicle=Vehicle(mass=-1.3))


@pytest.mark.parametrize(("action", "message"), ACTIONS, ids=[str(case[0]) for case in ACTIONS])
def test_actions(action, message):
    env, _ = begin(AIR_TO_AIR)
    before = env.get_state()
    with pytest.raises(ValueError, match=re.escape(message)):
        env.step(action)
    assert env.get_state().episodes.rows.tobytes() == before.episodes.rows.tobytes()


def test_calls_out_of_order():
    env = make()
    for call in (lambda: env.step(np.zeros(4)), env.get_state, lambda: env.scenario):
        with pytest.raises(ResetNeeded, match=r"call reset\(\)"):
            call()
    with pytest.raises(ResetNeeded):
        gym.make(IDS[0]).step(np.zeros(4, np.float32))
    env, _ = begin(AIR_TO_AIR)
    fly_to(env, (4.0, 0.0, 5.0, 0.0))
    with pytest.raises(ResetNeeded, match=r"after the episode ended with GOAL: call reset\(\) first"):
        env.step(np.zeros(4))
    env.reset()
    env.step(np.zeros(4))


@pytest.mark.parametrize(("changes", "message"), SCENARIOS, ids=[case[1][:24] for case in SCENARIOS])
def test_impossible_scenarios(changes, message):
    fields = {"start": (-2.0, 0.0, 5.0, 0.0), "goal": (4.0, 0.0, 5.0), "obstacles": []} | changes
    with pytest.raises(ValueError, match=re.escape(message)):
        make(num_obstacles=2).reset(options={"scenario": Scenario(**fields)})


def test_reset_options(tmp_path):
    env = make()
    with pytest.raises(ValueError, match="unknown reset option 'scenarios'; known are 'scenario'"):
        env.reset(options={"scenarios": AIR_TO_AIR})
    with pytest.raises(ValueError, match="scenario must be a Scenario or the path of its file, got dict"):
        env.reset(options={"scenario": {}})
    with pytest.raises(FileNotFoundError):
        env.reset(options={"scenario": tmp_path / "none.json"})
    save_scenario(AIR_TO_AIR, tmp_path / "mission.json")
    for path in (tmp_path / "mission.json", str(tmp_path / "mission.json")):
        env.reset(options={"scenario": path})
        assert env.scenario == AIR_TO_AIR


def test_start_yaw_of_several_turns_is_wrapped():
    turned = Scenario(start=(-2.0, 0.0, 5.0, 7.0), goal=(4.0, 0.0, 5.0), obstacles=[])
    env, observation = begin(turned)
    assert observation["state"][5] == pytest.approx(7.0 - 2.0 * math.pi)
    assert observation["reference"][3] == observation["state"][5]
    assert env.observation_space.contains(observation)
