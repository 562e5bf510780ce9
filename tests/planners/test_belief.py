"""Belief apart from truth: planners predict with the nominal vehicle, whatever the environment really flies."""

import dataclasses

import gymnasium as gym
import numpy as np
import pytest

import hydrone_gym  # noqa: F401
from hydrone_gym import HYDRONE
from hydrone_gym.simulation.rollout import Rollout
from hydrone_gym.simulation.simulation import Simulation, row_at
from planners import CLRRT, MPPI, OpenLoopRRT, PotentialField, PublishedCLRRT, StraightLine
from planners.belief import Belief, belief_of
from planners.shield import Shield

HEAVY = dataclasses.replace(HYDRONE, name="heavy", mass=1.5)


def env_that_flies(vehicle):
    """An environment made for the nominal vehicle, in which another one is flown."""
    env = gym.make("HydroneGym/AirToWater-v0")
    inner = env.unwrapped
    inner._core.simulations[0] = Simulation(vehicle, inner.world, inner.options.period)
    return env


def predicted(belief, observation, reference):
    """The state after a period, flown by hand with what is believed."""
    row = row_at(observation["state"], observation["goal"])
    row["integral"], row["reference"] = observation["integral"], observation["reference"]
    Rollout(belief.simulation(), np.zeros((0, 4))).fly(row, reference.astype(np.float64))
    return row["state"][0]


def after_a_period(env, planner):
    """Return what the planner predicted, what it observed, its reference, and what came."""
    observation, _ = env.reset(seed=0)
    action, (memory,) = planner.predict(observation)
    return memory.nodes["state"][memory.root], observation, action, env.step(action)[0]["state"]


def test_a_planner_predicts_with_the_nominal_vehicle():
    env = env_that_flies(HEAVY)
    nominal = Belief.of(env.unwrapped.options)
    expected, observation, action, came = after_a_period(env, CLRRT.for_env(env))
    np.testing.assert_array_equal(expected, predicted(nominal, observation, action))
    assert np.abs(expected[:3] - came[:3]).max() > 1e-3  # the heavy vehicle sinks


def test_truth_is_a_privilege_that_has_to_be_asked_for():
    env = env_that_flies(HEAVY)
    assert belief_of(env).vehicle == HYDRONE
    assert belief_of(env, "truth").vehicle == HEAVY
    expected, _, _, came = after_a_period(env, CLRRT.for_env(env, belief="truth"))
    np.testing.assert_array_equal(expected, came)


def test_the_shield_checks_with_what_it_believes():
    env = env_that_flies(HEAVY)
    assert Shield.for_env(None, env).simulation.vehicle == HYDRONE
    assert Shield.for_env(None, env, belief="truth").simulation.vehicle == HEAVY
    assert Shield.for_env(None, env).simulation is not env.unwrapped.simulation


@pytest.mark.parametrize("planner", [CLRRT, MPPI, OpenLoopRRT, PotentialField, PublishedCLRRT, StraightLine])
def test_every_planner_takes_a_belief(planner):
    """One that believes in a slow vehicle asks for less, though the environment is the same."""
    env = gym.make("HydroneGym/AirToWater-v0", num_obstacles=0)
    slow = dataclasses.replace(HYDRONE, air_gains=dataclasses.replace(HYDRONE.air_gains, speed_limit=0.5))
    belief = dataclasses.replace(belief_of(env), vehicle=slow)
    observation, _ = env.reset(seed=0)
    here = observation["state"][:3]
    steps = [
        np.linalg.norm(made.predict(observation)[0][:3] - here)
        for made in (planner.for_env(env), planner.for_env(env, belief=belief))
    ]
    assert 0.0 < steps[1] < steps[0] or planner is MPPI  # whose steps are drawn, not derived
    assert planner.for_env(env, belief=belief).predict(observation)[0].shape == (4,)


def test_no_belief_is_the_simulation_of_the_environment():
    """In still weather they are equal bit for bit, and still share nothing."""
    env = gym.make("HydroneGym/WaterToAir-v0")
    made = belief_of(env).simulation()
    np.testing.assert_array_equal(made.values, env.unwrapped.simulation.values)
    assert made is not env.unwrapped.simulation


def test_bad_beliefs():
    env = gym.make("HydroneGym/AirToWater-v0")
    with pytest.raises(TypeError, match=r'belief must be a planners\.belief\.Belief, "truth" or None, got 3'):
        CLRRT.for_env(env, belief=3)
    with pytest.raises(TypeError, match="for_env needs a HyDrone environment"):
        Shield.for_env(None, object())
    with pytest.raises(TypeError, match="unexpected keyword argument 'iteration'"):
        CLRRT.for_env(env, iteration=3)
