"""Every way an episode can end, and what `info` says about it."""

import dataclasses
import math

import numpy as np
import pytest

from hydrone_gym import HYDRONE, AirGains, Outcome
from tests.envs.missions import AIR_TO_AIR, CLIMB, DIVE, SPHERE_BETWEEN, begin, fly_to, make

GOAL = (4.0, 0.0, 5.0, 0.0)


def test_goal():
    env, _ = begin(AIR_TO_AIR)
    observation, reward, terminated, truncated, info = fly_to(env, GOAL)[-1]
    assert (terminated, truncated) == (True, False)
    assert info["outcome"] is Outcome.GOAL
    assert info["is_success"] is True
    assert info["reward_terms"]["goal"] == 1.5
    assert np.linalg.norm(observation["state"][:3] - AIR_TO_AIR.goal) <= 0.5
    assert reward > 1.0
    assert math.isinf(info["clearance"])


def test_collision():
    env, _ = begin(SPHERE_BETWEEN)
    returns = fly_to(env, GOAL)
    observation, _, terminated, truncated, info = returns[-1]
    assert (terminated, truncated) == (True, False)
    assert info["outcome"] is Outcome.COLLISION
    assert info["is_success"] is False
    assert info["reward_terms"]["collision"] == -2.0
    assert -0.2 < info["clearance"] <= 0.0
    assert all(earlier[4]["clearance"] > 0.0 for earlier in returns[:-1])
    # judged every 50 ms: the last observation is of the contact, not of the period's end
    gap = np.linalg.norm(observation["state"][:3] - SPHERE_BETWEEN.obstacles[0, :3]) - 0.8 - HYDRONE.radius
    assert abs(gap) < 0.1
    assert info["time"] < len(returns) * 0.5


@pytest.mark.parametrize(
    ("scenario", "reference", "direction"), [(DIVE, (5, 0, -3, 0), "entry"), (CLIMB, (6, 0, 5, 0), "exit")]
)
def test_smooth_crossing_is_noted(scenario, reference, direction):
    env, _ = begin(scenario)
    returns = fly_to(env, (*scenario.start[:2], *reference[2:]), steps=30)
    infos = [entry[4] for entry in returns]
    assert infos[-1]["outcome"] in (Outcome.RUNNING, Outcome.GOAL)
    (crossing,) = infos[-1]["transitions"]
    assert crossing["direction"] == direction
    assert crossing["lateral_speed"] <= 0.1
    assert crossing["tilt"] <= math.radians(2.0)
    assert (crossing["vertical_speed"] > 0.0) == (direction == "exit")
    before = [info["time"] for info in infos if not info["transitions"]]
    assert before[-1] < crossing["time"] <= before[-1] + 0.5 + 1e-9


def test_rough_crossing_fails_or_counts():
    fast = (9.0, 0.0, -4.0, 0.0)
    env, _ = begin(DIVE, vertical_mode=False)
    _, _, terminated, truncated, info = fly_to(env, fast, 40)[-1]
    assert (terminated, truncated) == (True, False)
    assert info["outcome"] is Outcome.ROUGH_TRANSITION
    assert info["reward_terms"]["rough_crossing"] == -2.0
    crossing = info["transitions"][-1]
    assert crossing["lateral_speed"] > 0.2 or crossing["tilt"] > math.radians(5.0)
    assert crossing["time"] == info["time"]

    env, _ = begin(DIVE, vertical_mode=False, rough_transition="count")
    infos = [entry[4] for entry in fly_to(env, fast, 40)]
    noted = infos[-1]["transitions"][0]
    assert noted == crossing
    assert infos[-1]["time"] > noted["time"] + 5.0
    assert all(info["reward_terms"]["rough_crossing"] == 0.0 for info in infos)


def test_out_of_bounds():
    """References are clipped to the box, but the climb to one on the ceiling overshoots it."""
    env, _ = begin(AIR_TO_AIR)
    observation, _, terminated, truncated, info = fly_to(env, (-2.0, 0.0, 50.0, 0.0))[-1]
    assert (terminated, truncated) == (True, False)
    assert info["outcome"] is Outcome.OUT_OF_BOUNDS
    assert info["reward_terms"]["out_of_bounds"] == -2.0
    assert 10.0 < observation["state"][2] < 10.1
    assert observation["reference"][2] == 10.0
    assert env.observation_space.contains(observation)


def test_divergence_ends_the_episode_without_leaking():
    """Gains that tumble the vehicle: it ends where the model was last good."""
    tumbling = AirGains(tilt_limit=3.0, position_p=2.0, position_d=3.0)
    env, _ = begin(AIR_TO_AIR, vehicle=dataclasses.replace(HYDRONE, air_gains=tumbling))
    observation, reward, terminated, truncated, info = fly_to(env, (4.0, 3.0, 5.0, 2.0))[-1]
    assert (terminated, truncated) == (True, False)
    assert info["outcome"] is Outcome.DIVERGED
    assert info["reward_terms"]["diverged"] == -2.0
    assert env.observation_space.contains(observation)
    assert math.isfinite(reward)
    assert math.isfinite(info["energy"])


def test_timeout_truncates_at_the_end_of_the_period():
    env, _ = begin(AIR_TO_AIR, time_limit=1.2)
    returns = fly_to(env, AIR_TO_AIR.start)
    _, reward, terminated, truncated, info = returns[-1]
    assert (terminated, truncated) == (False, True)
    assert info["outcome"] is Outcome.TIMEOUT
    assert info["time"] == 1.5
    assert info["is_success"] is False
    assert len(returns) == 3
    assert "is_success" not in returns[0][4]
    assert reward > -0.1  # no term of its own
    exact, _ = begin(AIR_TO_AIR, time_limit=1.0)
    assert len(fly_to(exact, AIR_TO_AIR.start)) == 2


def test_energy_grows_at_the_hover_power():
    env, _ = begin(AIR_TO_AIR)
    energies = [entry[4]["energy"] for entry in fly_to(env, AIR_TO_AIR.start, 10)]
    assert (np.diff([0.0, *energies]) > 0.0).all()
    # shaft power of four rotors: rho eta Omega^3 2 pi / 60
    power = 4.0 * 1.293 * HYDRONE.torque_air * HYDRONE.hover_speed**3 * 2.0 * math.pi / 60.0
    assert energies[-1] == pytest.approx(power * 5.0, rel=1e-3)


def test_actions_beyond_the_box_are_clipped():
    one, other = make("AirToWater"), make("AirToWater")
    one.reset(seed=3)
    other.reset(seed=3)
    observation, *_ = one.step(np.array([99.0, -99.0, 99.0, 9.0]))
    expected, *_ = other.step(one.action_space.high * [1, -1, 1, 1])
    np.testing.assert_array_equal(observation["reference"], expected["reference"])
    np.testing.assert_array_equal(observation["state"], expected["state"])
    assert one.observation_space["reference"].contains(observation["reference"])
