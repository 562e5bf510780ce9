"""A crossing is rough by the speed relative to the water, not over ground."""

import dataclasses

import numpy as np
import pytest

from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.simulation import Simulation, row_at
from hydrone_gym.vehicle import HYDRONE
from hydrone_gym.weather import Weather
from hydrone_gym.world.world import World
from tests.weather.outdoors import conditions_for, play_in_weather

# controllers that leave the position alone, so that a vehicle goes where its speed and the fluid take it
DRIFTER = dataclasses.replace(
    HYDRONE,
    name="custom",
    air_gains=dataclasses.replace(HYDRONE.air_gains, position_p=1e-9, position_d=1e-9, zone_lateral_speed=10.0),
    water_gains=dataclasses.replace(HYDRONE.water_gains, surge_p=1e-9, surge_brake=1e-9),
)
CURRENT = Weather(current=0.3, current_variation=0.0, current_direction=0.0)
WORLD = World(rough_transition="fail")


def crossing(start, weather, target):
    """Fly one row through the surface; its outcome and the log of its first crossing."""
    row = row_at(np.array([0.0, 0.0, start[0], 0.0, 0.0, 0.0, *start[1:], 0.0, 0.0, 0.0]))
    row["goal"] = np.inf
    conditions = conditions_for(row, 1, weather, vehicle=DRIFTER)
    references = np.tile([0.0, 0.0, target, 0.0], (1, 1, 1))
    simulation = Simulation(DRIFTER, WORLD, period=0.05, weathered=True)
    for _ in range(80):
        row, _ = play_in_weather(simulation, row, references, conditions)
        if row["crossings"][0]:
            break
    assert row["crossings"][0] == 1.0
    time, direction, speed, _, vertical = row["crossing_log"][0, 0]
    return Outcome(int(row["outcome"][0])), direction, speed, vertical, time


def test_one_that_drifts_with_the_current_surfaces_smoothly():
    outcome, direction, speed, vertical, _ = crossing((-0.3, 0.3, 0.0, 0.3), CURRENT, 3.0)
    assert (outcome, direction) == (Outcome.RUNNING, 1.0)
    assert speed < 0.01
    assert vertical > 0.1


def test_in_still_water_the_same_is_rough():
    outcome, _, speed, *_ = crossing((0.1, 0.3, 0.0, -0.4), Weather(), -3.0)
    assert outcome == Outcome.ROUGH_TRANSITION
    assert speed == pytest.approx(0.3, abs=0.01)


def test_one_at_rest_over_ground_enters_a_current_roughly():
    outcome, direction, speed, *_ = crossing((0.1, 0.0, 0.0, -0.4), CURRENT, -3.0)
    assert (outcome, direction) == (Outcome.ROUGH_TRANSITION, -1.0)
    assert speed == pytest.approx(0.3, abs=0.01)


def test_one_that_flies_with_the_current_enters_smoothly():
    outcome, _, speed, *_ = crossing((0.1, 0.3, 0.0, -0.4), CURRENT, -3.0)
    assert outcome == Outcome.RUNNING
    assert speed < 0.01


def test_a_wave_is_crossed_at_its_own_surface():
    """Height and vertical speed are those of the water: a vehicle that stands still is crossed by the wave."""
    wave = Weather(wave_height=0.2, wave_period=2.0, wave_direction=0.0)
    crossed = [crossing((z, 0.0, 0.0, 0.0), wave, z) for z in (0.05, -0.05)]
    for _, direction, speed, vertical, _ in crossed:
        assert speed < 0.32  # a ω
        assert direction * vertical > 0.0
