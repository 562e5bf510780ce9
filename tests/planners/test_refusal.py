"""What the planner says it cannot do: the balance of forces, by hand."""

import gymnasium as gym
import numpy as np
import pytest

import hydrone_gym  # noqa: F401
from hydrone_gym import HYDRONE, Scenario, Weather
from hydrone_gym.physics.dynamics import state_derivative
from hydrone_gym.world.world import World
from planners import CLRRT
from planners.belief import Belief
from planners.caution import caution_at
from planners.disturbance import Sight
from planners.refusal import refusal


def sight(z, **estimate):
    """Return what an estimator remembers of a vehicle at rest at a height."""
    names = ("wind_x", "wind_y", "push_air", "water_x", "water_y", "push_water")
    state = np.array([0.0, 0.0, z, *np.zeros(9)])
    return Sight(state, np.zeros(4), np.zeros(4), np.array([estimate.get(name, 0.0) for name in names]))


def belief(law="paper"):
    return Belief(vehicle=HYDRONE, world=World(), law=law)


def test_the_tilt_is_that_whose_lift_balances_the_drag():
    """Judged with the open-loop model: a hover, tilted so far and moved through still air, is not accelerated."""
    told = refusal(belief(), caution_at(2), sight(2.0, wind_x=8.0, wind_y=6.0), -3.0)
    tilt = np.radians(float(told.partition(" wind take ")[2].partition(",")[0]))
    assert told.startswith("cannot keep still at the surface: 10.0 m/s of wind take ")
    assert told.endswith(", not 4.5 degrees of tilt")
    speed = HYDRONE.hover_speed / np.sqrt(np.cos(tilt))
    moving = np.array([0, 0, 2.0, 0, -tilt, 0, -10.0, 0, 0, 0, 0, 0])
    forward = state_derivative(moving, np.full(4, speed), HYDRONE)[6]
    assert abs(forward) < 0.02


def test_nothing_is_refused_that_forces_allow():
    calm = sight(2.0, wind_x=5.0, water_x=0.1)
    assert refusal(belief(), caution_at(2), calm, -3.0) is None
    assert refusal(belief(), caution_at(2), None, -3.0) is None
    gale = sight(2.0, wind_x=10.0)
    assert refusal(belief(), caution_at(2), gale, 5.0) is None  # it stays in air
    assert refusal(belief(), caution_at(2), sight(-2.0, wind_x=10.0), 5.0) is None  # nor is it in air


def test_a_current_is_refused_by_what_it_does():
    assert "1.50 m/s of current" in refusal(belief(), caution_at(3), sight(-2.0, water_x=1.5), -3.0)
    entering = sight(2.0, water_x=0.3, water_y=0.4)
    told = "cannot enter smoothly over ground: 0.50 m/s of current, 0.2 m/s are rough"
    assert refusal(belief(), caution_at(3), entering, -3.0) == told
    assert refusal(belief("robust"), caution_at(3), entering, -3.0) is None  # it goes with the water


@pytest.mark.parametrize(("wind", "refused"), [(0.0, False), (14.0, True)])
def test_it_is_in_the_report_of_who_waits(wind, refused):
    env = gym.make("HydroneGym/AirToWater-v0", weather=Weather(wind=wind, turbulence=0.0), controller="robust")
    planner, state = CLRRT.for_env(env, level=2), None
    scenario = Scenario(start=(0.0, 0.0, 2.0, 0.0), goal=(0.0, 0.0, -3.0), obstacles=())
    observation, told = env.reset(seed=0, options={"scenario": scenario})[0], []
    for _ in range(12):
        reference, state = planner.predict(observation, state)
        told.append((state[0].report.waiting > 0, state[0].report.refusal))
        observation, _, terminated, _, _ = env.step(reference)
        if terminated:
            break
    assert any(waits and why is not None for waits, why in told) == refused
    assert all(waits for waits, why in told if why is not None)
