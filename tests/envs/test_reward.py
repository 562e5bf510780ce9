"""The reward's terms by value."""

import numpy as np
import pytest

from hydrone_gym import HYDRONE, HYDRONE_PHYSICAL, Outcome, World
from hydrone_gym.control.laws import envelope_of
from hydrone_gym.envs.reward import TERMS
from hydrone_gym.envs.task import pack_task
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.simulation.time_to_go import cruise_speeds
from planners.cl_rrt.objective import objective_params
from tests.envs.missions import AIR_TO_AIR, IDS, begin, fly_to, make, wander

NAMED = {"progress", "time", "collision", "rough_crossing", "goal"}


def test_terms_are_named_and_null_at_reset():
    _, info = make("AirToWater").reset(seed=0)
    assert tuple(info["reward_terms"]) == TERMS
    assert set(TERMS) >= NAMED
    assert set(info["reward_terms"].values()) == {0.0}


@pytest.mark.parametrize("name", [name.split("/")[1][:-3] for name in IDS])
def test_terms_add_up_to_the_reward(name):
    env = make(name, rough_transition="count")
    env.reset(seed=5)
    steps = [entry for entry in wander(env, 600, seed=6) if len(entry) == 5]
    for _, reward, _, _, info in steps:
        total = 0.0
        for value in info["reward_terms"].values():
            total += value
        assert total == reward
        assert type(reward) is float


def test_progress_is_a_potential_difference():
    """It telescopes: 6 m of air at 1.8 m/s less what is left, whatever the way."""
    env, _ = begin(AIR_TO_AIR)
    for reference in ((-2.0, 3.0, 5.0, 0.0), (0.0, -3.0, 6.0, 0.0)):
        start = fly_to(env, reference, 8)
        assert start[-1][4]["outcome"] is Outcome.RUNNING
    env, _ = begin(AIR_TO_AIR)
    returns = fly_to(env, (1.0, 2.0, 5.0, 0.0), 8) + fly_to(env, (4.0, 0.0, 5.0, 0.0))
    left = np.abs(returns[-1][0]["state"][:3] - AIR_TO_AIR.goal)
    earned = sum(entry[4]["reward_terms"]["progress"] for entry in returns)
    expected = 6.0 / 1.8 - max(np.hypot(*left[:2]) / 1.8, left[2] / 1.35)
    assert earned == pytest.approx(0.1 * expected, abs=1e-12)


def test_time_and_slow():
    env, _ = begin(AIR_TO_AIR)
    returns = fly_to(env, AIR_TO_AIR.start, 3) + fly_to(env, (4.0, 0.0, 5.0, 0.0), 2)
    for observation, *_, info in returns:
        assert info["reward_terms"]["time"] == -0.025
        slow = np.linalg.norm(observation["state"][6:9]) < 0.2
        assert info["reward_terms"]["slow"] == (-0.025 if slow else 0.0)
    assert {info["reward_terms"]["slow"] for *_, info in returns} == {0.0, -0.025}


@pytest.mark.parametrize("vehicle", [HYDRONE, HYDRONE_PHYSICAL])
def test_reward_and_planners_share_one_time_to_go(vehicle):
    speeds = list(pack_task(Simulation(vehicle, World()), 120.0, slice(0, 1))["speeds"][0])
    np.testing.assert_array_equal(speeds, cruise_speeds(envelope_of(vehicle)))
    np.testing.assert_array_equal(speeds, objective_params(Simulation(vehicle, World()), "time").rates)
