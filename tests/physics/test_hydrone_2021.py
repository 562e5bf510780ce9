"""The vehicle of the authors' simulator of 2021: its numbers, and the two experiments."""

import dataclasses

import gymnasium as gym
import numpy as np
import pytest

from hydrone_gym import HYDRONE, HYDRONE_2021, Weather
from hydrone_gym._jit import kernel
from hydrone_gym.evaluation import fly
from hydrone_gym.physics.immersion import submerged_share, unmodelled_of
from hydrone_gym.physics.parameters import hull_of
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.simulation import Simulation, row_at
from hydrone_gym.world.world import World
from planners import StraightLine
from tests.weather.outdoors import conditions_for


@kernel
def _share(height, inverse_height):
    return submerged_share(height, inverse_height)


COUNTING = World(rough_transition="count")


def test_its_aquatic_propeller():
    """ζ(n) = π r⁴ c_T(n): Table 1's constant is its value near 1480 rpm."""
    first, second, third = HYDRONE_2021.thrust_water_curve
    zeta = first + second * (n := np.array([0.0, 1480.0, 2500.0])) + third * n**2
    np.testing.assert_allclose(zeta, [1.914e-9, HYDRONE.thrust_water, 1.533e-9], rtol=2e-3)


def test_its_density_changes_over_two_hulls_of_half_the_height():
    h = 0.0675
    for z in np.linspace(-0.1, 0.1, 41):
        blended = 1.293 + (1000.0 - 1.293) * np.clip((h - z) / (2 * h), 0.0, 1.0)
        share = _share(z, 1.0 / HYDRONE_2021.height)
        assert (1.0 - share) * 1.293 + share * 1000.0 == pytest.approx(blended)


def test_its_rotors_follow_within_thirty_a_second():
    real = unmodelled_of(hull_of(HYDRONE_2021), 0.01)
    assert real.keep_air == real.keep_water == pytest.approx(np.exp(-0.3))


def test_its_rotational_drag_is_of_one_source_with_the_tabled_one():
    """There C_p = (2.5, 2.5, 9.99) e-2 halves to the tabled C, and C_r = (1.25, 1.25, 2.5) e-2 to this N."""
    np.testing.assert_allclose(HYDRONE.drag, np.array([2.5, 2.5, 9.99]) / 2 * 1e-2, rtol=2e-3)
    np.testing.assert_allclose(HYDRONE_2021.rotational_drag, np.array([1.25, 1.25, 2.5]) / 2 * 1e-2)


@pytest.mark.parametrize("env_id", ["HydroneGym/AirToWater-v0", "HydroneGym/WaterToAir-v0"])
def test_both_experiments_in_an_empty_world(env_id):
    env = gym.make(env_id, num_obstacles=0, vehicle="hydrone-2021")
    flight = fly(env, StraightLine.for_env(env), seed=0)
    assert flight.outcome is Outcome.GOAL
    assert flight.time < 22.5
    (crossing,) = flight.transitions
    assert crossing["lateral_speed"] <= 0.1
    assert np.degrees(crossing["tilt"]) <= 2.0


def exits(vehicle):
    """Rise through the surface at 0.5 m/s; vertical speed at the exit, the least after it, and how often it crosses."""
    row, speeds, heights = row_at(np.array([0.0, 0.0, -2.0, *np.zeros(9)])), [], []
    row["goal"] = np.inf
    conditions, none = conditions_for(row, 1, Weather(), vehicle=vehicle), np.zeros((1, 0))
    simulation = Simulation(vehicle, COUNTING, period=0.05, weathered=True)
    for k in range(120):
        simulation.advance(row, np.array([[0.0, 0.0, -2.0 + 0.025 * (k + 1), 0.0]]), none, none, 0, weather=conditions)
        heights.append(row["state"][0, 2])
        speeds.append(row["state"][0, 8])
    out = int(np.argmax(np.array(heights) > 0.0))
    return speeds[out], min(speeds[out:]), row["crossings"][0]


def test_its_aerial_rotors_start_in_time_at_the_exit():
    """They start from rest: 33 ms cost 0.2 m/s of 0.4, and with 100 ms it would fall back."""
    speed, least, crossings = exits(HYDRONE_2021)
    assert crossings == 1.0
    assert speed == pytest.approx(0.41, abs=0.02)
    assert least == pytest.approx(0.22, abs=0.02)
    assert exits(dataclasses.replace(HYDRONE_2021, rotor_lag_air=0.1))[1] < 0.0
    assert exits(dataclasses.replace(HYDRONE_2021, rotor_lag_air=0.2))[2] >= 5.0
