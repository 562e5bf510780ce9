"""Records are plain and finite, figures are written, statistics are right."""

import json
import math

import gymnasium as gym
import numpy as np
import pytest

from hydrone_gym.evaluation import fly, percentiles, wilson_interval
from hydrone_gym.evaluation.flight_figures import draw_flight
from hydrone_gym.evaluation.saved import flight_record, plain
from planners import StraightLine


@pytest.fixture(scope="module")
def empty():
    env = gym.make("HydroneGym/WaterToAir-v0", num_obstacles=0)
    return env, fly(env, StraightLine.for_env(env), seed=0)


def numbers(value):
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        for entry in value:
            yield from numbers(entry)
    elif isinstance(value, float):
        yield value


def test_record_survives_json_and_is_finite(empty):
    _, flight = empty
    record = flight_record(flight)
    assert json.loads(json.dumps(record, allow_nan=False)) == record
    assert all(map(math.isfinite, numbers(record)))
    assert flight.clearance == math.inf
    assert record["clearance"] is None
    assert record["outcome"] == "GOAL"
    assert record["success"] is True
    assert record["time"] == flight.time
    np.testing.assert_array_equal(record["states"], flight.states)
    np.testing.assert_array_equal(record["references"], flight.references)
    assert record["planning_ms"]["p50"] == pytest.approx(np.median(flight.decision_ms))
    assert record["scenario"]["goal"] == [-9.0, 9.0, 7.0]


def test_plain_turns_what_json_lacks_into_null():
    mixed = {"a": np.array([1.0, np.nan]), 2: (np.float64(np.inf), np.int64(3), "x"), "b": None}
    assert plain(mixed) == {"a": [1.0, None], "2": [None, 3, "x"], "b": None}


def test_figures_are_written(empty, tmp_path):
    env, flight = empty
    files = draw_flight(flight, env.unwrapped.simulation, tmp_path, "experiment-2")
    assert sorted(file.name for file in files) == sorted(
        f"experiment-2-{kind}.{suffix}" for kind in ("path", "position", "attitude") for suffix in ("png", "pdf")
    )
    for file in files:
        assert file.read_bytes()[:4] == (b"\x89PNG" if file.suffix == ".png" else b"%PDF")
        assert file.stat().st_size > 5000


@pytest.mark.parametrize(("successes", "trials"), [(0, 10), (7, 10), (200, 200), (1, 3)])
def test_wilson_interval_is_the_closed_form(successes, trials):
    z, p, n = 1.959963984540054, successes / trials, trials
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    low, high = wilson_interval(successes, trials)
    assert low == pytest.approx(middle - half, abs=1e-9)
    assert high == pytest.approx(middle + half, abs=1e-9)


@pytest.mark.parametrize(("successes", "trials"), [(3, 2), (-1, 2), (0, 0)])
def test_wilson_interval_refuses_impossible_counts(successes, trials):
    with pytest.raises(ValueError, match="successes must lie between 0 and the number of trials"):
        wilson_interval(successes, trials)


def test_percentiles():
    assert percentiles([4.0, 1.0, 3.0, 2.0], (0.0, 50.0, 100.0)) == [1.0, 2.5, 4.0]
    assert percentiles([], (50.0, 99.0)) == [None, None]
