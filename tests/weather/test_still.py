"""In still weather, the kernel for weather flies the nominal vehicle as the kernel without does, bit for bit."""

from dataclasses import replace

import numpy as np
import pytest

from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL
from hydrone_gym.weather import Weather
from hydrone_gym.world.world import World
from tests.simulation.batches import play
from tests.simulation.test_rows import equal, mission
from tests.weather.outdoors import conditions_for, play_in_weather

WORLD = World()
COUNTING = World(rough_transition="count")


@pytest.mark.parametrize("vehicle", [HYDRONE, HYDRONE_PHYSICAL], ids=lambda vehicle: vehicle.name)
@pytest.mark.parametrize("world", [WORLD, COUNTING], ids=["fail", "count"])
@pytest.mark.parametrize(("lanes", "law"), [(1, "paper"), (16, "paper"), (16, "robust")])
def test_still_weather_changes_no_bit(vehicle, world, lanes, law):
    # aerial rotors that turn before an exit cost energy that only the kernel for weather counts
    vehicle = replace(vehicle, robust_gains=replace(vehicle.robust_gains, pre_spin=0.0))
    rows, references, spheres = mission(np.random.default_rng(20), count=250, periods=20)
    plain = Simulation(vehicle, world, lanes=lanes, law=law)
    expected, distances = play(plain, rows, references, spheres)
    conditions = conditions_for(rows, lanes, vehicle=vehicle)
    flown, near = play_in_weather(plain.flown_in(True), rows, references, conditions, spheres)
    equal(flown, expected)
    equal(near, distances)
    assert (expected["crossings"] > 0).sum() > 20
    assert {Outcome.RUNNING, Outcome.GOAL, Outcome.COLLISION} <= {Outcome(int(o)) for o in expected["outcome"]}


def test_any_weather_changes_something():
    """What the tests above compare does see a difference as small as a light breeze."""
    rows, references, spheres = mission(np.random.default_rng(21), count=40, periods=4)
    plain = Simulation(HYDRONE, WORLD, lanes=16)
    expected, _ = play(plain, rows, references, spheres)
    conditions = conditions_for(rows, 16, Weather(wind=0.1, turbulence=0.0, current=0.01))
    flown, _ = play_in_weather(plain.flown_in(True), rows, references, conditions, spheres)
    moving = rows["outcome"] == 0
    assert (flown["state"][moving] != expected["state"][moving]).any(axis=1).all()
    equal(flown[~moving], expected[~moving])
