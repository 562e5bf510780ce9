"""Ten thousand random starts and references, anywhere and in either medium: nothing diverges, whichever law flies."""

import dataclasses

import numpy as np
import pytest

from hydrone_gym.control.laws import LAWS
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL
from hydrone_gym.world.world import World
from tests.simulation.batches import play, random_references, random_rows
from tests.weather.outdoors import conditions_for, play_in_weather

WORLD = World()
# No walls and no verdict on crossings: every row has to last its 10 s.
OPEN = World(lower=(-1e3, -1e3, -1e3), upper=(1e3, 1e3, 1e3), rough_transition="count")
SPEED = {"paper": 5.0, "robust": 6.0}  # m/s, no vehicle is faster after 10 s


def sane(rows, law):
    assert (rows["outcome"] == Outcome.RUNNING).all()
    assert (rows["ticks"] == 200.0).all()
    for field in ("state", "integral", "energy", "crossing_log", "crossings"):
        assert np.isfinite(rows[field]).all(), field
    assert np.abs(rows["state"][:, 3:5]).max() < np.radians(60.0)
    assert np.linalg.norm(rows["state"][:, 6:9], axis=1).max() < SPEED[law]


def near(rows, references):
    """Median distance to references (m)."""
    return np.median(np.linalg.norm(rows["state"][:, :3] - references[:, :3], axis=1))


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("vehicle", [HYDRONE, HYDRONE_PHYSICAL], ids=lambda vehicle: vehicle.name)
@pytest.mark.parametrize("changing", [False, True], ids=["one reference", "a new one every period"])
def test_ten_thousand_random_pairs(vehicle, changing, law):
    rng = np.random.default_rng(20)
    rows = random_rows(rng, 10_000, WORLD)
    references = [random_references(rng, len(rows), WORLD) for _ in range(20 if changing else 1)]
    simulation = Simulation(vehicle, OPEN, lanes=16, law=law)
    after, _ = play(simulation, rows, references if changing else references * 20)
    sane(after, law)
    if not changing:
        assert near(after, references[0]) < near(rows, references[0]) / 2


@pytest.mark.parametrize(
    ("lag", "known"), [(0.02, True), (0.05, True), (0.1, True), (0.01, False), (0.03, False), (0.05, False)]
)
def test_the_robust_law_bears_rotors_that_lag(lag, known):
    """100 ms where the vehicle that the law knows has them, 50 ms where it does not expect any."""
    real = dataclasses.replace(HYDRONE, rotor_lag_air=lag, rotor_lag_water=lag)
    rng = np.random.default_rng(21)
    rows, references = random_rows(rng, 500, WORLD), random_references(rng, 500, WORLD)
    simulation = Simulation(real if known else HYDRONE, OPEN, lanes=16, law="robust", weathered=True)
    conditions = conditions_for(rows, 16, vehicle=real)
    after, _ = play_in_weather(simulation, rows, [references] * 20, conditions)
    sane(after, "robust")
    assert near(after, references) < near(rows, references) / 2
