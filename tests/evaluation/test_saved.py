"""Saved flights: read back and flown again, bit for bit."""

import json

import gymnasium as gym
import numpy as np
import pytest

import hydrone_gym  # noqa: F401
from hydrone_gym.evaluation import fly
from hydrone_gym.evaluation.saved import FORMAT, VERSION, flight_record, read_flights, restore
from planners import CLRRT, StraightLine


def simulation(count, vehicle="paper"):
    return gym.make("HydroneGym/Mission-v0", num_obstacles=count, vehicle=vehicle).unwrapped.simulation


@pytest.fixture(scope="module")
def flown():
    """A flight and its file's content."""
    env = gym.make("HydroneGym/AirToWater-v0", num_obstacles=20)
    flight = fly(env, CLRRT.for_env(env, seed=2), seed=2)
    return flight, document({"name": "experiment-1", **flight_record(flight)})


def document(*records, vehicle="paper", **changes):
    content = {"format": FORMAT, "version": VERSION, "policy": "clrrt", "seed": 2, "vehicle": vehicle}
    return {**content, "flights": list(records), **changes}


def read(content, folder):
    path = folder / "flight.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return read_flights(path)


def test_a_flight_comes_back_bit_for_bit(flown, tmp_path):
    flight, content = flown
    (saved,) = read(content, tmp_path)
    assert (saved.name, saved.policy, saved.seed, saved.vehicle) == ("experiment-1", "clrrt", 2, "paper")
    again = restore(saved, simulation(20))
    for name in ("times", "states", "references"):
        np.testing.assert_array_equal(getattr(again.trace, name), getattr(flight.trace, name))
    np.testing.assert_array_equal(again.states[-1], again.trace.states[-1])
    for name in ("references", "states", "detected", "undetected"):
        np.testing.assert_array_equal(getattr(again, name), getattr(flight, name))
    for name in ("outcome", "time", "energy", "clearance", "transitions", "length", "episode_return"):
        assert getattr(again, name) == getattr(flight, name)
    np.testing.assert_array_equal(again.scenario.obstacles, flight.scenario.obstacles)
    assert again.interventions is None
    assert len(again.decision_ms) == 0


def test_an_empty_world_and_the_other_vehicle(tmp_path):
    env = gym.make("HydroneGym/WaterToAir-v0", num_obstacles=0, vehicle="physical")
    flight = fly(env, StraightLine.for_env(env), seed=1)
    (saved,) = read(document({"name": "a", **flight_record(flight)}, vehicle="physical"), tmp_path)
    again = restore(saved, simulation(0, "physical"))
    np.testing.assert_array_equal(again.trace.states, flight.trace.states)
    assert again.clearance == np.inf
    with pytest.raises(ValueError, match="a: its references no longer lead where they led"):
        restore(saved, simulation(0, "paper"))


def test_a_changed_number_is_found(flown, tmp_path):
    _, content = flown
    (record,) = content["flights"]
    states = [list(row) for row in record["states"]]
    states[4][1] += 0.01
    (saved,) = read(document({**record, "states": states}), tmp_path)
    with pytest.raises(ValueError, match=r"experiment-1: its references no longer lead where they led, 0\.01"):
        restore(saved, simulation(20))
    cut = {**record, "states": record["states"][:-3], "references": record["references"][:-3]}
    (saved,) = read(document(cut), tmp_path)
    restore(saved, simulation(20))
    longer = {name: record[name] + record[name][-1:] for name in ("states", "references")}
    (saved,) = read(document({**record, **longer}), tmp_path)
    with pytest.raises(ValueError, match="no longer lead where they led"):
        restore(saved, simulation(20))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: "[1, 2", "not complete JSON"),
        (lambda d: "[1, 2]", 'must be a file "hydrone_gym flights" of version 1, got None, None'),
        (lambda d: {**d, "format": "hydrone_gym scenario"}, "got 'hydrone_gym scenario', 1"),
        (lambda d: {**d, "version": 7}, "got 'hydrone_gym flights', 7"),
        (lambda d: {**d, "flights": []}, "holds no flight"),
        (lambda d: {**d, "flights": 3}, "damaged"),
        (lambda d: {**d, "vehicle": "boat"}, "damaged: .*boat"),
        (lambda d: without(d, "references"), "damaged: lacks 'references'"),
        (lambda d: without(d, "scenario"), "damaged: lacks 'scenario'"),
        (lambda d: changed(d, states=[[1.0] * 12]), "one state more than references, got 1 and"),
        (lambda d: changed(d, references=[[1.0] * 3]), "references must be rows of 4 finite numbers"),
        (lambda d: changed(d, states=[[float("nan")] * 12]), "states must be rows of 12 finite numbers"),
        (lambda d: changed(d, outcome="LOST"), "unknown outcome 'LOST'"),
        (lambda d: changed(d, time="long"), "damaged: could not convert"),
    ],
)
def test_other_files_are_refused(change, message, flown, tmp_path):
    with pytest.raises(ValueError, match=rf"flight\.json: .*{message}"):
        read(change(flown[1]), tmp_path)


def without(content, key):
    return document({name: value for name, value in content["flights"][0].items() if name != key})


def changed(content, **values):
    return document({**content["flights"][0], **values})
