"""Whatever the weather and whatever is asked for, numbers stay numbers."""

import numpy as np

from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.vehicle import HYDRONE, HYDRONE_2021
from hydrone_gym.weather.weather import LEVELS
from hydrone_gym.world.world import World
from tests.simulation.batches import random_references, random_rows
from tests.weather.outdoors import conditions_for, play_in_weather

WORLD = World()
WIDE = World(lower=(-1e3, -1e3, -1e3), upper=(1e3, 1e3, 1e3), rough_transition="count")


def storm(vehicle, world, count, seed):
    """Random starts and references for ten seconds at level 5."""
    rng = np.random.default_rng(seed)
    rows = random_rows(rng, count, WORLD)
    references = np.stack([random_references(rng, count, WORLD) for _ in range(20)])
    references[1::2] = references[::2]  # a second each
    conditions = conditions_for(rows, 16, LEVELS[5], vehicle=vehicle, seed=seed)
    return play_in_weather(Simulation(vehicle, world, lanes=16, weathered=True), rows, references, conditions)[0]


def test_ten_thousand_flights_at_level_five_stay_sane():
    """Where a rough crossing ends a flight, none diverges; where it goes on, one in a thousand may be turned over."""
    outcomes = []
    for vehicle, world, count in ((HYDRONE, WORLD, 6000), (HYDRONE, WIDE, 2000), (HYDRONE_2021, WIDE, 2000)):
        rows = storm(vehicle, world, count, seed=count)
        for field in ("state", "integral", "energy"):
            assert np.isfinite(rows[field]).all()
        assert (rows["outcome"] == Outcome.DIVERGED).sum() <= (0 if world is WORLD else 2)
        assert (np.linalg.norm(rows["state"][:, 6:9], axis=1) < 15.0).all()
        outcomes += rows["outcome"].tolist()
    assert outcomes.count(Outcome.RUNNING) > 3000
