"""Ten thousand random starts and references, anywhere and in either medium: nothing diverges."""

import numpy as np
import pytest

from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL
from hydrone_gym.world.world import World
from tests.simulation.batches import play, random_references, random_rows

WORLD = World()
# No walls and no verdict on crossings: every row has to last its 10 s.
OPEN = World(lower=(-1e3, -1e3, -1e3), upper=(1e3, 1e3, 1e3), rough_transition="count")


@pytest.mark.parametrize("vehicle", [HYDRONE, HYDRONE_PHYSICAL], ids=lambda vehicle: vehicle.name)
@pytest.mark.parametrize("changing", [False, True], ids=["one reference", "a new one every period"])
def test_ten_thousand_random_pairs(vehicle, changing):
    rng = np.random.default_rng(20)
    rows = random_rows(rng, 10_000, WORLD)
    references = [random_references(rng, len(rows), WORLD) for _ in range(20 if changing else 1)]
    after, _ = play(Simulation(vehicle, OPEN, lanes=16), rows, references if changing else references * 20)
    assert (after["outcome"] == Outcome.RUNNING).all()
    assert (after["ticks"] == 200.0).all()
    for field in ("state", "integral", "energy", "crossing_log", "crossings"):
        assert np.isfinite(after[field]).all(), field
    state = after["state"]
    assert np.abs(state[:, 3:5]).max() < np.radians(60.0)
    assert np.linalg.norm(state[:, 6:9], axis=1).max() < 5.0
    if not changing:
        distance = np.linalg.norm(state[:, :3] - references[0][:, :3], axis=1)
        assert np.median(distance) < np.median(np.linalg.norm(rows["state"][:, :3] - references[0][:, :3], axis=1)) / 2
