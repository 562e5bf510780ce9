"""The search for the bound: what it finds arrives, keeps the rule it is to keep, and beats what it began with."""

import numpy as np
import pytest

from hydrone_gym.evaluation.bounds import GRID
from hydrone_gym.simulation.outcome import GOAL
from hydrone_gym.simulation.simulation import trajectory
from hydrone_gym.vehicle import HYDRONE, HYDRONE_2021
from hydrone_gym.world.world import World
from planners import bound
from planners.belief import Belief
from planners.bound import Place, fastest_flights

BELIEF = Belief(vehicle=HYDRONE, world=World())
SPHERES = np.array([[-2.0, 0.0, 3.0, 1.0], [1.0, 1.5, -2.0, 0.8]])
PLACE = Place((-5.0, 0.0, 3.0, 0.0), np.array([4.0, 1.0, -2.0]), SPHERES)


@pytest.fixture
def few(monkeypatch):
    """A small search."""
    monkeypatch.setattr(bound, "_STARTS", 2)
    monkeypatch.setattr(bound, "_ROUNDS", ((2, 4), (1, 8)))
    monkeypatch.setattr(bound, "_ROUNDS_MORE", ((1, 6),))


def flown(found):
    simulation = BELIEF.simulation()
    return trajectory(simulation, PLACE.row, found.references, PLACE.obstacles)


def test_what_is_found_arrives_in_its_time_and_keeps_the_rule(few):
    kept, free = fastest_flights(BELIEF, PLACE, grid=GRID)
    for found in (kept, free):
        times, states, _, row = flown(found)
        assert row["outcome"][0] == GOAL
        assert (times[-1], row["energy"][0]) == (pytest.approx(found.time, abs=1e-9), found.energy)
        assert len(found.references) == np.ceil(found.time / 0.5 - 1e-9)
        np.testing.assert_array_equal(found.references.astype(np.float32), found.references)
    states = flown(kept)[1]
    there = states[np.abs(states[:, 2]) <= 0.8]
    assert np.hypot(there[:, 6], there[:, 7]).max() <= 0.2
    planned = bound._Trial(BELIEF, PLACE, GRID, np.inf).fly(bound._planned(BELIEF, PLACE, 0)[None])[0][0]
    assert free.time <= kept.time < planned


def test_a_search_gives_the_same_again(few):
    first, second = (fastest_flights(BELIEF, PLACE, grid=GRID, seed=3) for _ in range(2))
    for one, other in zip(first, second, strict=True):
        assert one[1:] == other[1:]
        np.testing.assert_array_equal(one.references, other.references)


def test_where_nothing_arrives_nothing_is_found(few, monkeypatch):
    monkeypatch.setattr(bound, "_LONGEST", 1.0)  # s, too little for any flight
    assert fastest_flights(BELIEF, PLACE, grid=GRID) == (None, None)


def test_a_vehicle_beyond_the_nominal_equations_is_refused():
    with pytest.raises(ValueError, match="vehicle 'hydrone-2021' has lag or height"):
        fastest_flights(Belief(vehicle=HYDRONE_2021, world=World()), PLACE, grid=GRID)
